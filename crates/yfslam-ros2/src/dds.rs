//! DDS, by `ros2-client` and RustDDS: no ROS installation is needed.
//!
//! One thread receives everything and hands it to the [`Inbox`]; the node sends from its own thread. The names of types lead other nodes to
//! ours. `ros2-client` announces no hashes of types, which DDS implementations of ROS do not ask for.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result, anyhow};
use futures::channel::oneshot;
use futures::executor::LocalPool;
use futures::future::LocalBoxFuture;
use futures::stream::FuturesUnordered;
use futures::{FutureExt, StreamExt};
use ros2_client::qos::{Durability, History, WhenFull};
use ros2_client::{
    Context, ContextOptions, Message, MessageTypeName, Name, Node, NodeName, NodeOptions, ParameterValue, Publisher,
    QosProfile, Server, ServiceMapping, ServiceTypeName,
};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::inbox::Inbox;
use crate::messages::{
    CameraInfo, Clock, CompressedImage, DiagnosticArray, Image, MarkerArray, OccupancyGrid, Odometry, Path,
    PointCloud2, PoseWithCovarianceStamped, TfMessage, TriggerRequest, TriggerResponse,
};
use crate::parameters::{Parameters, Value, find};
use crate::ros_args::Names;
use crate::transport::{Command, Incoming, Outgoing, Picture, Request, Topic, Transport};

/// Messages that wait to be sent, or to be read.
const DEPTH: usize = 10;
/// Images that wait to be read.
const IMAGES: usize = 5;
/// A publisher waits no longer for a slow listener; the message is then left out and counted.
const PATIENCE: Duration = Duration::from_millis(2);
/// Answers that wait.
const ANSWERS: usize = 64;

impl Message for TriggerRequest {}
impl Message for TriggerResponse {}

type Handler = Arc<Mutex<Inbox>>;
type Task = LocalBoxFuture<'static, ()>;
/// Makes a task on the thread on which it runs.
type MakeTask = Box<dyn FnOnce() -> Task + Send>;
type Answer = Box<dyn FnOnce(TriggerResponse) + Send>;

/// The node in DDS.
pub struct Dds {
    node: Node,
    odometry: Publisher<Odometry>,
    pose: Publisher<PoseWithCovarianceStamped>,
    tf: Publisher<TfMessage>,
    tf_static: Publisher<TfMessage>,
    path: Publisher<Path>,
    grid: Publisher<OccupancyGrid>,
    landmarks: Publisher<PointCloud2>,
    graph: Publisher<MarkerArray>,
    people: Publisher<MarkerArray>,
    diagnostics: Publisher<DiagnosticArray>,
    unsent: u64,
    answers: Arc<Mutex<BTreeMap<u64, Answer>>>,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

/// Joins the network, and begins to receive.
///
/// # Errors
/// The network cannot be used, a name is not allowed, or a thread cannot be started.
pub fn start(names: &Names, domain: u16, parameters: &Parameters, inbox: Inbox) -> Result<Dds> {
    let inbox = Arc::new(Mutex::new(inbox));
    let options = ContextOptions::new().domain_id(domain);
    let context = Context::with_options(options).map_err(wrong("DDS cannot be started"))?;
    let node_name = NodeName::new(&names.namespace, &names.node)
        .map_err(|error| anyhow!("{} {} is no name of a node: {error:?}", names.namespace, names.node))?;
    let mut node =
        context.new_node(node_name, node_options(parameters, &inbox)).map_err(wrong("the node cannot be made"))?;
    let mut tasks: Vec<MakeTask> = Vec::new();
    let spinner = node.spinner().map_err(wrong("the node cannot run"))?;
    tasks.push(Box::new(move || spinner.spin().map(|_| ()).boxed_local()));
    subscribe_all(&mut node, names, parameters, &inbox, &mut tasks)?;
    let answers = Arc::new(Mutex::new(BTreeMap::new()));
    serve_all(&mut node, names, parameters, &inbox, &answers, &mut tasks)?;
    let (stop, stopped) = oneshot::channel();
    let run = move || {
        let mut all: FuturesUnordered<Task> = tasks.into_iter().map(|make| make()).collect();
        let until_stopped = async {
            let work = async { while all.next().await.is_some() {} };
            futures::future::select(stopped, work.boxed_local()).await;
        };
        LocalPool::new().run_until(until_stopped);
    };
    let thread = std::thread::Builder::new().name("yfslam-dds".into()).spawn(run).context("no thread for DDS")?;
    Ok(Dds {
        odometry: publisher(&mut node, names, Topic::Odometry)?,
        pose: publisher(&mut node, names, Topic::Pose)?,
        tf: publisher(&mut node, names, Topic::Tf)?,
        tf_static: publisher(&mut node, names, Topic::TfStatic)?,
        path: publisher(&mut node, names, Topic::Path)?,
        grid: publisher(&mut node, names, Topic::Grid)?,
        landmarks: publisher(&mut node, names, Topic::Landmarks)?,
        graph: publisher(&mut node, names, Topic::Graph)?,
        people: publisher(&mut node, names, Topic::People)?,
        diagnostics: publisher(&mut node, names, Topic::Diagnostics)?,
        unsent: 0,
        node,
        answers,
        stop: Some(stop),
        thread: Some(thread),
    })
}

fn wrong<E: Display>(what: &str) -> impl Fn(E) -> anyhow::Error {
    move |error| anyhow!("{what}: {error}")
}

fn deliver(inbox: &Handler, message: Incoming) {
    inbox.lock().unwrap_or_else(PoisonError::into_inner).deliver(message, Instant::now());
}

/// Declares the parameters. Those that only count at the start are refused later.
fn node_options(parameters: &Parameters, inbox: &Handler) -> NodeOptions {
    let mut options = NodeOptions::new().enable_rosout(true);
    for (name, value) in parameters.iter().filter(|(name, _)| *name != "use_sim_time") {
        options = options.declare_parameter(name, to_ros(value));
    }
    let (to, at_start, now) = (inbox.clone(), parameters.clone(), parameters.clone());
    options
        .parameter_validator(Box::new(move |name, value| checked(&at_start, name, value).map(|_| ())))
        .parameter_set_action(Box::new(move |name, value| {
            let (name, value) = checked(&now, name, value)?;
            deliver(&to, Incoming::Parameter(name, value));
            Ok(())
        }))
}

/// Checks a new value. That of the start is always right: with it the parameters are declared.
fn checked(
    at_start: &Parameters,
    name: &str,
    value: &ParameterValue,
) -> std::result::Result<(&'static str, Value), String> {
    let parameter = find(name)?;
    let value = parameter.check(&from_ros(value))?;
    if !parameter.live && !at_start.iter().any(|known| known == (parameter.name, &value)) {
        return Err(format!("{name} counts at the start only; restart the node with it"));
    }
    Ok((parameter.name, value))
}

fn to_ros(value: &Value) -> ParameterValue {
    match value {
        Value::Bool(value) => ParameterValue::Boolean(*value),
        Value::Integer(value) => ParameterValue::Integer(*value),
        Value::Number(value) => ParameterValue::Double(*value),
        Value::Text(value) => ParameterValue::String(value.clone()),
    }
}

fn from_ros(value: &ParameterValue) -> Value {
    match value {
        ParameterValue::Boolean(value) => Value::Bool(*value),
        ParameterValue::Integer(value) => Value::Integer(*value),
        ParameterValue::Double(value) => Value::Number(*value),
        ParameterValue::String(value) => Value::Text(value.clone()),
        other => Value::Text(format!("{other:?}")),
    }
}

fn topic(node: &Node, full: &str, (package, name): (&str, &str), qos: &QosProfile) -> Result<rustdds::Topic> {
    let parsed = Name::parse(full).map_err(|error| anyhow!("{full} is no name of a topic: {error:?}"))?;
    node.create_topic(&parsed, MessageTypeName::new(package, name), qos).map_err(wrong(full))
}

fn publisher<M: Serialize>(node: &mut Node, names: &Names, of: Topic) -> Result<Publisher<M>> {
    let qos = QosProfile::publisher_default().reliability_reliable(WhenFull::Wait(PATIENCE));
    let qos = match of.is_latched() {
        true => qos.durability(Durability::TransientLocal).history(History::KeepLast { depth: 1 }),
        false => qos.history(History::KeepLast { depth: DEPTH }),
    };
    let topic = topic(node, &names.resolve(of.name()), of.message_type(), &qos)?;
    node.create_publisher(&topic, Some(qos)).map_err(wrong(of.name()))
}

fn subscribe<M: DeserializeOwned + Send + 'static>(
    node: &mut Node,
    full: &str,
    of: (&str, &str),
    qos: QosProfile,
    inbox: &Handler,
    convert: impl Fn(M) -> Incoming + Send + 'static,
) -> Result<MakeTask> {
    let topic = topic(node, full, of, &qos)?;
    let subscription = node.create_subscription::<M>(&topic, Some(qos)).map_err(wrong(full))?;
    let (inbox, name) = (inbox.clone(), full.to_owned());
    Ok(Box::new(move || {
        async move {
            let mut messages = std::pin::pin!(subscription.async_stream());
            while let Some(message) = messages.next().await {
                let message = message.map_or_else(
                    |error| Incoming::Damaged(format!("{name}: {error:?}")),
                    |(message, _)| convert(message),
                );
                deliver(&inbox, message);
            }
        }
        .boxed_local()
    }))
}

fn subscribe_all(
    node: &mut Node,
    names: &Names,
    parameters: &Parameters,
    inbox: &Handler,
    tasks: &mut Vec<MakeTask>,
) -> Result<()> {
    let sensor = QosProfile::subscription_default().history(History::KeepLast { depth: IMAGES });
    let reliable = QosProfile::publisher_default().history(History::KeepLast { depth: 100 });
    let images = match parameters.text("image_reliability") {
        "reliable" => reliable.clone().history(History::KeepLast { depth: IMAGES }),
        _ => sensor.clone(),
    };
    let full = |parameter: &str| names.resolve(parameters.text(parameter));
    let is_packed = |name: &str| name.ends_with("/compressed") || name.ends_with("/compressedDepth");
    let (raw, packed) = (("sensor_msgs", "Image"), ("sensor_msgs", "CompressedImage"));
    type Wrap = fn(Picture) -> Incoming;
    for (name, wrap) in [(full("color_topic"), Incoming::Color as Wrap), (full("depth_topic"), Incoming::Depth as Wrap)]
    {
        tasks.push(if is_packed(&name) {
            subscribe(node, &name, packed, images.clone(), inbox, move |image: CompressedImage| {
                wrap(Picture::Compressed(image))
            })?
        } else {
            subscribe(node, &name, raw, images.clone(), inbox, move |image: Image| wrap(Picture::Raw(image)))?
        });
    }
    let info = full("camera_info_topic");
    tasks.push(subscribe(node, &info, ("sensor_msgs", "CameraInfo"), images, inbox, |info: CameraInfo| {
        Incoming::CameraInfo(info)
    })?);
    let tf = ("tf2_msgs", "TFMessage");
    tasks.push(subscribe(node, &names.resolve("/tf"), tf, reliable.clone(), inbox, Incoming::Tf)?);
    let latched = reliable.clone().durability(Durability::TransientLocal);
    tasks.push(subscribe(node, &names.resolve("/tf_static"), tf, latched, inbox, Incoming::TfStatic)?);
    let pose = ("geometry_msgs", "PoseWithCovarianceStamped");
    tasks.push(subscribe(node, &names.resolve("/initialpose"), pose, reliable, inbox, Incoming::InitialPose)?);
    if parameters.flag("use_sim_time") {
        let clock = |clock: Clock| Incoming::Clock(clock.clock.to_ns());
        tasks.push(subscribe(node, "/clock", ("rosgraph_msgs", "Clock"), sensor, inbox, clock)?);
    }
    Ok(())
}

fn serve_all(
    node: &mut Node,
    names: &Names,
    parameters: &Parameters,
    inbox: &Handler,
    answers: &Arc<Mutex<BTreeMap<u64, Answer>>>,
    tasks: &mut Vec<MakeTask>,
) -> Result<()> {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    let mapping =
        if parameters.text("rmw") == "cyclonedds" { ServiceMapping::Cyclone } else { ServiceMapping::Enhanced };
    for command in Command::ALL {
        let full = names.resolve(&format!("~/{}", command.name()));
        let name = Name::parse(&full).map_err(|error| anyhow!("{full} is no name of a service: {error:?}"))?;
        let qos = QosProfile::publisher_default().history(History::KeepLast { depth: DEPTH });
        let of = ServiceTypeName::new("std_srvs", "Trigger");
        let server: Server<TriggerRequest, TriggerResponse> =
            node.create_server(mapping, &name, &of, qos.clone(), qos).map_err(wrong(&full))?;
        let (inbox, answers) = (inbox.clone(), answers.clone());
        let serve = async move {
            let server = Arc::new(server);
            let requests = server.clone();
            let mut requests = std::pin::pin!(requests.receive_request_stream());
            while let Some(request) = requests.next().await {
                let Ok((sender, _)) = request else { continue };
                let (id, server) = (NEXT.fetch_add(1, Ordering::Relaxed), server.clone());
                let answer: Answer = Box::new(move |response| {
                    if let Err(error) = server.send_response(sender, response) {
                        tracing::warn!("an answer could not be sent: {error:?}");
                    }
                });
                let mut waiting = answers.lock().unwrap_or_else(PoisonError::into_inner);
                // Who asks more often than the node can answer gets no answer to the oldest requests.
                if waiting.len() >= ANSWERS {
                    waiting.pop_first();
                }
                waiting.insert(id, answer);
                drop(waiting);
                deliver(&inbox, Incoming::Request(Request { command, id }));
            }
        };
        tasks.push(Box::new(move || serve.boxed_local()));
    }
    Ok(())
}

impl Transport for Dds {
    fn publish(&mut self, message: Outgoing) {
        let sent = match message {
            Outgoing::Odometry(message) => self.odometry.publish(*message).is_ok(),
            Outgoing::Pose(message) => self.pose.publish(*message).is_ok(),
            Outgoing::Tf(message) => self.tf.publish(message).is_ok(),
            Outgoing::TfStatic(message) => self.tf_static.publish(message).is_ok(),
            Outgoing::Path(message) => self.path.publish(message).is_ok(),
            Outgoing::Grid(message) => self.grid.publish(message).is_ok(),
            Outgoing::Landmarks(message) => self.landmarks.publish(message).is_ok(),
            Outgoing::Graph(message) => self.graph.publish(message).is_ok(),
            Outgoing::People(message) => self.people.publish(message).is_ok(),
            Outgoing::Diagnostics(message) => self.diagnostics.publish(message).is_ok(),
        };
        if !sent {
            self.unsent += 1;
            tracing::warn!("a message could not be sent, because a listener is too slow; {} so far", self.unsent);
        }
    }

    fn is_wanted(&self, topic: Topic) -> bool {
        let count = match topic {
            Topic::Path => self.path.get_subscription_count(&self.node),
            Topic::Landmarks => self.landmarks.get_subscription_count(&self.node),
            Topic::Graph => self.graph.get_subscription_count(&self.node),
            Topic::People => self.people.get_subscription_count(&self.node),
            _ => 1,
        };
        count > 0
    }

    fn reply(&mut self, request: Request, answer: Result<String, String>) {
        let waiting = self.answers.lock().unwrap_or_else(PoisonError::into_inner).remove(&request.id);
        if let Some(send) = waiting {
            let success = answer.is_ok();
            send(TriggerResponse { success, message: answer.unwrap_or_else(|error| error) });
        }
    }
}

impl Drop for Dds {
    fn drop(&mut self) {
        self.node.stop_spinner();
        drop(self.stop.take());
        // A panic of the thread was reported by the thread.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

//! The node: what happens with each frame, message and request, whatever carries them.
//!
//! In: an [`Outbox`] of received messages. Out: messages and answers through a [`Transport`], and files.

mod commands;
mod products;

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result, ensure};
use nalgebra::Isometry3;
use yfslam::{Camera, MapUse, Tracked};
use yfslam_io::message::types;
use yfslam_io::sequence::camera_of_topic;
use yfslam_live::{CameraEvent, LiveSession, LiveSource, Step};

use crate::convert::{self, NodeNotes};
use crate::grid_worker::GridWorker;
use crate::inbox::{Outbox, Received};
use crate::messages::{CameraInfo, Header, TfMessage};
use crate::mount::Mount;
use crate::odom_split::{OdomSplit, SpeedLimit};
use crate::parameters::Parameters;
use crate::slam_factory::{SlamFactory, load_map};
use crate::tf_tree::{GivenOdom, StaticTf};
use crate::transport::{Incoming, Outgoing, Topic, Transport};

/// Longest time that a request waits.
const TICK: Duration = Duration::from_millis(20);
/// Time between two diagnostics.
const DIAGNOSTICS: Duration = Duration::from_secs(1);
/// Odometry of another node may be older than an image by this much, ns.
const ODOM_AHEAD_NS: i64 = 200_000_000;
/// Own transforms that are remembered, to tell them from those of others.
const OWN_STAMPS: usize = 128;

/// The node.
pub struct Node<T> {
    transport: T,
    outbox: Outbox,
    parameters: Parameters,
    factory: SlamFactory,
    name: String,
    camera: Option<(Camera, String)>,
    /// When the calibration came.
    camera_since: Option<Instant>,
    mount: Option<Mount>,
    session: Option<LiveSession>,
    static_tf: StaticTf,
    given_odom: GivenOdom,
    is_odom_given: bool,
    own_stamps: std::collections::VecDeque<i64>,
    split: OdomSplit,
    /// Whether the map came from a file, whose frame is fixed.
    is_map_loaded: bool,
    /// Where `/initialpose` has moved the map frame.
    t_map_moved: Isometry3<f64>,
    resets: usize,
    is_localising: bool,
    problem: Option<String>,
    clock_ns: Option<i64>,
    last_stamp_ns: i64,
    last_pose: Option<Isometry3<f64>>,
    last_received: Received,
    grid: Option<GridWorker>,
    grid_note: Option<(f64, usize)>,
    grid_keyframes: usize,
    due: Due,
}

/// When something is to be done next.
struct Due {
    diagnostics: Instant,
    products: Instant,
    grid: Instant,
}

impl<T: Transport> Node<T> {
    /// Makes a node that begins at `now`.
    ///
    /// # Errors
    /// The configuration cannot be used, or a thread cannot be started.
    pub fn new(transport: T, outbox: Outbox, parameters: Parameters, name: &str, now: Instant) -> Result<Self> {
        let limit = SpeedLimit {
            linear_m_s: parameters.number("max_linear_speed"),
            angular_rad_s: parameters.number("max_angular_speed"),
        };
        let grid = parameters.flag("grid").then(GridWorker::start).transpose().context("no thread for grids")?;
        ensure!(
            !parameters.flag("localise_only") || !parameters.text("load_map").is_empty(),
            "localise_only needs a map; give load_map"
        );
        Ok(Self {
            factory: SlamFactory::new(&parameters)?,
            is_odom_given: parameters.text("odom") == "given",
            is_localising: parameters.flag("localise_only"),
            is_map_loaded: !parameters.text("load_map").is_empty(),
            transport,
            outbox,
            parameters,
            name: name.into(),
            camera: None,
            camera_since: None,
            mount: None,
            session: None,
            static_tf: StaticTf::default(),
            given_odom: GivenOdom::default(),
            own_stamps: std::collections::VecDeque::new(),
            split: OdomSplit::new(limit),
            t_map_moved: Isometry3::identity(),
            resets: 0,
            problem: None,
            clock_ns: None,
            last_stamp_ns: 0,
            last_pose: None,
            last_received: Received::default(),
            grid,
            grid_note: None,
            grid_keyframes: 0,
            due: Due { diagnostics: now, products: now, grid: now },
        })
    }

    /// Does what there is to do, and waits for a short time if there is nothing. Returns whether messages can still come.
    ///
    /// # Errors
    /// The map of an earlier session cannot be used: there is nothing that the node could do then.
    pub fn spin_once(&mut self) -> Result<bool> {
        while let Some(event) = self.outbox.event() {
            self.handle(event);
        }
        if self.session.is_none() {
            self.try_to_begin()?;
        }
        let is_open = match &mut self.session {
            Some(session) => {
                let step = session.step(&mut self.outbox.pairs, TICK);
                self.after(step)
            }
            // Images that come before the calibration are taken and left.
            None => !matches!(self.outbox.pairs.next(TICK), yfslam_live::Arrival::Ended),
        };
        self.publish_what_is_due(Instant::now());
        Ok(is_open)
    }

    fn handle(&mut self, event: Incoming) {
        match event {
            Incoming::CameraInfo(info) => self.take_camera(&info),
            Incoming::TfStatic(message) => self.static_tf.add(&message),
            Incoming::Tf(message) => self.take_tf(&message),
            Incoming::Clock(ns) => self.clock_ns = Some(ns),
            Incoming::InitialPose(pose) => self.set_initial_pose(&pose),
            Incoming::Request(request) => self.answer(request),
            Incoming::Parameter(name, value) => {
                if let Err(error) = self.parameters.set(name, &value) {
                    tracing::warn!("{error}");
                }
            }
            Incoming::Damaged(reason) => tracing::warn!("a message cannot be read: {reason}"),
            // Images go another way.
            Incoming::Color(_) | Incoming::Depth(_) => {}
        }
    }

    /// Takes the calibration. A robot sends it with every image; only the first one and changes count.
    fn take_camera(&mut self, info: &CameraInfo) {
        let topic = self.parameters.text("color_topic");
        let converted = types::CameraInfo {
            frame_id: info.header.frame_id.clone(),
            height: info.height,
            width: info.width,
            distortion_model: info.distortion_model.clone(),
            d: info.d.clone(),
            k: info.k,
            r: info.r,
            p: info.p,
            binning: info.binning,
            roi: info.roi,
        };
        match (camera_of_topic(&converted, topic), &self.camera) {
            (Err(problem), None) => self.report(format!("camera_info cannot be used: {problem}")),
            (Ok(camera), None) => {
                tracing::info!("camera {}x{}, frame {}", camera.width, camera.height, info.header.frame_id);
                self.problem = None;
                self.outbox.pairs.set_camera(camera.clone());
                self.camera = Some((camera, info.header.frame_id.clone()));
                self.camera_since = Some(Instant::now());
            }
            (Ok(camera), Some((used, _))) if camera != *used => self.report(format!(
                "camera_info has changed from {}x{}, fx {:.1} to {}x{}, fx {:.1}; restart the node to use it",
                used.width, used.height, used.fx, camera.width, camera.height, camera.fx
            )),
            (Err(problem), Some(_)) => self.report(format!("camera_info has become unusable: {problem}")),
            (Ok(_), Some(_)) => {}
        }
    }

    /// Notes a problem for the diagnostics, and logs it once.
    fn report(&mut self, problem: String) {
        if self.problem.as_ref() != Some(&problem) {
            tracing::warn!("{problem}");
            self.problem = Some(problem);
        }
    }

    fn take_tf(&mut self, message: &TfMessage) {
        let base = self.mount.as_ref().map_or(self.parameters.text("base_frame"), |mount| &mount.base_frame);
        for transform in &message.transforms {
            let stamp_ns = transform.header.stamp.to_ns();
            let is_odom = transform.child_frame_id.trim_start_matches('/') == base
                && transform.header.frame_id.trim_start_matches('/') == self.parameters.text("odom_frame");
            if !is_odom || self.own_stamps.contains(&stamp_ns) {
                continue;
            }
            if let Some(pose) = transform.transform.to_isometry() {
                self.given_odom.add(stamp_ns, pose);
                if !self.is_odom_given && self.parameters.text("odom") == "auto" {
                    self.is_odom_given = true;
                    tracing::info!(
                        "another node publishes {} to {base}; this one publishes the map only",
                        self.parameters.text("odom_frame")
                    );
                }
            }
        }
    }

    /// Begins, once it is known what the camera is and where.
    fn try_to_begin(&mut self) -> Result<()> {
        let (Some((camera, frame)), Some(since)) = (&self.camera, self.camera_since) else {
            if self.problem.is_none() && self.outbox.received().pairs > 0 {
                let topic = self.parameters.text("camera_info_topic").to_owned();
                self.report(format!("images come, but no camera_info on {topic}"));
            }
            return Ok(());
        };
        let is_late = since.elapsed().as_secs_f64() >= self.parameters.number("tf_timeout");
        let Some(mount) = Mount::find(&self.parameters, &self.static_tf, frame, is_late).map_err(anyhow::Error::msg)?
        else {
            return Ok(());
        };
        tracing::info!("pose of {frame} in {}: {}", mount.base_frame, mount.origin);
        let file = self.parameters.text("load_map");
        let map_use = if self.is_localising { MapUse::Localise } else { MapUse::Extend };
        let map = if file.is_empty() { None } else { Some((load_map(file)?, map_use)) };
        let slam = self.factory.build(camera, map)?;
        if mount.is_ours {
            let header = Header::new(self.now_ns(), &mount.base_frame);
            let transform = convert::transform(header, frame, mount.t_base_cam);
            self.transport.publish(Outgoing::TfStatic(TfMessage { transforms: vec![transform] }));
        }
        let patience = Duration::from_secs_f64(self.parameters.number("silence_timeout"));
        self.session = Some(LiveSession::new(slam, patience, Instant::now()));
        self.mount = Some(mount);
        Ok(())
    }

    /// Reports what a step brought; returns whether more can come.
    fn after(&mut self, step: Step) -> bool {
        match step {
            Step::Tracked { tracked, stamp_ns, clock, camera, .. } => {
                if let Some(event) = clock {
                    tracing::warn!("the clock of the images has jumped: {event:?}");
                }
                if let Some(CameraEvent::Back(silence)) = camera {
                    tracing::info!("images come again after {:.1} s", silence.as_secs_f64());
                }
                self.publish_pose(&tracked, stamp_ns, clock.is_some());
            }
            Step::Unusable(reason) => tracing::warn!("{reason}"),
            Step::Silent(silence) => tracing::warn!("no pair of images for {:.1} s", silence.as_secs_f64()),
            Step::Ended => return false,
            _ => {}
        }
        true
    }

    /// Publishes the pose of a frame, or notes that it is not known.
    fn publish_pose(&mut self, tracked: &Tracked, stamp_ns: i64, has_clock_jumped: bool) {
        let Some(session) = &self.session else { return };
        let resets = session.slam().statistics().resets;
        let is_new_map = std::mem::replace(&mut self.resets, resets) != resets;
        let (Some(mount), Some(t_world_cam)) = (&self.mount, tracked.t_world_cam) else {
            self.split.lose();
            self.last_pose = None;
            return;
        };
        self.last_stamp_ns = stamp_ns;
        let t_map_cam = self.t_map_moved * mount.t_map_world * t_world_cam;
        let t_map_base = t_map_cam * mount.t_base_cam.inverse();
        let is_corrected = tracked.loop_closure.is_some() || is_new_map;
        let step = self.split.update(tracked.timestamp_ns, t_map_base, is_corrected);
        self.last_pose = Some(t_map_base);
        if has_clock_jumped {
            self.given_odom = GivenOdom::default();
        }
        let in_map = convert::base_covariance(tracked.covariance.as_ref(), &t_map_cam, &mount.t_base_cam);
        let in_odom = convert::base_covariance(
            tracked.covariance.as_ref(),
            &(step.t_odom_base * mount.t_base_cam),
            &mount.t_base_cam,
        );
        let [map, odom] = ["map_frame", "odom_frame"].map(|name| self.parameters.text(name).to_owned());
        let base = mount.base_frame.clone();
        // Beside the odometry of another node, ours has a frame of its own.
        let visual = if self.is_odom_given { format!("{odom}_visual") } else { odom.clone() };
        let drift = self.parameters.number("odom_drift");
        let odometry = convert::odometry(Header::new(stamp_ns, &visual), &base, &step, &in_odom, drift);
        self.transport.publish(Outgoing::Odometry(Box::new(odometry)));
        self.transport.publish(Outgoing::Pose(Box::new(convert::pose(
            Header::new(stamp_ns, &map),
            t_map_base,
            &in_map,
        ))));
        let ahead_ns = (self.parameters.number("transform_tolerance") * 1e9) as i64;
        let ahead = Header::new(stamp_ns.saturating_add(ahead_ns), &map);
        let transforms = if self.parameters.text("odom") == "none" {
            vec![convert::transform(Header::new(stamp_ns, &map), &base, t_map_base)]
        } else if !self.is_odom_given {
            if self.own_stamps.len() == OWN_STAMPS {
                self.own_stamps.pop_front();
            }
            self.own_stamps.push_back(stamp_ns);
            vec![
                convert::transform(ahead, &odom, step.t_map_odom),
                convert::transform(Header::new(stamp_ns, &odom), &base, step.t_odom_base),
            ]
        } else if let Some(given) = self.given_odom.at(stamp_ns, ODOM_AHEAD_NS) {
            vec![convert::transform(ahead, &odom, t_map_base * given.inverse())]
        } else {
            self.report(format!("no transform from {odom} to {base} on /tf at the time of the images; check the clock of the other node, or set odom:=publish"));
            Vec::new()
        };
        if !transforms.is_empty() {
            self.transport.publish(Outgoing::Tf(TfMessage { transforms }));
        }
        if let (Some(session), Some((camera, _))) = (&self.session, &self.camera)
            && self.transport.is_wanted(Topic::People)
        {
            let regions = session.slam().moving_regions();
            let people = convert::people(&Header::new(stamp_ns, &map), regions, camera, &t_map_cam);
            self.transport.publish(Outgoing::People(people));
        }
    }

    /// Returns the time for messages that belong to no image, ns.
    fn now_ns(&self) -> i64 {
        match self.clock_ns.filter(|_| self.parameters.flag("use_sim_time")) {
            Some(ns) => ns,
            None => SystemTime::now()
                .duration_since(UNIX_EPOCH)
                .map_or(0, |since| i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)),
        }
    }

    /// Returns why images come, but no pairs, since the last diagnostics.
    fn what_is_missing(&self, received: &Received) -> Option<String> {
        let last = &self.last_received;
        if received.pairs != last.pairs {
            return None;
        }
        match (received.color > last.color, received.depth > last.depth) {
            (true, false) => {
                Some(format!("colour images come, but no depth images on {}", self.parameters.text("depth_topic")))
            }
            (false, true) => {
                Some(format!("depth images come, but no colour images on {}", self.parameters.text("color_topic")))
            }
            (true, true) => {
                let tolerance = self.parameters.number("sync_tolerance");
                Some(format!(
                    "colour and depth images come, but their stamps differ by more than sync_tolerance, {tolerance} s"
                ))
            }
            (false, false) => None,
        }
    }

    fn publish_what_is_due(&mut self, now: Instant) {
        if now >= self.due.diagnostics {
            self.due.diagnostics = now + DIAGNOSTICS;
            let health = self.session.as_ref().map(|session| session.health(now));
            let received = self.outbox.received();
            let missing = self.what_is_missing(&received);
            self.last_received = received;
            let notes = NodeNotes {
                node: self.name.clone(),
                problem: self.problem.clone().or(missing),
                received,
                grid: self.grid_note,
                is_localising: self.is_localising,
            };
            let diagnostics = convert::diagnostics(Header::new(self.now_ns(), ""), health.as_ref(), &notes);
            self.transport.publish(Outgoing::Diagnostics(diagnostics));
        }
        if now >= self.due.products {
            self.due.products = now + Duration::from_secs_f64(self.parameters.number("publish_period"));
            self.publish_products();
        }
        self.publish_grid(now);
    }
}

#[cfg(test)]
mod tests;

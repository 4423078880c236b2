//! The node without a network: messages in, messages out.
#![allow(clippy::unwrap_used, reason = "a test may")]

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::OnceLock;

use nalgebra::{Isometry3, Vector3};
use yfslam_synth::{SynthFrame, World};

use super::*;
use crate::inbox::{Inbox, inbox};
use crate::messages::{Bytes, Image, PoseWithCovariance, PoseWithCovarianceStamped, TransformStamped, rows};
use crate::mount::optical;
use crate::parameters::Value;
use crate::transport::{Command, Picture, Request, Topic};

const FRAMES: usize = 60;
const CAMERA: &str = "optical";

/// Keeps what is sent.
#[derive(Clone, Default)]
struct Kept {
    sent: Rc<RefCell<Vec<Outgoing>>>,
    answers: Rc<RefCell<Vec<Result<String, String>>>>,
}

impl Transport for Kept {
    fn publish(&mut self, message: Outgoing) {
        self.sent.borrow_mut().push(message);
    }

    fn is_wanted(&self, _: Topic) -> bool {
        true
    }

    fn reply(&mut self, _: Request, answer: Result<String, String>) {
        self.answers.borrow_mut().push(answer);
    }
}

fn world() -> &'static World {
    static WORLD: OnceLock<World> = OnceLock::new();
    let spec = format!("synth:sitting_xyz?people=0&width=320&height=240&frames={FRAMES}");
    WORLD.get_or_init(|| World::new(&yfslam_synth::parse(&spec).unwrap()).unwrap())
}

/// The frames of the world, rendered once for all tests.
fn shot(index: usize) -> &'static SynthFrame {
    static SHOTS: OnceLock<Vec<SynthFrame>> = OnceLock::new();
    &SHOTS.get_or_init(|| (0..FRAMES).map(|index| world().frame(index)).collect())[index]
}

struct Setup {
    node: Node<Kept>,
    inbox: Inbox,
    kept: Kept,
}

/// A node with these parameters, beside those that make tests quick and exact.
fn setup(parameters: &[(&str, &str)]) -> Setup {
    let mut all = Parameters::default();
    let usual = [
        ("method", "none"),
        ("threaded", "false"),
        ("tf_timeout", "0"),
        ("depth_units_per_metre", "5000"),
        ("silence_timeout", "3600"),
    ];
    for (name, value) in usual.iter().chain(parameters) {
        all.set(name, &Value::parse(value)).unwrap();
    }
    let (inbox, outbox) = inbox(20_000_000, world().config().depth_factor);
    let kept = Kept::default();
    let node = Node::new(kept.clone(), outbox, all, "yfslam", Instant::now()).unwrap();
    Setup { node, inbox, kept }
}

impl Setup {
    fn deliver(&mut self, message: Incoming) {
        assert!(self.inbox.deliver(message, Instant::now()));
    }

    fn info(&mut self) {
        let camera = &world().config().camera;
        self.deliver(Incoming::CameraInfo(CameraInfo {
            header: Header::new(0, CAMERA),
            width: 320,
            height: 240,
            distortion_model: "plumb_bob".into(),
            d: camera.distortion.to_vec(),
            k: [camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0],
            ..CameraInfo::default()
        }));
    }

    /// Delivers a pair of images with the stamp of the world, moved by `later_ns`, and lets the node work.
    fn pair(&mut self, index: usize, later_ns: i64) {
        let frame = &shot(index).frame;
        let header = Header::new(frame.timestamp_ns + later_ns, CAMERA);
        let depth = frame.depth.as_ref().unwrap();
        let raw: Vec<u8> = depth.raw.data().iter().flat_map(|value| value.to_le_bytes()).collect();
        let image = |encoding: &str, step, data| {
            let data = Bytes(data);
            Picture::Raw(Image {
                header: header.clone(),
                height: 240,
                width: 320,
                encoding: encoding.into(),
                is_bigendian: 0,
                step,
                data,
            })
        };
        self.deliver(Incoming::Color(image("rgb8", 960, frame.color.data().as_flattened().to_vec())));
        self.deliver(Incoming::Depth(image("16UC1", 640, raw)));
        assert!(self.node.spin_once().unwrap());
    }

    fn drive(&mut self) {
        self.info();
        (0..FRAMES).for_each(|index| self.pair(index, 0));
    }

    fn ask(&mut self, command: Command) -> Result<String, String> {
        self.deliver(Incoming::Request(Request { command, id: 0 }));
        self.node.spin_once().unwrap();
        self.kept.answers.borrow_mut().pop().unwrap()
    }

    fn sent<M>(&self, pick: impl Fn(&Outgoing) -> Option<M>) -> Vec<M> {
        self.kept.sent.borrow().iter().filter_map(pick).collect()
    }

    fn poses(&self) -> Vec<Isometry3<f64>> {
        self.sent(|message| match message {
            Outgoing::Pose(pose) => pose.pose.pose.to_isometry(),
            _ => None,
        })
    }

    fn transforms(&self, child: &str) -> Vec<TransformStamped> {
        let all = self.sent(|message| match message {
            Outgoing::Tf(message) => Some(message.transforms.clone()),
            _ => None,
        });
        all.into_iter().flatten().filter(|transform| transform.child_frame_id == child).collect()
    }

    /// Returns the last diagnostics, after another second.
    fn diagnostics(&mut self) -> crate::messages::DiagnosticStatus {
        self.node.due.diagnostics = Instant::now();
        self.node.spin_once().unwrap();
        let all = self.sent(|message| match message {
            Outgoing::Diagnostics(array) => Some(array.status[0].clone()),
            _ => None,
        });
        all.last().unwrap().clone()
    }
}

/// The true pose of the base in the map at a frame, for a base that is at the camera and looks forward.
fn truth(index: usize) -> Isometry3<f64> {
    let forward = Isometry3::from_parts(Vector3::zeros().into(), optical());
    let [first, now] = [0, index].map(|i| shot(i).t_world_cam);
    forward * (first.inverse() * now) * forward.inverse()
}

#[test]
fn each_pair_gives_odometry_a_pose_and_transforms_that_agree_with_the_truth() {
    let mut setup = setup(&[]);
    setup.drive();
    let poses = setup.poses();
    assert_eq!(poses.len(), FRAMES);
    for (index, pose) in poses.iter().enumerate() {
        let error = (pose.translation.vector - truth(index).translation.vector).norm();
        assert!(error < 0.02, "frame {index}: {error} m");
    }
    let (map, odom) = (setup.transforms("odom"), setup.transforms("base_link"));
    assert_eq!((map.len(), odom.len()), (FRAMES, FRAMES));
    for ((map, odom), pose) in map.iter().zip(&odom).zip(&poses) {
        assert_eq!((map.header.frame_id.as_str(), odom.header.frame_id.as_str()), ("map", "odom"));
        let chain = map.transform.to_isometry().unwrap() * odom.transform.to_isometry().unwrap();
        assert!((chain.inverse() * pose).translation.vector.norm() < 1e-9);
        // The correction is dated ahead by the tolerance.
        assert_eq!(map.header.stamp.to_ns() - odom.header.stamp.to_ns(), 100_000_000);
    }
    let odometry = setup.sent(|message| match message {
        Outgoing::Odometry(odometry) => Some(odometry.clone()),
        _ => None,
    });
    let last = odometry.last().unwrap();
    assert_eq!((last.header.frame_id.as_str(), last.child_frame_id.as_str()), ("odom", "base_link"));
    assert!(last.pose.covariance[0][0] > 0.0 && last.pose.covariance[0][0] < 0.01, "{:?}", last.pose.covariance);
    assert_eq!(setup.diagnostics().message, "tracking");
}

#[test]
fn in_lockstep_the_node_sends_the_same_bits_twice_and_those_of_the_library() {
    let drive = || {
        let mut setup = setup(&[("base_frame", "")]);
        setup.info();
        (0..20).for_each(|index| setup.pair(index, 0));
        setup
    };
    let (first, second) = (drive(), drive());
    assert_eq!(first.poses().len(), 20);
    assert_eq!(first.poses(), second.poses());
    let camera = first.node.camera.clone().unwrap().0;
    let mount = first.node.mount.clone().unwrap();
    let mut slam = first.node.factory.build(&camera, None).unwrap();
    let poses = (0..20).map(|index| {
        let mut frame = shot(index).frame.clone();
        frame.depth_timestamp_ns = Some(frame.timestamp_ns);
        // The images alone: the boxes of the world do not travel with messages.
        frame.detections = None;
        let t_world_cam = slam.track(&frame).unwrap().t_world_cam.unwrap();
        let pose = Isometry3::identity() * mount.t_map_world * t_world_cam * mount.t_base_cam.inverse();
        // As the message stores it.
        crate::messages::Pose::from(pose).to_isometry().unwrap()
    });
    assert_eq!(poses.collect::<Vec<_>>(), first.poses());
}

#[test]
fn the_mount_comes_from_tf_static_and_is_published_only_if_it_is_not_there() {
    let mount = Isometry3::from_parts(Vector3::new(0.3, 0.0, 0.5).into(), optical());
    let mut given = setup(&[]);
    let transform = TransformStamped {
        header: Header::new(0, "base_link"),
        child_frame_id: CAMERA.into(),
        transform: mount.into(),
    };
    given.deliver(Incoming::TfStatic(TfMessage { transforms: vec![transform] }));
    given.drive();
    let fixed = |setup: &Setup| setup.sent(|message| matches!(message, Outgoing::TfStatic(_)).then_some(())).len();
    assert_eq!(fixed(&given), 0);
    // The base moves otherwise than the camera, because it turns 0.5 m below it; it begins at the origin of the map.
    assert!(given.poses()[0].translation.vector.norm() < 1e-6);
    let mut assumed = setup(&[]);
    assumed.drive();
    assert_eq!(fixed(&assumed), 1);
    // While the transform may still come, nothing is published.
    let mut patient = setup(&[("tf_timeout", "600")]);
    patient.drive();
    assert!(patient.poses().is_empty());
}

#[test]
fn with_the_odometry_of_another_node_only_the_map_is_published() {
    let mut setup = setup(&[]);
    setup.info();
    let wheels = |stamp_ns: i64| {
        let pose = Isometry3::translation(7.0, 0.0, 0.0);
        let transform = TransformStamped {
            header: Header::new(stamp_ns, "odom"),
            child_frame_id: "base_link".into(),
            transform: pose.into(),
        };
        Incoming::Tf(TfMessage { transforms: vec![transform] })
    };
    for index in 0..FRAMES {
        let stamp_ns = shot(index).frame.timestamp_ns;
        setup.deliver(wheels(stamp_ns - 5_000_000));
        setup.deliver(wheels(stamp_ns + 5_000_000));
        setup.pair(index, 0);
    }
    assert!(setup.transforms("base_link").is_empty());
    let map = setup.transforms("odom");
    assert_eq!(map.len(), FRAMES);
    assert!((map[0].transform.to_isometry().unwrap().translation.x + 7.0).abs() < 0.02);
}

#[test]
fn our_own_transforms_are_not_taken_for_those_of_another_node() {
    let mut setup = setup(&[]);
    setup.info();
    for index in 0..FRAMES {
        setup.pair(index, 0);
        let own = setup.transforms("base_link").last().unwrap().clone();
        setup.deliver(Incoming::Tf(TfMessage { transforms: vec![own] }));
    }
    assert_eq!(setup.transforms("base_link").len(), FRAMES);
}

#[test]
fn what_is_wrong_with_the_input_is_said_and_passes() {
    let mut setup = setup(&[]);
    (0..2).for_each(|index| setup.pair(index, 0));
    let status = setup.diagnostics();
    assert!(status.level == 2 && status.message.contains("no camera_info on"), "{}", status.message);
    setup.info();
    setup.pair(2, 0);
    let small = Image {
        header: Header::new(shot(3).frame.timestamp_ns, CAMERA),
        height: 1,
        width: 1,
        encoding: "rgb8".into(),
        step: 3,
        data: Bytes(vec![0; 3]),
        ..Image::default()
    };
    setup.deliver(Incoming::Color(Picture::Raw(small.clone())));
    setup.deliver(Incoming::Depth(Picture::Raw(small)));
    setup.node.spin_once().unwrap();
    let status = setup.diagnostics();
    let value = |key: &str| status.values.iter().find(|pair| pair.key == key).unwrap().value.clone();
    assert_eq!(value("frames that cannot be used"), "1");
    assert!(value("last reason for that").contains("1×1"), "{}", value("last reason for that"));
    let lone = Image { header: Header::new(shot(4).frame.timestamp_ns - 1, CAMERA), ..Image::default() };
    setup.deliver(Incoming::Color(Picture::Raw(lone)));
    assert!(setup.diagnostics().message.contains("no depth images on"));
    // The stamps jump back by an hour, and tracking goes on.
    (4..8).for_each(|index| setup.pair(index, -3_600_000_000_000));
    assert_eq!(setup.poses().len(), 5);
    let last = setup.transforms("base_link").last().unwrap().header.stamp.to_ns();
    assert_eq!(last, shot(7).frame.timestamp_ns - 3_600_000_000_000);
}

#[test]
fn requests_are_answered_and_a_map_outlives_the_node() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("lab.map").display().to_string();
    let mut setup = setup(&[("map_file", &file)]);
    assert!(setup.ask(Command::SaveMap).unwrap_err().contains("no map yet"));
    setup.drive();
    assert!(setup.ask(Command::SaveMap).unwrap().contains("keyframes"));
    setup.ask(Command::Pause).unwrap();
    let before = setup.poses().len();
    setup.pair(9, 2_000_000_000);
    assert_eq!(setup.poses().len(), before);
    setup.ask(Command::Resume).unwrap();
    setup.ask(Command::Localise).unwrap();
    (10..20).for_each(|index| setup.pair(index, 2_000_000_000));
    let message = setup.diagnostics().message;
    assert!(setup.poses().len() > before, "the camera is not recognised in the map, which stays as it is: {message}");
    setup.ask(Command::Reset).unwrap();
    setup.pair(20, 2_000_000_000);
    assert!(setup.poses().last().unwrap().translation.vector.norm() < 1e-9, "a new map begins");
    setup.ask(Command::LoadMap).unwrap();
    (21..30).for_each(|index| setup.pair(index, 2_000_000_000));
    let error = (setup.poses().last().unwrap().translation.vector - truth(29).translation.vector).norm();
    assert!(error < 0.02, "{error} m from where the map has it that was loaded");

    // Tomorrow: the same file, the same frame.
    let mut tomorrow = self::setup(&[("load_map", &file), ("localise_only", "true")]);
    tomorrow.info();
    (10..20).for_each(|index| tomorrow.pair(index, 86_400_000_000_000));
    let error = (tomorrow.poses().last().unwrap().translation.vector - truth(19).translation.vector).norm();
    assert!(error < 0.02, "{error} m from where the map of yesterday has it");
}

#[test]
fn the_initial_pose_moves_the_map_frame_and_not_the_odometry() {
    let mut setup = setup(&[]);
    setup.info();
    (0..6).for_each(|index| setup.pair(index, 0));
    let wanted = Isometry3::new(Vector3::new(10.0, -2.0, 0.0), Vector3::z() * 0.5);
    let pose = PoseWithCovariance { pose: wanted.into(), covariance: rows(&nalgebra::Matrix6::zeros()) };
    setup.deliver(Incoming::InitialPose(PoseWithCovarianceStamped { header: Header::new(0, "map"), pose }));
    setup.pair(6, 0);
    let motion = truth(5).inverse() * truth(6);
    let error = (setup.poses()[6].translation.vector - (wanted * motion).translation.vector).norm();
    assert!(error < 0.01, "{error}");
    let odom: Vec<_> = setup.transforms("base_link").iter().map(|t| t.transform.to_isometry().unwrap()).collect();
    assert!(((odom[5].inverse() * odom[6]).translation.vector - motion.translation.vector).norm() < 0.01);
}

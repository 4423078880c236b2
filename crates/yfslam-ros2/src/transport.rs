//! What carries messages: DDS today. The node knows this trait only, so that others can follow and tests need no network.

use crate::messages::{
    CameraInfo, CompressedImage, DiagnosticArray, Image, MarkerArray, OccupancyGrid, Odometry, Path, PointCloud2,
    PoseWithCovarianceStamped, TfMessage,
};
use crate::parameters::Value;

/// Sends messages, and answers requests.
pub trait Transport {
    /// Sends a message. What cannot be sent is counted by the transport; the node goes on.
    fn publish(&mut self, message: Outgoing);

    /// Returns whether another node listens to a topic; messages that cost time are made for listeners only.
    fn is_wanted(&self, topic: Topic) -> bool;

    /// Answers a request.
    fn reply(&mut self, request: Request, answer: Result<String, String>);
}

/// A topic that is published.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Topic {
    Odometry,
    Pose,
    Tf,
    TfStatic,
    Path,
    Grid,
    Landmarks,
    Graph,
    People,
    Diagnostics,
}

/// A message that is sent.
#[derive(Clone, Debug, PartialEq)]
pub enum Outgoing {
    Odometry(Box<Odometry>),
    Pose(Box<PoseWithCovarianceStamped>),
    Tf(TfMessage),
    TfStatic(TfMessage),
    Path(Path),
    Grid(OccupancyGrid),
    Landmarks(PointCloud2),
    Graph(MarkerArray),
    People(MarkerArray),
    Diagnostics(DiagnosticArray),
}

/// An image as it was received.
#[derive(Clone, Debug, PartialEq)]
pub enum Picture {
    Raw(Image),
    Compressed(CompressedImage),
}

/// A message that was received.
#[derive(Clone, Debug, PartialEq)]
pub enum Incoming {
    Color(Picture),
    Depth(Picture),
    CameraInfo(CameraInfo),
    Tf(TfMessage),
    TfStatic(TfMessage),
    InitialPose(PoseWithCovarianceStamped),
    Clock(i64),
    Request(Request),
    /// A parameter was set; its value was checked.
    Parameter(&'static str, Value),
    /// A message that cannot be read, and why.
    Damaged(String),
}

/// A request to the node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    pub command: Command,
    /// For the transport.
    pub id: u64,
}

/// What can be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Command {
    SaveMap,
    Reset,
    Pause,
    Resume,
    /// The present map stays as it is from now on.
    Localise,
    /// The present map is extended again.
    Extend,
    /// The map of the parameter map_file takes the place of the present one.
    LoadMap,
}

impl Command {
    pub const ALL: [Self; 7] =
        [Self::SaveMap, Self::LoadMap, Self::Reset, Self::Pause, Self::Resume, Self::Localise, Self::Extend];

    /// Returns the name of its service, `~/NAME`.
    pub fn name(self) -> &'static str {
        match self {
            Self::SaveMap => "save_map",
            Self::Reset => "reset",
            Self::Pause => "pause",
            Self::Resume => "resume",
            Self::Localise => "localise",
            Self::Extend => "extend",
            Self::LoadMap => "load_map",
        }
    }
}

impl Topic {
    /// Returns the name, before remapping.
    pub fn name(self) -> &'static str {
        match self {
            Self::Odometry => "odom",
            Self::Pose => "~/pose",
            Self::Tf => "/tf",
            Self::TfStatic => "/tf_static",
            Self::Path => "~/path",
            Self::Grid => "map",
            Self::Landmarks => "~/landmarks",
            Self::Graph => "~/graph",
            Self::People => "~/people",
            Self::Diagnostics => "/diagnostics",
        }
    }

    /// Returns the package and the name of the type.
    pub fn message_type(self) -> (&'static str, &'static str) {
        match self {
            Self::Odometry => ("nav_msgs", "Odometry"),
            Self::Pose => ("geometry_msgs", "PoseWithCovarianceStamped"),
            Self::Tf | Self::TfStatic => ("tf2_msgs", "TFMessage"),
            Self::Path => ("nav_msgs", "Path"),
            Self::Grid => ("nav_msgs", "OccupancyGrid"),
            Self::Landmarks => ("sensor_msgs", "PointCloud2"),
            Self::Graph | Self::People => ("visualization_msgs", "MarkerArray"),
            Self::Diagnostics => ("diagnostic_msgs", "DiagnosticArray"),
        }
    }

    /// Returns whether a listener that comes late receives the last message (transient local).
    pub fn is_latched(self) -> bool {
        matches!(self, Self::TfStatic | Self::Grid)
    }
}

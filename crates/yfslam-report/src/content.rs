//! The content of a report, as plain data.

use yfslam_eval::{Evaluation, StampedPose};

/// Runs of one or more methods on one sequence.
#[derive(Clone, Debug)]
pub struct Report<'a> {
    /// Name of the sequence.
    pub sequence: &'a str,
    /// Facts about the sequence, as name and value.
    pub facts: Vec<(&'a str, String)>,
    /// Time stamps of all frames, sorted, ns.
    pub frames_ns: &'a [i64],
    /// Ground truth, sorted by time, if it is known.
    pub truth: Option<&'a [StampedPose]>,
    /// Methods; the others are compared with the first one.
    pub methods: Vec<MethodReport<'a>>,
    /// Stages that all methods share, such as rendering.
    pub shared_stages: Vec<Stage>,
    /// Wall time of everything together from the first frame to the last, s.
    pub wall_s: f64,
    /// Processor time of the whole process; `None` where it is not known.
    pub processor_time: Option<ProcessorTime>,
    /// Version of the program.
    pub version: &'a str,
    /// Command that produces this report again.
    pub command: String,
    /// The script with the function `yfScene`, which draws the map in three dimensions; empty to leave the map out.
    pub scene_script: &'a str,
}

/// The run of one method.
#[derive(Clone, Debug)]
pub struct MethodReport<'a> {
    /// Short name.
    pub name: &'a str,
    /// Description in a few words.
    pub summary: &'a str,
    /// Poses of the tracked frames, sorted by time.
    pub trajectory: &'a [StampedPose],
    /// Errors of the trajectory; `None` without ground truth, or if the trajectory cannot be evaluated.
    pub evaluation: Option<&'a Evaluation>,
    /// Counts of frames.
    pub frames: Frames,
    /// Durations.
    pub times: Times,
    /// Snapshots, in order of time.
    pub snapshots: Vec<Snapshot>,
    /// Dense map, if one was made.
    pub dense: Option<DenseMapImages>,
    /// Landmarks of the final map in the world of the trajectory, with their colours.
    pub landmarks: Vec<([f32; 3], [u8; 3])>,
    /// Poses of the keyframes, world from camera.
    pub keyframes: &'a [StampedPose],
    /// Configuration, as text.
    pub config: String,
}

/// Counts of frames.
#[derive(Clone, Debug, Default)]
pub struct Frames {
    /// All frames.
    pub total: usize,
    /// Tracked frames.
    pub tracked: usize,
    /// Frames in which the camera was lost.
    pub lost: usize,
    /// Unusable frames, by kind of fault.
    pub skipped: Vec<(String, usize)>,
}

/// Durations.
#[derive(Clone, Debug, Default)]
pub struct Times {
    /// Wall time of the stages.
    pub stages: Vec<Stage>,
    /// Wall time of tracking over all frames, s.
    pub tracking_s: f64,
}

/// Processor time of the whole process for one frame, all threads and methods together.
#[derive(Clone, Debug, Default)]
pub struct ProcessorTime {
    /// The total, ms.
    pub total_ms: f64,
    /// What it consists of, ms; the last part is the rest.
    pub parts: Vec<(String, f64)>,
}

/// Wall time of one stage.
#[derive(Clone, Debug)]
pub struct Stage {
    /// Name of the stage.
    pub name: String,
    /// Number of runs.
    pub count: usize,
    /// Median, ms.
    pub median_ms: f64,
    /// 99th percentile, ms.
    pub p99_ms: f64,
}

/// An image of one frame.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Number of the frame, from 0.
    pub frame: usize,
    /// Why this frame is shown, if there is a reason.
    pub note: &'static str,
    /// The image as JPEG.
    pub jpeg: Vec<u8>,
    /// Width and height, px.
    pub size: [usize; 2],
    /// Number of static features, and of dynamic features.
    pub features: [usize; 2],
}

/// Images of a dense map.
#[derive(Clone, Debug)]
pub struct DenseMapImages {
    /// Number of its keyframes.
    pub keyframes: usize,
    /// Number of occupied voxels.
    pub occupied: usize,
    /// Side of a voxel, m.
    pub resolution_m: f32,
    /// From above and from a corner: JPEG, with width and height, px.
    pub views: [(Vec<u8>, [usize; 2]); 2],
}

impl Frames {
    /// Returns the share of tracked frames, %.
    pub fn tracked_percent(&self) -> f64 {
        if self.total == 0 { 0.0 } else { 100.0 * self.tracked as f64 / self.total as f64 }
    }
}

//! The content of a report, as plain data.

use yfslam_eval::{Evaluation, StampedPose};

/// What a report is about.
#[derive(Clone, Debug)]
pub struct Report<'a> {
    /// Name of the sequence.
    pub sequence: &'a str,
    /// What else there is to know of it, as name and value.
    pub facts: Vec<(&'a str, String)>,
    /// Stamps of all frames, sorted, ns.
    pub frames_ns: &'a [i64],
    /// The true trajectory, sorted by time, if it is known.
    pub truth: Option<&'a [StampedPose]>,
    /// The methods; the others are compared with the first.
    pub methods: Vec<MethodReport<'a>>,
    /// Stages that all methods share, such as rendering.
    pub shared_stages: Vec<Stage>,
    /// Wall time from the first frame to the last, of everything together, s.
    pub wall_s: f64,
    /// Processor time of the whole process; `None` where it is not known.
    pub processor_time: Option<ProcessorTime>,
    /// Version of the program.
    pub version: &'a str,
    /// The command that gives this report again.
    pub command: String,
}

/// What one method made of the sequence.
#[derive(Clone, Debug)]
pub struct MethodReport<'a> {
    /// Short name.
    pub name: &'a str,
    /// What it does, in a few words.
    pub summary: &'a str,
    /// Poses of the tracked frames, sorted by time.
    pub trajectory: &'a [StampedPose],
    /// Errors of the trajectory; `None` without truth, or if the two cannot be compared.
    pub evaluation: Option<&'a Evaluation>,
    /// What became of the frames.
    pub frames: Frames,
    /// Where the time went.
    pub times: Times,
    /// Pictures of some moments, in order of time.
    pub pictures: Vec<Picture>,
    /// Its dense map, if one was made.
    pub dense: Option<DenseMap>,
    /// The configuration, as text.
    pub config: String,
}

/// What became of the frames.
#[derive(Clone, Debug, Default)]
pub struct Frames {
    /// All frames.
    pub total: usize,
    /// Those whose pose is known.
    pub tracked: usize,
    /// Those without a pose after the map was begun.
    pub lost: usize,
    /// Those that could not be used, by kind of fault.
    pub skipped: Vec<(String, usize)>,
}

/// Where the time went.
#[derive(Clone, Debug, Default)]
pub struct Times {
    /// Wall time of the stages.
    pub stages: Vec<Stage>,
    /// Wall time of tracking alone, all frames together, s.
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
    /// Its name.
    pub name: String,
    /// How often it ran.
    pub count: usize,
    /// Median, ms.
    pub median_ms: f64,
    /// 99th percentile, ms.
    pub p99_ms: f64,
}

/// A picture of one moment.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Number of the frame, from 0.
    pub frame: usize,
    /// Why this moment is shown, if there is a reason.
    pub note: &'static str,
    /// The picture as PNG.
    pub png: Vec<u8>,
    /// Width and height, px.
    pub size: [usize; 2],
    /// Features that were trusted, and those that were not.
    pub features: [usize; 2],
}

/// Pictures of a dense map.
#[derive(Clone, Debug)]
pub struct DenseMap {
    /// Keyframes that it is made of.
    pub keyframes: usize,
    /// Voxels that are occupied.
    pub occupied: usize,
    /// Side of a voxel, m.
    pub resolution_m: f32,
    /// From above and from a corner: as PNG, with width and height, px.
    pub views: [(Vec<u8>, [usize; 2]); 2],
}

impl Frames {
    /// Share of all frames whose pose is known, %.
    pub fn tracked_percent(&self) -> f64 {
        if self.total == 0 { 0.0 } else { 100.0 * self.tracked as f64 / self.total as f64 }
    }
}

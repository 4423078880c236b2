//! Accuracy of an estimated trajectory against a reference: ATE, RPE, tracked fraction, improvement.
//!
//! ```text
//! reference ─┐                    ┌─ ate ── align (SE(3), Sim(3)) ─┐
//!            ├─ associate ─ Match ┤                                ├─ Statistics
//! estimate ──┘                    └─ rpe ── pairs (frames, s, m) ──┘
//! ```
//!
//! In: two trajectories as slices of [`StampedPose`]. Out: results that serialise with serde. The metrics are those of Sturm et al.,
//! "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012, and agree with the tool `evo`; paper §4.2 reports them.
//! [`evaluate`] does it all in one call; each step is public on its own.
#![forbid(unsafe_code)]

mod align;
mod associate;
mod calibrate;
mod coverage;
mod delta;
mod error;
mod evaluate;
mod paired;
mod pose;
mod published;
mod rpe;
mod statistics;

pub use align::{Alignment, AlignmentKind, Ate, align, ate, horn_matrix};
pub use associate::{DEFAULT_MAX_DIFF_NS, Match, associate};
pub use calibrate::{Calibration, calibrate};
pub use coverage::Coverage;
pub use delta::Delta;
pub use error::{EvalError, Trajectory};
pub use evaluate::{EvalOptions, Evaluation, ExpectedFrames, evaluate};
pub use paired::{Paired, paired};
pub use pose::StampedPose;
pub use published::{Measure, Published, published};
pub use rpe::{Rpe, RpeOptions, rpe};
pub use statistics::{Statistics, improvement_percent};

/// The example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

//! SLAM on a sequence, and its evaluation.

pub mod calibration;
pub mod cost;
pub mod dense;
pub mod evaluation;
pub mod map_args;
pub mod method_run;
pub mod pipeline;
pub mod resume;
pub mod shared_detector;

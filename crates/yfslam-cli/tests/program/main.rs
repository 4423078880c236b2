//! Tests of the program from outside: one binary, so that it is linked once and all processors have work until the end.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    dead_code,
    reason = "a test may, and it uses a part of what it shares"
)]

mod bad_input;
mod bag_trajectories;
#[path = "../../../yfslam-io/tests/common/bags.rs"]
mod bag_writer;
mod bags;
mod bench;
mod calibrate;
mod classes;
mod commands;
mod common;
mod detect;
#[cfg(feature = "rten")]
mod detect_masks;
#[cfg(unix)]
mod failing_saves;
mod faults;
mod health;
mod html;
mod layouts;
mod live;
mod map;
mod masks;
mod methods;
mod mono;
mod real;
mod recognition;
mod researchers;
#[cfg(unix)]
mod resume;
mod rolling_shutter;
mod run;
#[cfg(unix)]
mod signals;
mod stereo;
mod structure;
mod suite;
mod synth;
mod video;

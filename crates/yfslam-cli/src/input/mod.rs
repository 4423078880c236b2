//! What a run works on: sequences, masks, boxes, detectors, trajectories, settings.

pub mod boxes;
pub mod detector;
pub mod instance_detector;
pub mod settings;
pub mod source;
pub mod trajectory;

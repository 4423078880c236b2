//! RGB-D visual SLAM for scenes in which people walk.
#![warn(missing_docs)]

pub mod camera;
pub mod config;
pub mod detection;
mod detector_thread;
pub mod dynamic;
pub mod features;
pub mod frame;
pub mod geometry;
pub mod image;
pub mod map;
pub mod mapping;
pub mod optimize;
pub mod sensor;
pub mod system;
pub mod tracking;

pub use camera::Camera;
pub use config::Config;
pub use detection::{BoundingBox, Detection, Detector, DetectorError};
pub use frame::RgbdFrame;
pub use system::{FrameRejected, SetupError, Slam, Tracked};

//! Finds people and things in an image: YOLO-FastestV2 on the CPU, one thread, no dependencies on other runtimes.
//!
//! ```text
//! model.onnx ─► onnx (protobuf) ─► graph (fused layers) ─► plan (memory, offsets)
//!                                                             │
//! RgbImage ─► preprocess (stretch, BGR) ─────────────────► run (kernels) ─► decode (anchors, NMS) ─► boxes
//! ```
//!
//! ```no_run
//! use yfslam::Detector;
//! use yfslam_detect::{DetectorConfig, YoloFastestV2};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let image = yfslam::image::RgbImage::new(640, 480);
//! let mut detector = YoloFastestV2::load("model.onnx".as_ref(), &DetectorConfig::default())?; // or YoloFastestV2::embedded
//! let mut found = Vec::new();
//! detector.detect(&image, &mut found)?;
//! # Ok(()) }
//! ```
//!
//! With the feature `rten`, `AnyYolo` runs YOLO networks of other architectures, slower and on all cores; [`load()`] takes whatever there is.
#![forbid(unsafe_code)]

#[cfg(feature = "rten")]
mod any_yolo;
mod config;
mod embedded;
mod engine;
mod error;
mod load;
mod network;
mod yolo;

#[cfg(feature = "rten")]
pub use any_yolo::AnyYolo;
pub use config::DetectorConfig;
pub use embedded::EMBEDDED_MODEL;
pub use engine::kernels::available_levels;
pub use error::ModelError;
pub use fearless_simd::Level;
pub use load::load;
pub use network::Network;
pub use yolo::{RawOutput, YoloFastestV2};

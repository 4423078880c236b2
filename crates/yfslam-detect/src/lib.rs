//! Detects people and objects in images: YOLO-FastestV2 on the CPU, on one thread, without another runtime.
//!
//! ```text
//! model.onnx ─► engine: onnx (protobuf) ─► graph (fused layers) ─► plan (memory, offsets)
//!                                                                     │
//! RgbImage ─► yolo: preprocess (stretch, BGR) ──────────────────► run (kernels) ─► yolo: decode (anchors, NMS) ─► boxes
//! ```
//!
//! ```no_run
//! use yfslam::Detector;
//! use yfslam_detect::{DetectorConfig, YoloFastestV2};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let image = yfslam::RgbImage::new(640, 480);
//! let mut detector = YoloFastestV2::load("model.onnx".as_ref(), &DetectorConfig::default())?; // or YoloFastestV2::embedded
//! let mut detections = Vec::new();
//! detector.detect(&image, &mut detections)?;
//! # Ok(()) }
//! ```
//!
//! With the feature `rten`, `AnyYolo` runs YOLO networks of other architectures, more slowly and on all cores; [`load()`] chooses
//! between them by the file.
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

#[cfg(feature = "rten")]
mod any_yolo;
mod config;
mod embedded;
mod engine; // the inference engine: ONNX graph → plan of fused layers → kernels
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

/// The example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

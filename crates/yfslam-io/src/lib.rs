//! Reads recordings, cameras and trajectories, and writes the products of a run.
//!
//! ```text
//! folder ──Sequence──► entries ──FrameStream──► Frame, or a FrameError for a frame that cannot be used
//!   TUM, EuRoC, ScanNet, …         decoded, stereo pairs rectified
//! preset or camera file of any dialect ──load_camera──► Camera ──complete_camera──► with the size of the images
//! frames ──FaultInjector──► frames as a faulty camera sends them ──RecordingWriter──► folder, with its BoxList
//! trajectory file ◄──► TrajectoryFile        points, images, text ──write_atomically──► files
//! ```
//!
//! An [`Error`] ends an operation: it names the file, what is wrong with which value, and what to do. A [`FrameError`] concerns one
//! frame; the caller counts it and continues.
//!
//! ```no_run
//! use yfslam_io::{FrameStream, Result, Sequence, SequenceOptions, check_recording, complete_camera, detect_camera, stream};
//!
//! fn play(folder: &std::path::Path) -> Result<()> {
//!     let sequence = Sequence::open(folder, &SequenceOptions::default())?;
//!     let mut camera = detect_camera(folder)?;
//!     complete_camera(&mut camera, &sequence)?;
//!     check_recording(&sequence, &camera)?;
//!     let mut skipped = 0;
//!     for frame in FrameStream::open(&sequence, &camera, stream::DEFAULT_LOOK_AHEAD)? {
//!         match frame {
//!             Ok(frame) => println!("{} ns: {} px wide", frame.timestamp_ns, frame.color.width()),
//!             Err(error) => skipped += 1,
//!         }
//!     }
//!     Ok(())
//! }
//! ```
#![forbid(unsafe_code)]

mod atomic_file;
pub mod bag;
pub mod boxes;
pub mod camera;
mod complete;
pub mod decode;
pub mod depth;
mod depth_resampling;
pub mod error;
pub mod faults;
mod frame_pipe;
pub mod message;
pub mod rectify;
mod rotation;
pub mod sequence;
pub mod stream;
mod text;
pub mod time;
mod timestamp_order;
pub mod trajectory;
pub mod video;
pub mod write;

pub use atomic_file::{AtomicFile, prepare_folder, write_atomically};
pub use bag::Bag;
pub use boxes::BoxList;
pub use camera::{CameraSource, detect_camera, load_camera};
pub use complete::complete_camera;
pub use depth::{DepthStatistics, check_recording};
pub use depth_resampling::DepthResampling;
pub use error::{Error, Result};
pub use faults::{Delivery, Fault, FaultInjector, FaultKind};
pub use frame_pipe::{FramePipe, PipeHeader};
pub use sequence::{Sequence, SequenceOptions};
pub use stream::{FrameError, FrameFault, FrameStream};
pub use text::{read_file, read_text};
pub use trajectory::{StampedPose, TrajectoryFile, read_trajectory, write_trajectory};
pub use write::RecordingWriter;

/// The example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

//! What a command leaves behind: folders, files, reports, summaries.

pub mod class_legend;
pub mod dense;
pub mod detections_file;
pub mod folder;
pub mod html;
pub mod map_frame;
mod overlay;
pub mod plots;
pub mod processor_time;
pub mod recorder;
mod recording;
pub mod report;
pub mod rle;
mod snapshots;
pub mod summary;
mod video;

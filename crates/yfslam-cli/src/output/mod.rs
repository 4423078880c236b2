//! What a command leaves behind: folders, files, reports, summaries.

pub mod class_legend;
pub mod detections_file;
pub mod folder;
pub mod html;
pub mod overlay;
pub mod report;
pub mod rle;
pub mod snapshots;
pub mod summary;

//! Detects the layout of a folder from the names of its files.

use std::path::Path;

use super::folders::ImageFolders;
use super::layout::Layout;
use super::{SequenceOptions, euroc, kitti};

/// Returns the layout of `folder` and why it was chosen. Where none fits, the layout of TUM reports what is missing.
pub fn layout(folder: &Path, options: &SequenceOptions) -> (Layout, String) {
    if let Some(layout) = options.layout {
        return (layout, "--layout".into());
    }
    let has = |name: &str| folder.join(name).is_file();
    if options.associations.is_some() {
        return (Layout::Tum, "--associations".into());
    }
    if options.color_folder.is_some() || options.depth_folder.is_some() {
        return (Layout::Folders, "--color and --depth".into());
    }
    if let Some(root) = euroc::root(folder) {
        return (Layout::Euroc, format!("it holds {}", root.join("cam0/data.csv").display()));
    }
    if kitti::is_sequence(folder) {
        return (Layout::Kitti, "it holds times.txt and image_2/ or image_0/".into());
    }
    for list in ["associations.txt", "rgb.txt"] {
        if has(list) {
            return (Layout::Tum, format!("it holds {list}"));
        }
    }
    match ImageFolders::find(folder, options) {
        Some(folders) => (Layout::Folders, folders.because()),
        None => (Layout::Tum, "no other layout fits".into()),
    }
}

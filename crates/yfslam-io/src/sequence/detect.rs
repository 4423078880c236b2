//! Detects the layout of a folder from the names of its files.

use std::path::Path;

use super::folders::ImageFolders;
use super::layout::Layout;
use super::{
    SequenceOptions, eth3d, euroc, icl_nuim, kitti, openloris, replica, scannet, seven_scenes, tum, vslam_lab,
};

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
    let because = |text: &str| text.to_owned();
    if crate::bag::is_bag(folder) {
        return (Layout::Bag, because("it begins like a bag or is named so"));
    }
    if crate::video::is_video(folder) {
        return (Layout::Video, because("it is a file that is named like a video"));
    }
    if let Some(root) = euroc::root(folder) {
        return (Layout::Euroc, format!("it holds {}", root.join("cam0/data.csv").display()));
    }
    if kitti::is_sequence(folder) {
        return (Layout::Kitti, because("it holds times.txt and image_2/ or image_0/"));
    }
    if has(vslam_lab::LIST) {
        return (Layout::VslamLab, because("it holds rgb.csv"));
    }
    if openloris::is_sequence(folder) {
        return (Layout::OpenLoris, because("it holds color.txt and aligned_depth.txt"));
    }
    if eth3d::is_sequence(folder) {
        return (Layout::Eth3d, because("it holds rgb.txt, and calibration.txt with four numbers"));
    }
    if icl_nuim::is_sequence(folder) {
        return (
            Layout::IclNuim,
            because("it holds associations.txt, and a file *.gt.freiburg or the name of a sequence of ICL-NUIM"),
        );
    }
    if let Some(list) = tum::lists(folder) {
        return (Layout::Tum, format!("it holds {list}"));
    }
    if seven_scenes::is_sequence(folder) {
        return (Layout::SevenScenes, because("it holds frame-000000.color.png or files of similar names"));
    }
    if replica::is_sequence(folder) {
        return (Layout::Replica, because("it holds results/frame000000.jpg or files of similar names"));
    }
    if scannet::is_sequence(folder) {
        return (Layout::ScanNet, because("it holds color/, depth/ and pose/"));
    }
    match ImageFolders::find(folder, options) {
        Some(folders) => (Layout::Folders, folders.because()),
        None => (Layout::Tum, because("no other layout fits")),
    }
}

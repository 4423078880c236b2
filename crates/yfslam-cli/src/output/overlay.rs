//! Images of what the dynamic filter decided, in the manner of the YF-SLAM paper's Fig. 7.
//!
//! In: a frame and the system that has just tracked it. Out: its image, and `overlay/000123.png`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use yfslam::{BoundingBox, DepthImage, Frame, Region, RgbImage, Slam};
use yfslam_io::prepare_folder;
use yfslam_io::write::write_color_png;

use super::folder::remove_files;
use crate::draw::colors::{BOX, DYNAMIC, STATIC, UNMATCHED, WEAK_BOX};
use crate::draw::shapes::{Color, disc, rectangle, ring, tint};

/// Folder of the images in the output folder.
const FOLDER: &str = "overlay";

/// Writes one image for each frame.
pub struct Overlay {
    folder: PathBuf,
    /// Score from which a box opens a track.
    open_score: f32,
}

impl Overlay {
    /// Prepares the folder `out/overlay`.
    ///
    /// # Errors
    /// Files cannot be written there.
    pub fn prepare(out: &Path, open_score: f32) -> Result<Self> {
        let folder = out.join(FOLDER);
        prepare_folder(&folder)
            .with_context(|| format!("--overlay: the folder {} cannot be used", folder.display()))?;
        Ok(Self { folder, open_score })
    }

    /// Writes the image of the frame that `slam` tracked last.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, index: usize, frame: &Frame, slam: &Slam) -> Result<()> {
        let image = draw_frame(frame, slam, self.open_score);
        Ok(write_color_png(&self.folder.join(format!("{index:06}.png")), &image)?)
    }
}

/// Removes the images of an earlier run from the output folder.
///
/// # Errors
/// An image cannot be removed.
pub fn remove(out: &Path) -> Result<()> {
    let folder = out.join(FOLDER);
    remove_files(&folder, is_overlay)?;
    // It stays if it holds files of others.
    let _ = std::fs::remove_dir(folder);
    Ok(())
}

/// Draws the frame that `slam` tracked last; boxes from `open_score` on open a track.
pub fn draw_frame(frame: &Frame, slam: &Slam, open_score: f32) -> RgbImage {
    let mut image = RgbImage::clone(&frame.color);
    for region in slam.moving_regions() {
        tint_region(&mut image, region, frame.depth.as_deref());
    }
    for detection in slam.detections() {
        outline(&mut image, &detection.bbox, if detection.score >= open_score { BOX } else { WEAK_BOX });
    }
    for region in slam.moving_regions() {
        outline(&mut image, &region.bbox, DYNAMIC);
    }
    for (index, feature) in slam.features().iter().enumerate() {
        match slam.is_matched(index) {
            _ if feature.trust <= 0.0 => disc(&mut image, feature.raw, 2.0, DYNAMIC),
            true => ring(&mut image, feature.raw, 1.5, 2.5, STATIC),
            false => disc(&mut image, feature.raw, 1.0, UNMATCHED),
        }
    }
    image
}

/// Returns whether [`Overlay::write`] gives files such a name.
fn is_overlay(name: &str) -> bool {
    name.strip_suffix(".png").is_some_and(|stem| stem.len() >= 6 && stem.bytes().all(|b| b.is_ascii_digit()))
}

/// Tints the pixels at the depth of the moving object; all pixels of the box if the region has no range of depth.
fn tint_region(image: &mut RgbImage, region: &Region, depth: Option<&DepthImage>) {
    let BoundingBox { x_min, y_min, x_max, y_max } = region.bbox;
    // A float cast saturates, and the size of the image bounds the rest.
    for y in y_min as usize..(y_max as usize).min(image.height()) {
        for x in x_min as usize..(x_max as usize).min(image.width()) {
            let moves = match region.depth_m {
                Some([near, far]) => depth.and_then(|depth| depth.metres(x, y)).is_some_and(|z| z >= near && z <= far),
                None => true,
            };
            if moves {
                tint(image, x, y, DYNAMIC, 0.35);
            }
        }
    }
}

fn outline(image: &mut RgbImage, bbox: &BoundingBox, color: Color) {
    let corner = |x: f32, y: f32| [x as i64, y as i64];
    rectangle(image, corner(bbox.x_min, bbox.y_min), corner(bbox.x_max - 1.0, bbox.y_max - 1.0), 2, color);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_images_of_an_earlier_run_are_removed() {
        assert!(is_overlay("000123.png") && is_overlay("1000000.png"));
        for name in ["123.png", "000123.jpg", "00012a.png", "holiday.png", "000123"] {
            assert!(!is_overlay(name), "{name}");
        }
    }
}

//! Images of what the dynamic filter decided, in the manner of the YF-SLAM paper's Fig. 7.
//!
//! In: a frame and the system that has just tracked it. Out: its image, and `overlay/000123.jpg`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use yfslam::{BoundingBox, DepthImage, Frame, Region, RgbImage, Slam, Tracked, TrackingState};
use yfslam_io::write::encode_jpeg;
use yfslam_io::{prepare_folder, write_atomically};

use super::folder::remove_files;
use crate::draw::colors::{BOX, DYNAMIC, STATIC, UNMATCHED, WEAK_BOX};
use crate::draw::shapes::{Color, disc, rectangle, ring, tint};
use crate::draw::text::{label, line_height};

/// Quality of the images.
const QUALITY: u8 = 90;
/// Folder of the images in the output folder.
const FOLDER: &str = "overlay";

/// Writes one image for each frame.
pub struct Overlay {
    folder: PathBuf,
}

/// Colours of texts.
const INK: Color = [255; 3];
const PAPER: Color = [0; 3];

impl Overlay {
    /// Prepares the folder `out/overlay`.
    ///
    /// # Errors
    /// Files cannot be written there.
    pub fn prepare(out: &Path) -> Result<Self> {
        let folder = out.join(FOLDER);
        prepare_folder(&folder)
            .with_context(|| format!("--overlay: the folder {} cannot be used", folder.display()))?;
        Ok(Self { folder })
    }

    /// Writes the image of frame `index`.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, index: usize, image: &RgbImage) -> Result<()> {
        let jpeg = encode_jpeg(image, QUALITY).context("--overlay: the image is too large for JPEG")?;
        Ok(write_atomically(&self.folder.join(format!("{index:06}.jpg")), |file| file.write_all(&jpeg))?)
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

/// Draws frame `index`, which `slam` tracked last, with its number, time since the first frame, state and inliers; `tracked` is `None` if it was
/// refused.
pub fn draw_captioned(
    index: usize,
    seconds: f64,
    frame: &Frame,
    tracked: Option<&Tracked>,
    slam: &Slam,
    open_score: f32,
) -> RgbImage {
    let mut image = draw_frame(frame, slam, open_score);
    let state = tracked.map_or_else(|| "refused".to_owned(), state_of);
    let bottom = image.height() as i64 - line_height(&image);
    label(&mut image, [0, bottom], &format!("frame {index}  {seconds:.2} s  {state}"), INK, PAPER);
    image
}

/// Describes the state of a frame in a few words.
pub fn state_of(tracked: &Tracked) -> String {
    let reason = tracked.lost_reason.map_or_else(String::new, |reason| format!(": {reason}"));
    match tracked.state {
        TrackingState::NotInitialized => format!("initialising{reason}"),
        TrackingState::Tracking => format!("tracking, {} inliers", tracked.inliers),
        TrackingState::Lost => format!("lost{reason}"),
    }
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
    for detection in slam.detections() {
        let (score, at) = (detection.score, [detection.bbox.x_min as i64, detection.bbox.y_min as i64]);
        label(&mut image, at, &format!("{score:.2}"), if score >= open_score { BOX } else { WEAK_BOX }, PAPER);
    }
    image
}

/// Returns whether [`Overlay::write`] gives files such a name.
fn is_overlay(name: &str) -> bool {
    // Earlier versions wrote PNG.
    let stem = name.strip_suffix(".jpg").or_else(|| name.strip_suffix(".png"));
    stem.is_some_and(|stem| stem.len() >= 6 && stem.bytes().all(|b| b.is_ascii_digit()))
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
        assert!(is_overlay("000123.png") && is_overlay("1000000.jpg"));
        for name in ["123.png", "000123.jpeg", "00012a.jpg", "holiday.jpg", "000123"] {
            assert!(!is_overlay(name), "{name}");
        }
    }
}

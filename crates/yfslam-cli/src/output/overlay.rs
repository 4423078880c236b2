//! Pictures of what the dynamic filter decided, in the manner of the YF-SLAM paper's Fig. 7.
//!
//! In: a frame and the system that has just seen it. Out: its picture, and `overlay/000123.png`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use yfslam::dynamic::Region;
use yfslam::image::{DepthImage, RgbImage};
use yfslam::{BoundingBox, RgbdFrame, Slam};
use yfslam_io::write::write_color_png;

use crate::draw::shapes::{Color, disc, rectangle, ring, tint};

const STATIC: Color = [60, 255, 60];
const UNMATCHED: Color = [0, 130, 0];
const DYNAMIC: Color = [255, 30, 30];
const BOX: Color = [255, 220, 0];
/// A box that keeps a track alive but would open none.
const WEAK_BOX: Color = [140, 120, 0];

/// The colours of all that is drawn.
pub const MARKS: [Color; 5] = [STATIC, UNMATCHED, DYNAMIC, BOX, WEAK_BOX];

/// Writes one picture a frame.
pub struct Overlay {
    folder: PathBuf,
    /// Score from which a box opens a track.
    open_score: f32,
}

impl Overlay {
    /// Pictures into `out/overlay`, where those of an earlier run are removed.
    ///
    /// # Errors
    /// An old picture cannot be removed.
    pub fn prepare(out: &Path, open_score: f32) -> Result<Self> {
        let folder = out.join("overlay");
        remove_pictures(&folder, is_picture)?;
        Ok(Self { folder, open_score })
    }

    /// Writes the picture of the frame that `slam` saw last.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, index: usize, frame: &RgbdFrame, slam: &Slam) -> Result<()> {
        let image = picture(frame, slam, self.open_score);
        Ok(write_color_png(&self.folder.join(format!("{index:06}.png")), &image)?)
    }
}

/// Removes the files of an earlier run, whose names are `ours`, from a folder that need not be there.
///
/// # Errors
/// One cannot be removed.
pub fn remove_pictures(folder: &Path, ours: impl Fn(&str) -> bool) -> Result<()> {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        if ours(&entry.file_name().to_string_lossy()) {
            let path = entry.path();
            std::fs::remove_file(&path).with_context(|| format!("cannot remove the old {}", path.display()))?;
        }
    }
    Ok(())
}

/// The picture of the frame that `slam` saw last; boxes from `open_score` on open a track.
pub fn picture(frame: &RgbdFrame, slam: &Slam, open_score: f32) -> RgbImage {
    let mut image = RgbImage::clone(&frame.color);
    for region in slam.moving_regions() {
        tint_region(&mut image, region, &frame.depth);
    }
    for detection in slam.last_boxes() {
        outline(&mut image, &detection.bbox, if detection.score >= open_score { BOX } else { WEAK_BOX });
    }
    for region in slam.moving_regions() {
        outline(&mut image, &region.bbox, DYNAMIC);
    }
    let seen = slam.last_frame();
    for (feature, sight) in seen.features.features.iter().zip(&seen.sights) {
        match sight {
            _ if feature.trust <= 0.0 => disc(&mut image, feature.raw, 2.0, DYNAMIC),
            Some(_) => ring(&mut image, feature.raw, 1.5, 2.5, STATIC),
            None => disc(&mut image, feature.raw, 1.0, UNMATCHED),
        }
    }
    image
}

/// Whether a file name is one that [`Overlay::write`] gives.
fn is_picture(name: &str) -> bool {
    name.strip_suffix(".png").is_some_and(|stem| stem.len() >= 6 && stem.bytes().all(|b| b.is_ascii_digit()))
}

/// Reddens the pixels at the depth of the moving body; all of the box where it moves as a whole.
fn tint_region(image: &mut RgbImage, region: &Region, depth: &DepthImage) {
    let BoundingBox { x_min, y_min, x_max, y_max } = region.bbox;
    // A float cast saturates, and the image bounds what is left.
    for y in y_min as usize..(y_max as usize).min(image.height()) {
        for x in x_min as usize..(x_max as usize).min(image.width()) {
            let moves = match region.depth_m {
                Some([near, far]) => depth.metres(x, y).is_some_and(|z| z >= near && z <= far),
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
    fn only_pictures_of_an_earlier_run_count_as_such() {
        assert!(is_picture("000123.png") && is_picture("1000000.png"));
        for name in ["123.png", "000123.jpg", "00012a.png", "holiday.png", "000123"] {
            assert!(!is_picture(name), "{name}");
        }
    }
}

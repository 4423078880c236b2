//! The dense map of a run as a file, and drawn for the report.

use std::path::Path;

use anyhow::{Context, Result};
use yfslam::RgbImage;
use yfslam::dense::{DenseConfig, DenseMap, cloud};
use yfslam_io::write::encode_jpeg;
use yfslam_io::write_atomically;
use yfslam_report::DenseMapImages;

use crate::draw::dense_image::{SHOWN_M, from_above, from_corner};

/// Name of the file in the output folder.
pub const DENSE_FILE: &str = "dense.map";

/// Quality of the images in the report.
const QUALITY: u8 = 88;
/// Width and height of the images in the report, px.
const IMAGE_PX: [usize; 2] = [480, 360];

/// Writes the dense map, as [`DenseMap::to_bytes`] gives it, into the output folder.
///
/// # Errors
/// The file cannot be written; an earlier file then stays.
pub fn write(folder: &Path, encoded: &[u8]) -> Result<()> {
    Ok(write_atomically(&folder.join(DENSE_FILE), |file| file.write_all(encoded))?)
}

/// Draws the dense map for the report.
///
/// # Errors
/// The map would take more memory than is allowed, or an image is too large for JPEG.
pub fn images(config: &DenseConfig, map: &DenseMap) -> Result<DenseMapImages> {
    let turn = map.frame.unwrap_or_default().r_map_world;
    let volume = map.volume(config, &turn, |_| {})?;
    let points = cloud(map, &volume, |_| {});
    let cut_m = map.floor_m(&turn).unwrap_or_default() as f32 + SHOWN_M;
    let above = from_above(&points, config.resolution_m, cut_m, IMAGE_PX);
    let corner = from_corner(&points, config.resolution_m, cut_m, IMAGE_PX);
    let jpeg = |image: &RgbImage| -> Result<_> {
        let bytes = encode_jpeg(image, QUALITY).context("an image of the dense map is too large for JPEG")?;
        Ok((bytes, [image.width(), image.height()]))
    };
    Ok(DenseMapImages {
        keyframes: map.patches.len(),
        occupied: volume.voxels().filter(|known| known.occupied).count(),
        resolution_m: config.resolution_m,
        views: [jpeg(&above)?, jpeg(&corner)?],
    })
}

//! Orientation by intensity centroid.
//!
//! In: a grey image and a pixel. Out: the angle from the pixel to the centroid of its circular patch (Rublee et al., ICCV 2011,
//! section 3.2).

use super::PATCH_RADIUS;
use crate::image::GrayImage;

/// Angle of the intensity centroid around `(x, y)`, radians in [0, 2π); the patch must lie inside the image.
pub(crate) fn orientation(image: &GrayImage, x: usize, y: usize) -> f32 {
    let radius = PATCH_RADIUS as i32;
    let (mut m10, mut m01) = (0i32, 0i32);
    for v in -radius..=radius {
        let row = image.row(y.wrapping_add_signed(v as isize));
        for u in -radius..=radius {
            if u * u + v * v <= radius * radius {
                let value = i32::from(row[x.wrapping_add_signed(u as isize)]);
                m10 += u * value;
                m01 += v * value;
            }
        }
    }
    let angle = (m01 as f32).atan2(m10 as f32);
    if angle < 0.0 { angle + std::f32::consts::TAU } else { angle }
}

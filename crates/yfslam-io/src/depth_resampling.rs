//! Resampling of depth images to the size and the intrinsics of the colour camera, where both sensors look from the same place.
//!
//! In: the two cameras. Out: for each pixel of the colour image, the pixel of the depth image that measures its depth.

use yfslam::{Camera, Image};

/// Table from the pixels of the colour image to those of the depth image.
#[derive(Clone, Debug)]
pub struct DepthResampling {
    /// Size of the depth images, px.
    pub from: [usize; 2],
    width: usize,
    height: usize,
    /// Index into the depth image for each pixel; `u32::MAX` where the depth camera does not look.
    sources: Vec<u32>,
}

impl DepthResampling {
    /// Computes the table; depth is taken from the nearest pixel, because a mean of two surfaces lies on neither.
    pub fn new(color: &Camera, depth: &Camera) -> Self {
        let source = |index: usize| {
            let [x, y] = color.undistort((index % color.width) as f64, (index / color.width) as f64);
            let [u, v] = depth.distort(x, y);
            let (u, v) = (u.round(), v.round());
            let is_inside = u >= 0.0 && v >= 0.0 && u < depth.width as f64 && v < depth.height as f64;
            let pixel = is_inside.then(|| v as usize * depth.width + u as usize);
            pixel.and_then(|pixel| u32::try_from(pixel).ok()).unwrap_or(u32::MAX)
        };
        let sources = (0..color.width.saturating_mul(color.height)).map(source).collect();
        Self { from: [depth.width, depth.height], width: color.width, height: color.height, sources }
    }

    /// Returns the depth of each pixel of the colour image; 0 where nothing was measured.
    pub fn apply(&self, depth: &Image<u16>) -> Image<u16> {
        let mut out = Image::new(self.width, self.height);
        for (value, &source) in out.data_mut().iter_mut().zip(&self.sources) {
            *value = depth.data().get(source as usize).copied().unwrap_or(0);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pixel_takes_the_depth_that_lies_on_its_ray() {
        // The colour image has twice the resolution and a wider field of view.
        let depth = Camera::pinhole(4, 2, 10.0, 10.0, 1.5, 0.5);
        let color = Camera::pinhole(12, 4, 20.0, 20.0, 5.5, 1.5);
        let resampling = DepthResampling::new(&color, &depth);
        let image = Image::from_vec(4, 2, (1..=8).collect()).unwrap();
        let out = resampling.apply(&image);
        assert_eq!(out.row(0), [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 0, 0]);
        assert_eq!(out.row(3), [0, 0, 5, 5, 6, 6, 7, 7, 8, 8, 0, 0]);
        assert_eq!(out.row(1), out.row(0));
    }
}

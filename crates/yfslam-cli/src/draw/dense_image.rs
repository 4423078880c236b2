//! Images of a dense map: from above, and from a corner above it.
//!
//! In: a coloured point cloud whose z-axis points up. Out: images. Each point is drawn as large as its voxel; points above `cut_m` are
//! left out, so that ceilings do not hide rooms.

use nalgebra::{Point3, Vector3};
use yfslam::dense::CloudPoint;
use yfslam::{Image, RgbImage};

use super::shapes::bar;
use super::text::{label, line_height};

/// Height above the floor above which images leave points out, m.
pub const SHOWN_M: f32 = 1.9;
/// Colour of the background.
const PAPER: [u8; 3] = [250, 250, 250];
/// Margin around the map, m.
const MARGIN_M: f32 = 0.2;
/// Factors of brightness at the bottom and at the top.
const SHADE: [f32; 2] = [0.8, 1.1];

/// An image with the depth of each pixel.
struct Canvas {
    image: RgbImage,
    nearest: Image<f32>,
}

impl Canvas {
    fn new(width: usize, height: usize) -> Self {
        let (mut image, mut nearest) = (RgbImage::new(width, height), Image::new(width, height));
        image.data_mut().fill(PAPER);
        nearest.data_mut().fill(f32::INFINITY);
        Self { image, nearest }
    }

    /// Draws a square of side `size`, px, over pixels that are farther than `depth`.
    fn square(&mut self, [x, y]: [f32; 2], size: f32, depth: f32, color: [u8; 3]) {
        let range = |at: f32, end: usize| {
            let from = (at - size / 2.0).round().max(0.0) as usize;
            from..((at + size / 2.0).round().max(0.0) as usize).max(from + 1).min(end)
        };
        let columns = range(x, self.image.width());
        for row in range(y, self.image.height()) {
            for column in columns.clone() {
                let nearest = &mut self.nearest.row_mut(row)[column];
                if depth < *nearest {
                    *nearest = depth;
                    self.image.row_mut(row)[column] = color;
                }
            }
        }
    }
}

/// Draws the map from above, as large as possible, like the occupancy grid: x to the right, in the direction of the first image, and y up. A bar of
/// 1 m, or of a power of ten that suits, is the scale.
pub fn from_above(points: &[CloudPoint], resolution_m: f32, cut_m: f32, [width, height]: [usize; 2]) -> RgbImage {
    let shown = || points.iter().filter(|p| p.position_m[2] < cut_m);
    let mut canvas = Canvas::new(width, height);
    let Some((low, high)) = bounds(shown()) else { return canvas.image };
    let (wide, deep) = (high.x - low.x + 2.0 * MARGIN_M, high.y - low.y + 2.0 * MARGIN_M);
    let scale = (width as f32 / wide).min(height as f32 / deep);
    let middle = nalgebra::center(&low, &high);
    for p in shown() {
        let [x, y, z] = p.position_m;
        let at = [width as f32 / 2.0 + (x - middle.x) * scale, height as f32 / 2.0 - (y - middle.y) * scale];
        canvas.square(at, 1.3 * resolution_m * scale, -z, shaded(p, low.z, high.z));
    }
    scale_bar(&mut canvas.image, scale);
    canvas.image
}

/// Draws a bar at the bottom left whose length is a power of ten, up to a third of the width.
pub fn scale_bar(image: &mut RgbImage, px_per_m: f32) {
    const INK: [u8; 3] = [40, 40, 40];
    let longest_m = image.width() as f32 / px_per_m / 3.0;
    if !(1e-6..1e9).contains(&longest_m) {
        return;
    }
    let length_m = 10f32.powf(longest_m.log10().floor());
    let (height, length_px) = (image.height() as i64, (length_m * px_per_m).round() as i64);
    let text = if length_m < 1.0 { format!("{length_m} m") } else { format!("{length_m:.0} m") };
    label(image, [8, height - 10 - line_height(image)], &text, INK, PAPER);
    bar(image, [8, height - 9], [8 + length_px - 1, height - 6], INK);
}

/// Draws the map from behind and above the first camera.
pub fn from_corner(points: &[CloudPoint], resolution_m: f32, cut_m: f32, [width, height]: [usize; 2]) -> RgbImage {
    let shown = || points.iter().filter(|p| p.position_m[2] < cut_m);
    let mut canvas = Canvas::new(width, height);
    let Some((low, high)) = bounds(shown()) else { return canvas.image };
    let middle = nalgebra::center(&low, &high);
    let reach = (high - low).norm() * 0.5;
    let eye = middle + Vector3::new(-0.85, -0.45, 0.85).normalize() * 2.3 * reach;
    let forward = (middle - eye).normalize();
    let right = forward.cross(&Vector3::z()).normalize();
    let down = forward.cross(&right);
    let focal = 0.9 * width.min(2 * height) as f32;
    for p in shown() {
        let to = Point3::from(p.position_m) - eye;
        let depth = to.dot(&forward);
        if depth > 0.1 {
            let at = [
                width as f32 / 2.0 + focal * to.dot(&right) / depth,
                height as f32 / 2.0 + focal * to.dot(&down) / depth,
            ];
            canvas.square(at, 1.3 * focal * resolution_m / depth, depth, shaded(p, low.z, high.z));
        }
    }
    canvas.image
}

fn shaded(p: &CloudPoint, low: f32, high: f32) -> [u8; 3] {
    let share = (p.position_m[2] - low) / (high - low).max(1e-3);
    let light = SHADE[0] + (SHADE[1] - SHADE[0]) * share;
    p.color.map(|v| (f32::from(v) * light).min(255.0) as u8)
}

fn bounds<'a>(points: impl Iterator<Item = &'a CloudPoint>) -> Option<(Point3<f32>, Point3<f32>)> {
    points.map(|p| Point3::from(p.position_m)).fold(None, |found, p| {
        let (low, high) = found.unwrap_or((p, p));
        Some((low.inf(&p), high.sup(&p)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(position_m: [f32; 3], color: [u8; 3]) -> CloudPoint {
        CloudPoint { voxel: [0; 3], position_m, color }
    }

    #[test]
    fn from_above_the_higher_of_two_points_is_drawn_and_the_ceiling_is_not() {
        let (red, blue, white) = ([200, 0, 0], [0, 0, 200], [255; 3]);
        let points = [
            point([0.0, 1.0, 0.0], blue),
            point([0.0, 1.0, 1.0], red),
            point([2.0, 0.0, 0.0], blue),
            point([2.0, 0.0, 2.6], white),
        ];
        // 2.4 m across and 1.4 m up at 100 px a metre; x is to the right, y up. The scale is at the bottom left.
        let image = from_above(&points, 0.1, 2.0, [240, 140]);
        let at = |x: f32, y: f32| image.row(((1.2 - y) * 100.0) as usize)[((x + 0.2) * 100.0) as usize];
        assert!(at(0.0, 1.0)[0] > 150 && at(0.0, 1.0)[2] == 0);
        assert!(at(2.0, 0.0)[2] > 150 && at(2.0, 0.0)[0] == 0);
        assert_eq!(at(1.0, 0.5), PAPER);
    }
}

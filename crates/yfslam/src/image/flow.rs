//! Sparse optical flow (Lucas and Kanade 1981; pyramidal form by Bouguet, Intel 2001).
//!
//! In: two consecutive grey images and a position in the first. Out: the corresponding position in the second.

use fearless_simd::Level;

use super::{GrayImage, Plane, Pyramid};

/// Pyramid levels, each half as large as the one before. Source of the constants: DS-SLAM.
const LEVELS: usize = 5;
/// Half the side of the window, px: a side of 21 px is the odd number nearest to DS-SLAM's 22.
const HALF: usize = 10;
const SIDE: usize = 2 * HALF + 1;
/// Side of the window with one more pixel on each side, for the gradients, px.
const OUTER: usize = SIDE + 2;
const ITERATIONS: usize = 20;
/// Length of a step at which the iteration has converged, px.
const EPSILON_PX: f32 = 0.01;
/// Smaller eigenvalue of the structure tensor, per pixel, below which a window has too little texture.
const MIN_EIGENVALUE: f32 = 1e-4 * 255.0 * 255.0 / 16.0;

/// Pyramids of the last two images, for tracking positions from one to the other. Buffers are reused.
#[derive(Clone, Debug)]
pub(crate) struct Flow {
    last: Pyramid,
    current: Pyramid,
}

impl Default for Flow {
    fn default() -> Self {
        let pyramid = Pyramid::new(Level::new(), LEVELS, 2.0);
        Self { last: pyramid.clone(), current: pyramid }
    }
}

impl Flow {
    /// Adds the next image; the current one becomes the last.
    pub(crate) fn push(&mut self, image: &GrayImage) {
        std::mem::swap(&mut self.last, &mut self.current);
        self.current.build(image);
    }

    /// Estimates where a position of the last image, px, lies in the current one; `None` without texture or outside the image.
    pub(crate) fn follow(&self, [x, y]: [f32; 2]) -> Option<[f32; 2]> {
        let pairs = self.last.planes().iter().zip(self.current.planes());
        let (mut dx, mut dy) = (0.0f32, 0.0f32);
        for (level, (last, current)) in pairs.enumerate().rev() {
            let scale = (1u32 << level) as f32;
            let at = |v: f32| (v + 0.5) / scale - 0.5;
            (dx, dy) = (2.0 * dx, 2.0 * dy);
            match refine_on_level(last, current, [at(x), at(y)], [dx, dy]) {
                Some(moved) => [dx, dy] = moved,
                // A coarse level may be too small for the window; only a failure on the finest level counts.
                None if level > 0 => {}
                None => return None,
            }
        }
        Some([x + dx, y + dy])
    }

    /// Returns the sum of absolute differences of the 3 × 3 px around a position of the last image and one of the current image.
    pub(crate) fn difference(&self, from: [f32; 2], to: [f32; 2]) -> Option<f32> {
        let (last, current) = (self.last.planes().first()?, self.current.planes().first()?);
        let (mut a, mut b) = ([0.0; 9], [0.0; 9]);
        (sample::<3>(last, from, &mut a) && sample::<3>(current, to, &mut b))
            .then(|| a.iter().zip(&b).map(|(a, b)| (a - b).abs()).sum())
    }
}

/// Refines the displacement on one level; `None` without texture or outside the image.
fn refine_on_level(last: &Plane, current: &Plane, [x, y]: [f32; 2], [mut dx, mut dy]: [f32; 2]) -> Option<[f32; 2]> {
    let mut outer = [0.0f32; OUTER * OUTER];
    if !sample::<OUTER>(last, [x, y], &mut outer) {
        return None;
    }
    let (mut patch, mut gx, mut gy) = ([0.0f32; SIDE * SIDE], [0.0f32; SIDE * SIDE], [0.0f32; SIDE * SIDE]);
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for r in 0..SIDE {
        for c in 0..SIDE {
            let (i, o) = (r * SIDE + c, (r + 1) * OUTER + c + 1);
            patch[i] = outer[o];
            gx[i] = 0.5 * (outer[o + 1] - outer[o - 1]);
            gy[i] = 0.5 * (outer[o + OUTER] - outer[o - OUTER]);
            xx += gx[i] * gx[i];
            xy += gx[i] * gy[i];
            yy += gy[i] * gy[i];
        }
    }
    let least = 0.5 * (xx + yy - ((xx - yy).powi(2) + 4.0 * xy * xy).sqrt());
    if least < MIN_EIGENVALUE * (SIDE * SIDE) as f32 / 100.0 {
        return None;
    }
    let determinant = xx * yy - xy * xy;
    let mut moved = [0.0f32; SIDE * SIDE];
    for _ in 0..ITERATIONS {
        if !sample::<SIDE>(current, [x + dx, y + dy], &mut moved) {
            return None;
        }
        let (mut bx, mut by) = (0.0, 0.0);
        for i in 0..SIDE * SIDE {
            let error = patch[i] - moved[i];
            bx += gx[i] * error;
            by += gy[i] * error;
        }
        let (sx, sy) = ((yy * bx - xy * by) / determinant, (xx * by - xy * bx) / determinant);
        (dx, dy) = (dx + sx, dy + sy);
        if sx * sx + sy * sy < EPSILON_PX * EPSILON_PX {
            break;
        }
    }
    (dx.is_finite() && dy.is_finite()).then_some([dx, dy])
}

/// Interpolates the `N` × `N` pixels around a position. Returns false if any of them lies outside the image.
fn sample<const N: usize>(plane: &Plane, [x, y]: [f32; 2], out: &mut [f32]) -> bool {
    let (left, top) = (x - (N / 2) as f32, y - (N / 2) as f32);
    let inside = left >= 0.0
        && top >= 0.0
        && left + N as f32 <= plane.width() as f32 - 1.0
        && top + N as f32 <= plane.height() as f32 - 1.0;
    if !inside {
        return false;
    }
    let (column, row) = (left as usize, top as usize);
    let (fx, fy) = (left - column as f32, top - row as f32);
    let weights = [(1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy];
    for (r, line) in out.chunks_exact_mut(N).take(N).enumerate() {
        let (upper, lower) = (&plane.row(row + r)[column..=column + N], &plane.row(row + r + 1)[column..=column + N]);
        for (c, value) in line.iter_mut().enumerate() {
            *value = weights[0] * f32::from(upper[c])
                + weights[1] * f32::from(upper[c + 1])
                + weights[2] * f32::from(lower[c])
                + weights[3] * f32::from(lower[c + 1]);
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Returns an image of a smooth pattern shifted by (dx, dy) px.
    fn shifted_image(dx: f32, dy: f32) -> GrayImage {
        let value = |i: usize| {
            let (x, y) = ((i % 320) as f32 - dx, (i / 320) as f32 - dy);
            let waves = (x * 0.11).sin() + (y * 0.13).sin() + (x * 0.05 + y * 0.07).cos() + (x * 0.02 - y * 0.03).sin();
            (127.0 + 30.0 * waves) as u8
        };
        GrayImage::from_vec(320, 240, (0..320 * 240).map(value).collect()).unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn a_shifted_image_is_tracked(dx in -9f32..9.0, dy in -9f32..9.0, x in 60f32..260.0, y in 60f32..180.0) {
            let mut flow = Flow::default();
            flow.push(&shifted_image(0.0, 0.0));
            flow.push(&shifted_image(dx, dy));
            let [u, v] = flow.follow([x, y]).unwrap();
            prop_assert!((u - x - dx).abs() < 0.15 && (v - y - dy).abs() < 0.15, "{u} {v} for {dx} {dy}");
            prop_assert!(flow.difference([x, y], [u, v]).unwrap() < 30.0);
        }
    }

    #[test]
    fn positions_without_texture_or_at_the_border_are_not_tracked() {
        let mut flow = Flow::default();
        let blank = GrayImage::new(320, 240);
        flow.push(&blank);
        flow.push(&blank);
        assert_eq!(flow.follow([160.0, 120.0]), None);
        flow.push(&shifted_image(0.0, 0.0));
        flow.push(&shifted_image(0.0, 0.0));
        assert_eq!(flow.follow([2.0, 120.0]), None);
    }
}

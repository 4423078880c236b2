//! Images as worn, dirty or badly set cameras deliver them.
//!
//! In: a frame. Out: the frame with other images of the same instant; the same frame always gives the same images.

use std::sync::Arc;

use yfslam::{DepthImage, Frame, Image, RgbImage};

use super::mixed;

/// Radius of the motion blur, px.
const BLUR_PX: usize = 12;
/// Side of the fields that dirt covers or leaves free, as a share of the width.
const DIRT_SHARE: usize = 20;
/// Side of the fields of the infrared pattern, each of which has one dot, px.
const DOT_FIELD_PX: usize = 10;

/// Replaces the image, or both images of a stereo pair.
fn change_images(frame: &mut Frame, changed: impl Fn(&RgbImage) -> RgbImage) {
    frame.color = Arc::new(changed(&frame.color));
    frame.right = frame.right.as_deref().map(|right| Arc::new(changed(right)));
}

/// Replaces each colour by `change` of its column, row and value, in both images of a stereo pair.
fn change_color(frame: &mut Frame, change: impl Fn(usize, usize, [u8; 3]) -> [u8; 3]) {
    change_images(frame, |image| {
        let mut image = image.clone();
        for y in 0..image.height() {
            image.row_mut(y).iter_mut().enumerate().for_each(|(x, rgb)| *rgb = change(x, y, *rgb));
        }
        image
    });
}

/// Replaces each reading of the depth image by `change` of its column, row and value.
fn change_depth(frame: &mut Frame, change: impl Fn(usize, usize, u16) -> u16) {
    if let Some(depth) = &mut frame.depth {
        let raw = &mut Arc::make_mut(depth).raw;
        for y in 0..raw.height() {
            raw.row_mut(y).iter_mut().enumerate().for_each(|(x, value)| *value = change(x, y, *value));
        }
    }
}

fn scaled(rgb: [u8; 3], factor: f64) -> [u8; 3] {
    rgb.map(|channel| (f64::from(channel) * factor) as u8)
}

/// Makes the images four times as bright, so that most of them is white.
pub(super) fn over_expose(frame: &mut Frame) {
    change_color(frame, |_, _, rgb| scaled(rgb, 4.0));
}

/// Blurs the images along their rows.
pub(super) fn blur(frame: &mut Frame) {
    change_images(frame, |image| {
        let mut out = image.clone();
        for y in 0..image.height() {
            let row = image.row(y);
            for (x, rgb) in out.row_mut(y).iter_mut().enumerate() {
                let window = row.get(x.saturating_sub(BLUR_PX)..(x + BLUR_PX + 1).min(row.len())).unwrap_or_default();
                let mean = |c: usize| window.iter().map(|p| usize::from(p[c])).sum::<usize>() / window.len().max(1);
                *rgb = [0, 1, 2].map(|c| mean(c) as u8);
            }
        }
        out
    });
}

/// Changes the brightness from frame to frame, between a third and five thirds.
pub(super) fn flicker(frame: &mut Frame) {
    let factor = 1.0 / 3.0 + 4.0 / 3.0 * (mixed(frame.timestamp_ns as u64) >> 11) as f64 / (1u64 << 53) as f64;
    change_color(frame, |_, _, rgb| scaled(rgb, factor));
}

/// Covers a quarter of the fields of the images by grey spots that stay where they are.
pub(super) fn cover_with_dirt(frame: &mut Frame) {
    let side = (frame.color.width() / DIRT_SHARE).max(1);
    change_color(frame, |x, y, rgb| {
        let bits = mixed((x / side) as u64 | ((y / side) as u64) << 32);
        // Spots have an edge, which gives features that stand still.
        if bits.is_multiple_of(4) { [60 + (bits >> 8) as u8 % 60; 3] } else { rgb }
    });
}

/// Adds the dots of an infrared projector, which stay where they are in the image.
pub(super) fn add_dots(frame: &mut Frame) {
    change_color(frame, |x, y, rgb| {
        let bits = mixed((x / DOT_FIELD_PX) as u64 | ((y / DOT_FIELD_PX) as u64) << 32 | 1 << 63);
        let [dot_x, dot_y] = [8, 24].map(|shift| (bits >> shift) as usize % (DOT_FIELD_PX - 2));
        let is_dot = (x % DOT_FIELD_PX).wrapping_sub(dot_x) < 2 && (y % DOT_FIELD_PX).wrapping_sub(dot_y) < 2;
        if is_dot { [255; 3] } else { rgb }
    });
}

/// Halves the sides of the images.
pub(super) fn halve(frame: &mut Frame) {
    fn half<T: Copy + Default>(image: &Image<T>) -> Image<T> {
        let mut half = Image::new((image.width() / 2).max(1), (image.height() / 2).max(1));
        for y in 0..half.height().min(image.height() / 2) {
            half.row_mut(y).iter_mut().zip(image.row(2 * y).iter().step_by(2)).for_each(|(to, from)| *to = *from);
        }
        half
    }
    frame.color = Arc::new(half(&frame.color));
    frame.right = frame.right.as_deref().map(|right| Arc::new(half(right)));
    frame.depth = frame.depth.as_deref().map(|depth| Arc::new(DepthImage { raw: half(&depth.raw), ..*depth }));
    frame.mask = frame.mask.as_deref().map(|mask| Arc::new(half(mask)));
}

/// Adds noise of up to a fifth to each reading of the depth.
pub(super) fn add_depth_noise(frame: &mut Frame) {
    let seed = mixed(frame.timestamp_ns as u64);
    change_depth(frame, |x, y, value| {
        let share = (mixed(seed ^ (x as u64 | (y as u64) << 32)) >> 11) as f64 / (1u64 << 53) as f64;
        (f64::from(value) * (0.8 + 0.4 * share)) as u16
    });
}

/// Multiplies depth by 1.5, as with the wrong depth units.
pub(super) fn scale_depth(frame: &mut Frame) {
    change_depth(frame, |_, _, value| (f64::from(value) * 1.5) as u16);
}

/// Sets the upper half of the depth image to the largest reading.
pub(super) fn saturate_depth(frame: &mut Frame) {
    let rows = frame.depth.as_ref().map_or(0, |depth| depth.raw.height() / 2);
    change_depth(frame, |_, y, value| if y < rows { u16::MAX } else { value });
}

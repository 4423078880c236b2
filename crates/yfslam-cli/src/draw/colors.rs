//! The colours of marks on images, and of classes.

use super::shapes::Color;

/// A feature that was matched with a landmark.
pub const STATIC: Color = [60, 255, 60];
/// A static feature without a landmark.
pub const UNMATCHED: Color = [0, 130, 0];
/// A dynamic feature, or what moves.
pub const DYNAMIC: Color = [255, 30, 30];
/// The bounding box of a detection.
pub const BOX: Color = [255, 220, 0];
/// A box whose score keeps a track but does not open one.
pub const WEAK_BOX: Color = [140, 120, 0];

/// Colour of free space in octrees.
pub const FREE: [u8; 3] = [255; 3];
/// Colour of voxels without a class.
const UNKNOWN: [u8; 3] = [150; 3];
/// Difference of hue from one class to the next, in parts of the circle: the golden angle keeps a few classes well apart.
const HUE_STEP: f32 = 0.381_966;

/// Returns the colour of a class; grey for 0.
pub fn class_color(class: u8) -> [u8; 3] {
    if class == 0 {
        return UNKNOWN;
    }
    let hue = (f32::from(class) * HUE_STEP).fract() * 6.0;
    // Similar hues differ in brightness.
    let value = [255.0, 215.0, 165.0][usize::from(class) % 3];
    let channel = |at: f32| {
        let ramp = ((hue - at).rem_euclid(6.0) - 3.0).abs() - 1.0;
        (value * (0.2 + 0.8 * ramp.clamp(0.0, 1.0))) as u8
    };
    [channel(0.0), channel(2.0), channel(4.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_classes_of_coco_have_similar_colours() {
        let colors: Vec<[u8; 3]> = (0..=80).map(class_color).collect();
        for (i, a) in colors.iter().enumerate() {
            for b in &colors[..i] {
                let difference: u32 = a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(*b))).sum();
                assert!(difference >= 8, "{i}: {a:?} and {b:?}");
            }
        }
    }
}

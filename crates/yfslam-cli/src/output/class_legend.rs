//! What classes of voxels are called and how they are coloured.
//!
//! In: the classes of a map. Out: a colour for each, the same in every map, and the list of those that occur.

use std::fmt;

use serde::Serialize;
use yfslam::dense::Volume;
use yfslam::dense::classes::Classes;

/// Colour of free space in octrees.
pub const FREE: [u8; 3] = [255; 3];
/// Colour of what has no class.
const UNKNOWN: [u8; 3] = [150; 3];
/// From one class to the next, in parts of the circle of hues: the golden angle keeps any few of them apart.
const HUE_STEP: f32 = 0.381_966;

/// The classes that occur, and how often.
#[derive(Clone, Debug, Serialize)]
pub struct ClassLegend {
    /// Occupied voxels without a class.
    unknown: usize,
    /// The others, most voxels first.
    classes: Vec<Entry>,
}

#[derive(Clone, Debug, Serialize)]
struct Entry {
    class: u8,
    name: String,
    color: [u8; 3],
    /// Occupied voxels.
    voxels: usize,
}

/// The colour of a class; grey for 0.
pub fn color_of(class: u8) -> [u8; 3] {
    if class == 0 {
        return UNKNOWN;
    }
    let hue = (f32::from(class) * HUE_STEP).fract() * 6.0;
    // Every third class is darker, so that near hues differ in light.
    let value = [255.0, 215.0, 165.0][usize::from(class) % 3];
    let channel = |at: f32| {
        let ramp = ((hue - at).rem_euclid(6.0) - 3.0).abs() - 1.0;
        (value * (0.2 + 0.8 * ramp.clamp(0.0, 1.0))) as u8
    };
    [channel(0.0), channel(2.0), channel(4.0)]
}

impl ClassLegend {
    /// Counts the occupied voxels of each class; `names` from class 1 on.
    pub fn of(names: &[String], volume: &Volume, classes: &Classes) -> Self {
        let mut counts = [0; 256];
        let occupied = volume.voxels().filter(|known| known.occupied);
        occupied.for_each(|known| counts[usize::from(classes.get(known.voxel))] += 1);
        let named = (1..=u8::MAX).zip(names).filter(|(class, _)| counts[usize::from(*class)] > 0);
        let entry = |(class, name): (u8, &String)| Entry {
            class,
            name: name.clone(),
            color: color_of(class),
            voxels: counts[usize::from(class)],
        };
        let mut found: Vec<Entry> = named.map(entry).collect();
        found.sort_by_key(|entry| (std::cmp::Reverse(entry.voxels), entry.class));
        Self { unknown: counts[0], classes: found }
    }
}

impl fmt::Display for ClassLegend {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let named = |entry: &Entry| format!("{} {}", entry.name, entry.voxels);
        let known: Vec<String> = self.classes.iter().map(named).collect();
        let known = if known.is_empty() { "none found".to_owned() } else { known.join(", ") };
        writeln!(f, "classes, in voxels: {known}; {} unknown", self.unknown)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_classes_of_coco_look_alike() {
        let colors: Vec<[u8; 3]> = (0..=80).map(color_of).collect();
        for (i, a) in colors.iter().enumerate() {
            for b in &colors[..i] {
                let apart: u32 = a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(*b))).sum();
                assert!(apart >= 8, "{i}: {a:?} and {b:?}");
            }
        }
    }
}

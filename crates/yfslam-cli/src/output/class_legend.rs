//! Names, colours and voxel counts of the classes in a dense map.

use std::fmt;

use serde::Serialize;
use yfslam::dense::Classes;
use yfslam::dense::Volume;

use crate::draw::colors::class_color;

/// The classes that occur in a map.
#[derive(Clone, Debug, Serialize)]
pub struct ClassLegend {
    /// Occupied voxels without a class.
    unknown: usize,
    /// The other classes, those with most voxels first.
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

impl ClassLegend {
    /// Counts the occupied voxels of each class; `names` start with class 1.
    pub fn of(names: &[String], volume: &Volume, classes: &Classes) -> Self {
        let mut counts = [0; 256];
        let occupied = volume.voxels().filter(|known| known.occupied);
        occupied.for_each(|known| counts[usize::from(classes.get(known.voxel))] += 1);
        let named = (1..=u8::MAX).zip(names).filter(|(class, _)| counts[usize::from(*class)] > 0);
        let entry = |(class, name): (u8, &String)| Entry {
            class,
            name: name.clone(),
            color: class_color(class),
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
        let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
        writeln!(f, "classes, in voxels: {known}; {} unknown", self.unknown)
    }
}

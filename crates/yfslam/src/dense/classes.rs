//! What occupied space is: a class for each voxel, of the static_objects that a detector found (DS-SLAM, IROS 2018, section III-E, maps them so).
//!
//! In: a dense_map whose patches have classes, and its volume. Out: the class of each voxel. Each patch has one voice in a voxel: the class of
//! most of its readings there. A voxel keeps one class, with log-odds that rise by OctoMap's step of a hit when a patch has that class and
//! fall by that of a miss when it has another or none, clamped above; where they fall below even odds the next class takes its place. So
//! a detector that misses a thing in half of the views still names it, and a box that was wrong is forgotten.

use std::collections::BTreeMap;

use nalgebra::Isometry3;

use crate::dense::voxels::{Block, VOXELS, Voxel, block_of, place_of, voxel_at};
use crate::dense::{DenseConfig, DenseMap, PlacedPatch, Volume};

/// Classes of voxels.
#[derive(Clone, Debug, Default)]
pub struct Classes {
    blocks: BTreeMap<Block, Vec<Held>>,
}

/// The class that a voxel has, and its log-odds, above 0; or no class.
#[derive(Clone, Copy, Debug, Default)]
struct Held {
    class: u8,
    log_odds: f32,
}

/// The classes of a dense_map. `progress` hears how many patches are done.
pub fn classes(dense_map: &DenseMap, volume: &Volume, mut progress: impl FnMut(usize)) -> Classes {
    let mut classes = Classes::default();
    let mut seen = Vec::new();
    for (number, one) in dense_map.patches.iter().enumerate() {
        progress(number);
        let Some(pose) = volume.pose(number).filter(|_| !one.patch.class.is_empty()) else { continue };
        readings(dense_map, one, &pose.cast(), volume.config(), &mut seen);
        seen.sort_unstable();
        for in_voxel in seen.chunk_by(|a, b| a.0 == b.0) {
            let most = in_voxel.chunk_by(|a, b| a.1 == b.1).max_by_key(|alike| alike.len());
            if let Some(&[(voxel, class), ..]) = most {
                classes.hear(volume.config(), voxel, class);
            }
        }
    }
    classes
}

/// The voxel and the class of each reading that ends on a surface.
fn readings(
    dense_map: &DenseMap,
    one: &PlacedPatch,
    pose: &Isometry3<f32>,
    config: &DenseConfig,
    seen: &mut Vec<(Voxel, u8)>,
) {
    seen.clear();
    let per_m = 1.0 / config.resolution_m;
    for (cell, [x, y]) in dense_map.grid.rays().iter().enumerate() {
        let surface_m = one.patch.surface_m(cell).filter(|z| *z <= config.max_range_m);
        if let (Some(z), Some(class)) = (surface_m, one.patch.class(cell)) {
            seen.push((voxel_at(&(pose * nalgebra::Point3::new(x * z, y * z, z)), per_m), class));
        }
    }
}

impl Classes {
    /// The class of a voxel, whether it is occupied or not; 0 if it is unknown.
    pub fn get(&self, voxel: Voxel) -> u8 {
        self.blocks.get(&block_of(voxel)).map_or(0, |held| held[place_of(voxel)].class)
    }

    /// A patch says that a voxel has a class, or, with 0, none.
    fn hear(&mut self, config: &DenseConfig, voxel: Voxel, class: u8) {
        // What has no class where there is none tells nothing.
        let block = block_of(voxel);
        if class == 0 && !self.blocks.contains_key(&block) {
            return;
        }
        let log_odds = |p: f32| (p / (1.0 - p)).ln();
        let held = &mut self.blocks.entry(block).or_insert_with(|| vec![Held::default(); VOXELS])[place_of(voxel)];
        if held.class == 0 {
            *held = Held { class, log_odds: if class > 0 { log_odds(config.p_hit) } else { 0.0 } };
        } else if held.class == class {
            held.log_odds = (held.log_odds + log_odds(config.p_hit)).min(log_odds(config.clamp_max));
        } else {
            held.log_odds += log_odds(config.p_miss);
            if held.log_odds <= 0.0 {
                *held = Held::default();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, UnitQuaternion};

    use super::*;
    use crate::dense::{CellGrid, KeyframePatch, scene};
    use crate::geometry::Pose;

    /// A thing at 1.52 m that patches take for these classes, before a wall; `None` where nobody looked.
    fn held(progress: &[Option<u8>]) -> (u8, u8) {
        let config = DenseConfig::default();
        let grid = CellGrid::new(&scene::camera(), config.stride_px);
        let patch = |class: Option<u8>| -> KeyframePatch {
            let patch = scene::wall(&grid, 3.01, Some(1.52));
            let Some(class) = class else { return patch };
            let depths = patch.clone();
            let mut of_cells = (0..).map(|cell| if depths.surface_m(cell) < Some(2.0) { class } else { 0 });
            let cells: Vec<u8> = of_cells.by_ref().take(grid.rays().len()).collect();
            KeyframePatch { class: cells, ..patch }
        };
        let dense_map =
            DenseMap::of_poses(grid.clone(), progress.iter().map(|class| (Pose::identity(), patch(*class))));
        let volume = dense_map.volume(&config, &UnitQuaternion::identity(), |_| {}).unwrap();
        let classes = classes(&dense_map, &volume, |_| {});
        let at = |z: f32| classes.get(voxel_at(&Point3::new(0.01, 0.01, z), 20.0));
        (at(1.52), at(3.01))
    }

    #[test]
    fn a_thing_keeps_the_class_that_prevails_and_the_wall_behind_it_has_none() {
        assert_eq!(held(&[Some(3)]), (3, 0));
        assert_eq!(held(&[Some(3), None, None, None]), (3, 0), "who did not look says nothing");
        assert_eq!(held(&[Some(3), Some(0), Some(3), Some(0), Some(3), Some(0)]), (3, 0), "seen in half of the views");
        assert_eq!(held(&[Some(3), Some(0), Some(0), Some(0)]), (0, 0), "a box that was wrong once");
        assert_eq!(held(&[Some(3), Some(5), Some(5), Some(5), Some(5), Some(5)]), (5, 0));
        assert_eq!(held(&[Some(5); 3]), (5, 0));
        assert_eq!(held(&[None; 3]), (0, 0));
    }
}

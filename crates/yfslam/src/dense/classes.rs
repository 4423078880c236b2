//! Classes of voxels: semantic labels from the static objects that a detector found (after DS-SLAM, IROS 2018, section III-E).
//!
//! In: a dense map whose patches have classes, and its volume. Out: the class of each voxel. In each voxel a patch counts once,
//! with the class of most of its readings there. A voxel has one class with log-odds, which rise by OctoMap's step of a hit when a
//! patch has that class and fall by that of a miss when it has another class or none, clamped above; if they fall to even odds, the
//! next class replaces it. So an object that the detector misses in half of the patches keeps its class, and a single false
//! detection is removed.

use std::collections::BTreeMap;

use nalgebra::Isometry3;

use crate::dense::voxels::{Block, VOXELS, Voxel, block_of, index_in_block, voxel_at};
use crate::dense::{DenseConfig, DenseMap, PlacedPatch, Volume};

/// The classes of voxels.
#[derive(Clone, Debug, Default)]
pub struct Classes {
    blocks: BTreeMap<Block, Vec<VoxelClass>>,
}

/// The class of a voxel and its log-odds, above 0; class 0 is none.
#[derive(Clone, Copy, Debug, Default)]
struct VoxelClass {
    class: u8,
    log_odds: f32,
}

/// Returns the classes of a dense map. `progress` receives the number of finished patches.
pub fn classes(dense_map: &DenseMap, volume: &Volume, mut progress: impl FnMut(usize)) -> Classes {
    let mut classes = Classes::default();
    let mut found = Vec::new();
    for (number, placed) in dense_map.patches.iter().enumerate() {
        progress(number);
        let Some(pose) = volume.pose(number).filter(|_| !placed.patch.class.is_empty()) else { continue };
        readings(dense_map, placed, &pose.cast(), volume.config(), &mut found);
        found.sort_unstable();
        for in_voxel in found.chunk_by(|a, b| a.0 == b.0) {
            let majority = in_voxel.chunk_by(|a, b| a.1 == b.1).max_by_key(|equal| equal.len());
            if let Some(&[(voxel, class), ..]) = majority {
                classes.update(volume.config(), voxel, class);
            }
        }
    }
    classes
}

/// Collects in `found` the voxel and the class of each reading of a static surface.
fn readings(
    dense_map: &DenseMap,
    placed: &PlacedPatch,
    pose: &Isometry3<f32>,
    config: &DenseConfig,
    found: &mut Vec<(Voxel, u8)>,
) {
    found.clear();
    let per_m = 1.0 / config.resolution_m;
    for (cell, [x, y]) in dense_map.grid.rays().iter().enumerate() {
        let surface_m = placed.patch.surface_m(cell).filter(|z| *z <= config.max_range_m);
        if let (Some(z), Some(class)) = (surface_m, placed.patch.class(cell)) {
            found.push((voxel_at(&(pose * nalgebra::Point3::new(x * z, y * z, z)), per_m), class));
        }
    }
}

impl Classes {
    /// Returns the class of a voxel, occupied or not; 0 if it is unknown.
    pub fn get(&self, voxel: Voxel) -> u8 {
        self.blocks.get(&block_of(voxel)).map_or(0, |current| current[index_in_block(voxel)].class)
    }

    /// Updates a voxel with the class that a patch has there; 0 is no class.
    fn update(&mut self, config: &DenseConfig, voxel: Voxel, class: u8) {
        // An observation without class does not change a voxel without class.
        let block = block_of(voxel);
        if class == 0 && !self.blocks.contains_key(&block) {
            return;
        }
        let log_odds = |p: f32| libm::logf(p / (1.0 - p));
        let current =
            &mut self.blocks.entry(block).or_insert_with(|| vec![VoxelClass::default(); VOXELS])[index_in_block(voxel)];
        if current.class == 0 {
            *current = VoxelClass { class, log_odds: if class > 0 { log_odds(config.p_hit) } else { 0.0 } };
        } else if current.class == class {
            current.log_odds = (current.log_odds + log_odds(config.p_hit)).min(log_odds(config.clamp_max));
        } else {
            current.log_odds += log_odds(config.p_miss);
            if current.log_odds <= 0.0 {
                *current = VoxelClass::default();
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

    /// Returns the classes of an object at 1.52 m, which patches observe with these classes, and of a wall behind it; `None` for a
    /// patch without classes.
    fn classes_after(observed: &[Option<u8>]) -> (u8, u8) {
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
            DenseMap::of_poses(grid.clone(), observed.iter().map(|class| (Pose::identity(), patch(*class))));
        let volume = dense_map.volume(&config, &UnitQuaternion::identity(), |_| {}).unwrap();
        let classes = classes(&dense_map, &volume, |_| {});
        let at = |z: f32| classes.get(voxel_at(&Point3::new(0.01, 0.01, z), 20.0));
        (at(1.52), at(3.01))
    }

    #[test]
    fn an_object_has_the_class_of_most_patches_and_the_wall_behind_it_has_none() {
        assert_eq!(classes_after(&[Some(3)]), (3, 0));
        assert_eq!(classes_after(&[Some(3), None, None, None]), (3, 0), "a patch without classes changes nothing");
        assert_eq!(
            classes_after(&[Some(3), Some(0), Some(3), Some(0), Some(3), Some(0)]),
            (3, 0),
            "detected in half of the patches"
        );
        assert_eq!(classes_after(&[Some(3), Some(0), Some(0), Some(0)]), (0, 0), "one false detection");
        assert_eq!(classes_after(&[Some(3), Some(5), Some(5), Some(5), Some(5), Some(5)]), (5, 0));
        assert_eq!(classes_after(&[Some(5); 3]), (5, 0));
        assert_eq!(classes_after(&[None; 3]), (0, 0));
    }
}

//! The volume: occupancy of voxels as log-odds, as a function of the patches and their present poses only.
//!
//! In: patches and their poses, also after each correction of the map. Out: for each voxel whether it is occupied, free or unknown.
//! Each block keeps the observations of each patch and adds them up in temporal order, clamped at every step (OctoMap, section 4).
//! A patch whose pose changes is removed and integrated again, only the blocks concerned are added up again, and the result has the
//! same bits as a volume built from scratch. The clamps give late observations more weight: an object that has left becomes free
//! after a few of them.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Translation3};

use crate::dense::block_state::{BlockState, PER_UNIT, Steps};
use crate::dense::keyframe_patch::{CellGrid, KeyframePatch};
use crate::dense::trace::{BlockObservation, trace};
use crate::dense::voxels::{Bits, Block, SIDE, VOXELS, Voxel, block_of, index_in_block, voxel_in};
use crate::dense::{DenseConfig, DenseMap};

/// Occupied, free and unknown space, in voxels.
#[derive(Clone, Debug)]
pub struct Volume {
    config: DenseConfig,
    steps: Steps,
    blocks: BTreeMap<Block, BlockState>,
    /// Pose and blocks of each patch, by number; `None` for those that are not in the volume.
    patches: Vec<Option<IntegratedPatch>>,
}

/// A patch that is part of the volume.
#[derive(Clone, Debug)]
struct IntegratedPatch {
    t_map_cam: Isometry3<f64>,
    blocks: Vec<Block>,
}

/// A voxel that is known to be occupied or free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownVoxel {
    /// The voxel.
    pub voxel: Voxel,
    /// Log-odds that it is occupied.
    pub log_odds: f32,
    /// Whether it counts as occupied.
    pub occupied: bool,
}

impl Volume {
    /// Returns an empty volume.
    pub(crate) fn new(config: &DenseConfig) -> Self {
        Self { config: config.clone(), steps: Steps::new(config), blocks: BTreeMap::new(), patches: Vec::new() }
    }

    /// Returns the configuration with which it was made.
    pub fn config(&self) -> &DenseConfig {
        &self.config
    }

    /// Integrates patch `number` at a pose, or moves it if its surfaces may be off by more than `refit_threshold_voxels`; `None` removes it.
    /// Returns whether anything changed.
    pub(crate) fn integrate(
        &mut self,
        number: usize,
        grid: &CellGrid,
        patch: &KeyframePatch,
        t_map_cam: Option<&Isometry3<f64>>,
    ) -> bool {
        let integrated = self.patches.get(number).and_then(Option::as_ref);
        match (integrated, t_map_cam) {
            (None, None) => return false,
            (Some(integrated), Some(pose)) if !self.has_moved(&integrated.t_map_cam, pose) => return false,
            _ => {}
        }
        self.remove(number);
        if let Some(pose) = t_map_cam {
            self.add(number, pose, trace(&self.config, grid, patch, pose));
        }
        true
    }

    /// Returns whether a point within range may have moved by more than `refit_threshold_voxels`.
    fn has_moved(&self, before: &Isometry3<f64>, now: &Isometry3<f64>) -> bool {
        let moved = before.inverse() * now;
        let turned = moved.rotation.angle() * f64::from(self.config.max_range_m);
        let Translation3 { vector, .. } = moved.translation;
        vector.norm() + turned > f64::from(self.config.refit_threshold_voxels * self.config.resolution_m)
    }

    /// Adds the observations of a patch to its blocks.
    fn add(&mut self, number: usize, t_map_cam: &Isometry3<f64>, observations: Vec<BlockObservation>) {
        if self.patches.len() <= number {
            self.patches.resize_with(number + 1, || None);
        }
        let mut blocks = Vec::with_capacity(observations.len());
        for BlockObservation { block, hit, free } in observations {
            let state = self.blocks.entry(block).or_default();
            let at = state.observations.partition_point(|(earlier, ..)| (*earlier as usize) < number);
            state.observations.insert(at, (number as u32, hit, free));
            if at < state.summed {
                state.summed = 0;
            }
            blocks.push(block);
        }
        self.patches[number] = Some(IntegratedPatch { t_map_cam: *t_map_cam, blocks });
    }

    /// Removes the observations of a patch.
    fn remove(&mut self, number: usize) {
        let Some(integrated) = self.patches.get_mut(number).and_then(Option::take) else { return };
        for block in integrated.blocks {
            let Some(state) = self.blocks.get_mut(&block) else { continue };
            let at = state.observations.partition_point(|(earlier, ..)| (*earlier as usize) < number);
            if state.observations.get(at).is_some_and(|(found, ..)| *found as usize == number) {
                state.observations.remove(at);
            }
            if at < state.summed {
                state.summed = 0;
            }
            if state.observations.is_empty() {
                self.blocks.remove(&block);
            }
        }
    }

    /// Adds up the new observations. All other methods return the state of the last update.
    pub(crate) fn update(&mut self) {
        for state in self.blocks.values_mut() {
            state.sum_up(&self.steps);
        }
    }

    /// Returns the state of a voxel; `None` if it is unknown.
    pub fn get(&self, voxel: Voxel) -> Option<KnownVoxel> {
        let state = self.blocks.get(&block_of(voxel))?;
        let index = index_in_block(voxel);
        state.known.contains(index).then(|| self.known(voxel, state.log_odds[index]))
    }

    fn known(&self, voxel: Voxel, log_odds: i16) -> KnownVoxel {
        KnownVoxel { voxel, log_odds: f32::from(log_odds) / PER_UNIT, occupied: log_odds > self.steps.occupied }
    }

    /// Returns whether a voxel is occupied.
    pub(crate) fn is_occupied(&self, voxel: Voxel) -> bool {
        self.get(voxel).is_some_and(|known| known.occupied)
    }

    /// Returns all known voxels, ordered by block, then by index in the block.
    pub fn voxels(&self) -> impl Iterator<Item = KnownVoxel> {
        self.blocks.iter().flat_map(move |(&block, state)| self.known_voxels(block, state))
    }

    /// Returns the known voxels of a block.
    pub fn voxels_in(&self, block: Block) -> impl Iterator<Item = KnownVoxel> {
        self.blocks.get(&block).into_iter().flat_map(move |state| self.known_voxels(block, state))
    }

    fn known_voxels(&self, block: Block, state: &BlockState) -> impl Iterator<Item = KnownVoxel> {
        (0..VOXELS)
            .filter(|&index| state.known.contains(index))
            .map(move |index| self.known(voxel_in(block, index), state.log_odds[index]))
    }

    /// Returns the blocks with known voxels, in order.
    pub fn blocks(&self) -> impl Iterator<Item = Block> {
        self.blocks.keys().copied()
    }

    /// Returns the numbers of the patches that observe a block, ascending.
    pub(crate) fn patches_observing(&self, block: Block) -> impl Iterator<Item = usize> {
        self.blocks
            .get(&block)
            .into_iter()
            .flat_map(|state| state.observations.iter().map(|(number, ..)| *number as usize))
    }

    /// Returns the pose of a patch in the volume, camera to volume.
    pub fn pose(&self, number: usize) -> Option<&Isometry3<f64>> {
        Some(&self.patches.get(number)?.as_ref()?.t_map_cam)
    }

    /// Returns an upper limit of the memory that the volume of a dense map takes, bytes: from its bounding box, and from the range
    /// of each patch.
    pub fn bytes_at_most(config: &DenseConfig, dense_map: &DenseMap) -> usize {
        let side_m = f64::from(config.resolution_m) * f64::from(SIDE);
        let range_m = f64::from(config.max_range_m);
        let blocks = |extent_m: [f64; 3]| extent_m.iter().map(|m| (m / side_m).ceil() + 1.0).product::<f64>();
        let centers = dense_map.patches.iter().map(|patch| patch.t_world_cam.translation.vector);
        let (low, high) = centers.clone().fold(([f64::MAX; 3], [f64::MIN; 3]), |(low, high), c| {
            ([0, 1, 2].map(|i| low[i].min(c[i])), [0, 1, 2].map(|i| high[i].max(c[i])))
        });
        let extent = [0, 1, 2].map(|i| (high[i] - low[i]).max(0.0) + 2.0 * range_m);
        // The pyramid over the image has a third of the volume of its box.
        let camera = dense_map.grid.camera();
        let [width, height] = [camera.width as f64 / camera.fx, camera.height as f64 / camera.fy].map(|w| w * range_m);
        let each = blocks([range_m, width, height]).min(blocks(extent)) / 2.0;
        let state = size_of::<BlockState>() + size_of::<Block>() + 2 * VOXELS;
        let observation = size_of::<(u32, Bits, Bits)>() + size_of::<Block>();
        (blocks(extent).min(each * dense_map.patches.len() as f64) * state as f64
            + each * (dense_map.patches.len() * observation) as f64) as usize
    }

    /// Returns the memory that the volume takes without the patches, bytes.
    pub fn bytes(&self) -> usize {
        let observation = size_of::<(u32, Bits, Bits)>();
        let states: usize = self.blocks.values().map(|s| s.observations.capacity() * observation + 2 * VOXELS).sum();
        let patches: usize = self.patches.iter().flatten().map(|p| p.blocks.capacity() * size_of::<Block>()).sum();
        states + patches + self.blocks.len() * (size_of::<BlockState>() + size_of::<Block>())
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::*;
    use crate::dense::scene;
    use crate::dense::voxels::voxel_at;

    struct Fixture {
        config: DenseConfig,
        grid: CellGrid,
    }

    impl Fixture {
        fn new() -> Self {
            let config = DenseConfig::default();
            let grid = CellGrid::new(&scene::camera(), config.stride_px);
            Self { config, grid }
        }

        fn with_object(&self, depth_m: f32, present: usize, gone: usize) -> Volume {
            let mut volume = Volume::new(&self.config);
            let (with, without) = (scene::wall(&self.grid, 3.01, Some(depth_m)), scene::wall(&self.grid, 3.01, None));
            for number in 0..present + gone {
                let patch = if number < present { &with } else { &without };
                volume.integrate(number, &self.grid, patch, Some(&Isometry3::identity()));
            }
            volume.update();
            volume
        }
    }

    fn middle(z: f32) -> Voxel {
        voxel_at(&Point3::new(0.01, 0.01, z), 20.0)
    }

    #[test]
    fn an_object_observed_many_times_that_has_left_is_free_after_a_few_patches() {
        let fixture = Fixture::new();
        assert!(fixture.with_object(1.52, 40, 0).is_occupied(middle(1.52)));
        assert!(fixture.with_object(1.52, 40, 4).is_occupied(middle(1.52)), "a few misses are not enough");
        let left = fixture.with_object(1.52, 40, 10);
        assert!(!left.is_occupied(middle(1.52)) && left.get(middle(1.52)).is_some(), "free, not unknown");
        assert!(left.is_occupied(middle(3.01)), "the wall stays");
        assert_eq!(left.get(middle(3.2)), None, "the space behind the wall is unknown");
    }

    #[test]
    fn a_patch_that_is_moved_leaves_nothing_at_its_old_pose() {
        let fixture = Fixture::new();
        let patch = scene::wall(&fixture.grid, 2.01, Some(1.22));
        let poses: Vec<_> =
            (0..6).map(|i| Isometry3::new(Vector3::new(0.1 * i as f64, 0.0, 0.0), Vector3::y() * 0.05)).collect();
        let corrected: Vec<_> =
            poses.iter().map(|pose| Isometry3::new(Vector3::new(0.0, 0.3, 0.1), Vector3::x() * 0.1) * pose).collect();
        let mut moved = Volume::new(&fixture.config);
        for (number, pose) in poses.iter().enumerate() {
            moved.integrate(number, &fixture.grid, &patch, Some(pose));
            moved.update();
        }
        // The last one is in another world by now.
        for (number, pose) in corrected.iter().enumerate() {
            assert!(moved.integrate(number, &fixture.grid, &patch, Some(pose).filter(|_| number < 5)));
        }
        moved.update();
        let mut rebuilt = Volume::new(&fixture.config);
        corrected.iter().take(5).enumerate().for_each(|(number, pose)| {
            rebuilt.integrate(number, &fixture.grid, &patch, Some(pose));
        });
        rebuilt.update();
        assert!(moved.voxels().eq(rebuilt.voxels()) && rebuilt.voxels().count() > 1000);
    }

    #[test]
    fn a_small_correction_changes_nothing() {
        let fixture = Fixture::new();
        let mut volume = fixture.with_object(1.5, 1, 0);
        let patch = scene::wall(&fixture.grid, 3.01, Some(1.5));
        let pose = Isometry3::translation(0.01, 0.0, 0.0);
        assert!(!volume.integrate(0, &fixture.grid, &patch, Some(&pose)));
        assert!(volume.integrate(0, &fixture.grid, &patch, Some(&Isometry3::translation(0.05, 0.0, 0.0))));
    }
}

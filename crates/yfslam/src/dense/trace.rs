//! Ray casting of a patch: which voxels it observes as occupied and which as free (Amanatides and Woo, Eurographics 1987).
//!
//! In: a patch and its pose. Out: for each block of voxels that it observes, the voxels in which readings end and those that rays
//! pass. A voxel of both kinds counts as occupied (Hornung et al., "OctoMap", Autonomous Robots 2013, section 5.1). Of the readings
//! that end in one voxel only one is cast, because the others pass the same voxels.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::dense::DenseConfig;
use crate::dense::keyframe_patch::{CellGrid, KeyframePatch};
use crate::dense::voxels::{Bits, Block, Voxel, block_of, index_in_block, voxel_at};

/// The observation of a block by a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct BlockObservation {
    /// The block.
    pub block: Block,
    /// Voxels in which readings end.
    pub hit: Bits,
    /// Voxels that rays pass.
    pub free: Bits,
}

/// The blocks that are being observed, within a bounding box of all readings.
struct Window {
    lowest: Block,
    size: [usize; 3],
    /// Index into `observations` plus one, by block of the bounding box; 0 where there is none.
    index: Vec<u32>,
    observations: Vec<BlockObservation>,
    /// Voxels in which any reading has ended, also one that makes no surface.
    ended: Vec<Bits>,
}

impl Window {
    /// Returns a window around the camera and all ends of rays.
    fn around(origin: Voxel, ends: impl Iterator<Item = Voxel>) -> Self {
        let (mut lowest, mut highest) = (block_of(origin), block_of(origin));
        for end in ends {
            let block = block_of(end);
            lowest = [0, 1, 2].map(|axis| lowest[axis].min(block[axis]));
            highest = [0, 1, 2].map(|axis| highest[axis].max(block[axis]));
        }
        let size = [0, 1, 2].map(|axis| (highest[axis] - lowest[axis] + 1) as usize);
        Self { lowest, size, index: vec![0; size.iter().product()], observations: Vec::new(), ended: Vec::new() }
    }

    /// Returns the index of a block in `observations`. Blocks outside the bounding box, which rounding may give, are assigned to
    /// its border.
    #[inline]
    fn slot(&mut self, block: Block) -> usize {
        let [x, y, z] =
            [0, 1, 2].map(|axis| ((block[axis] - self.lowest[axis]).max(0) as usize).min(self.size[axis] - 1));
        let index = &mut self.index[x + self.size[0] * (y + self.size[1] * z)];
        if *index == 0 {
            self.observations.push(BlockObservation { block, hit: Bits::default(), free: Bits::default() });
            self.ended.push(Bits::default());
            *index = self.observations.len() as u32;
        }
        *index as usize - 1
    }

    /// Marks the voxels on the ray from `from` to `to`, without the last one.
    fn cast_ray(&mut self, from: &Point3<f32>, to: &Point3<f32>, per_m: f32) {
        let (mut voxel, last) = (voxel_at(from, per_m), voxel_at(to, per_m));
        let direction = (to - from) * per_m;
        let start = from.coords * per_m;
        let step = direction.map(|d| if d > 0.0 { 1 } else { -1 });
        let per_voxel = direction.map(|d| if d == 0.0 { f32::INFINITY } else { 1.0 / d.abs() });
        let mut next = Vector3::from_fn(|axis, _| {
            let border = voxel[axis] as f32 + if direction[axis] > 0.0 { 1.0 } else { 0.0 };
            if direction[axis] == 0.0 { f32::INFINITY } else { (border - start[axis]) / direction[axis] }
        });
        let steps: i32 = (0..3).map(|axis| (last[axis] - voxel[axis]).abs()).sum();
        let mut block = block_of(voxel);
        let mut slot = self.slot(block);
        for _ in 0..steps {
            let now = block_of(voxel);
            if now != block {
                block = now;
                slot = self.slot(block);
            }
            self.observations[slot].free.insert(index_in_block(voxel));
            let axis = if next.x <= next.y && next.x <= next.z {
                0
            } else if next.y <= next.z {
                1
            } else {
                2
            };
            voxel[axis] += step[axis];
            next[axis] += per_voxel[axis];
        }
    }
}

/// Returns the observations of a patch with pose `t_map_cam`, ordered by block.
pub(super) fn trace(
    config: &DenseConfig,
    grid: &CellGrid,
    patch: &KeyframePatch,
    t_map_cam: &Isometry3<f64>,
) -> Vec<BlockObservation> {
    let per_m = 1.0 / config.resolution_m;
    let pose: Isometry3<f32> = t_map_cam.cast();
    let rotation = pose.rotation.to_rotation_matrix();
    let origin = Point3::from(pose.translation.vector);
    // End of each ray, and whether it is a static surface.
    let mut ends: Vec<(Point3<f32>, bool)> = Vec::with_capacity(grid.rays().len());
    for (cell, &[x, y]) in grid.rays().iter().enumerate() {
        let Some(reading) = patch.reading(cell) else { continue };
        let z = reading.depth_m.min(config.max_range_m);
        let is_surface = !reading.moves && reading.depth_m <= config.max_range_m;
        ends.push((origin + rotation * Vector3::new(x * z, y * z, z), is_surface));
    }
    let mut window = Window::around(voxel_at(&origin, per_m), ends.iter().map(|(end, _)| voxel_at(end, per_m)));
    for (end, is_surface) in &ends {
        let voxel = voxel_at(end, per_m);
        let (slot, index) = (window.slot(block_of(voxel)), index_in_block(voxel));
        if *is_surface {
            window.observations[slot].hit.insert(index);
        }
        if !window.ended[slot].contains(index) {
            window.ended[slot].insert(index);
            window.cast_ray(&origin, end, per_m);
        }
    }
    let mut observations = window.observations;
    for observation in &mut observations {
        observation.free.remove_all(&observation.hit);
    }
    observations.retain(|observation| !observation.hit.is_empty() || !observation.free.is_empty());
    observations.sort_unstable_by_key(|observation| observation.block);
    observations
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense::scene;

    #[test]
    fn readings_end_on_the_wall_and_the_space_before_it_is_free() {
        let config = DenseConfig::default();
        let grid = CellGrid::new(&scene::camera(), config.stride_px);
        let patch = scene::wall(&grid, 2.01, None);
        let observations = trace(&config, &grid, &patch, &Isometry3::identity());
        let find = |z: f32| {
            let voxel = voxel_at(&Point3::new(0.11, 0.07, z), 20.0);
            let observation = observations.iter().find(|one| one.block == block_of(voxel)).unwrap();
            (observation.hit.contains(index_in_block(voxel)), observation.free.contains(index_in_block(voxel)))
        };
        assert_eq!(find(2.02), (true, false));
        for z in [0.3, 1.0, 1.93] {
            assert_eq!(find(z), (false, true), "{z}");
        }
        assert_eq!(find(2.08), (false, false), "behind the wall");
        assert!(observations.windows(2).all(|pair| pair[0].block < pair[1].block), "ordered, each block once");
    }

    #[test]
    fn a_moving_surface_leaves_only_free_space_before_it() {
        let config = DenseConfig::default();
        let grid = CellGrid::new(&scene::camera(), config.stride_px);
        let mut patch = scene::wall(&grid, 2.01, None);
        patch.depth.iter_mut().for_each(|d| *d |= 1 << 15);
        let observations = trace(&config, &grid, &patch, &Isometry3::identity());
        assert!(
            observations.iter().all(|observation| observation.hit.is_empty())
                && observations.iter().any(|observation| !observation.free.is_empty())
        );
    }
}

//! Which voxels a patch has seen occupied and which free: ray casting (Amanatides and Woo, Eurographics 1987).
//!
//! In: a patch and where it hangs. Out: for each block of voxels that it sees, the voxels in which readings end and those that they pass.
//! Where both is said of a voxel, it is occupied (Hornung et al., "OctoMap", Autonomous Robots 2013, section 5.1). Of the readings that
//! end in one voxel one is cast: the others pass what it passes.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::dense::DenseConfig;
use crate::dense::keyframe_patch::{CellGrid, KeyframePatch};
use crate::dense::voxels::{Bits, Block, Voxel, block_of, place_of, voxel_at};

/// What a patch says of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Seen {
    /// The block.
    pub block: Block,
    /// Voxels in which readings end.
    pub hit: Bits,
    /// Voxels that readings pass.
    pub free: Bits,
}

/// Blocks in the making, in a box around all that a patch can see.
struct Window {
    lowest: Block,
    size: [usize; 3],
    /// One more than the place in `seen`, by block of the box; 0 where nothing was seen.
    index: Vec<u32>,
    seen: Vec<Seen>,
    /// Voxels in which a ray has ended, whatever it means.
    ended: Vec<Bits>,
}

impl Window {
    fn around(origin: Voxel, ends: impl Iterator<Item = Voxel>) -> Self {
        let (mut lowest, mut highest) = (block_of(origin), block_of(origin));
        for end in ends {
            let block = block_of(end);
            lowest = [0, 1, 2].map(|axis| lowest[axis].min(block[axis]));
            highest = [0, 1, 2].map(|axis| highest[axis].max(block[axis]));
        }
        let size = [0, 1, 2].map(|axis| (highest[axis] - lowest[axis] + 1) as usize);
        Self { lowest, size, index: vec![0; size.iter().product()], seen: Vec::new(), ended: Vec::new() }
    }

    /// Where a block is in `seen`. Blocks outside the box, which rounding could name, go to its border.
    #[inline]
    fn slot(&mut self, block: Block) -> usize {
        let [x, y, z] =
            [0, 1, 2].map(|axis| ((block[axis] - self.lowest[axis]).max(0) as usize).min(self.size[axis] - 1));
        let index = &mut self.index[x + self.size[0] * (y + self.size[1] * z)];
        if *index == 0 {
            self.seen.push(Seen { block, hit: Bits::default(), free: Bits::default() });
            self.ended.push(Bits::default());
            *index = self.seen.len() as u32;
        }
        *index as usize - 1
    }

    /// Marks the voxels from `from` on until that of `to`, which is left out.
    fn pass(&mut self, from: &Point3<f32>, to: &Point3<f32>, per_m: f32) {
        let (mut voxel, last) = (voxel_at(from, per_m), voxel_at(to, per_m));
        let way = (to - from) * per_m;
        let start = from.coords * per_m;
        let step = way.map(|d| if d > 0.0 { 1 } else { -1 });
        let per_voxel = way.map(|d| if d == 0.0 { f32::INFINITY } else { 1.0 / d.abs() });
        let mut next = Vector3::from_fn(|axis, _| {
            let border = voxel[axis] as f32 + if way[axis] > 0.0 { 1.0 } else { 0.0 };
            if way[axis] == 0.0 { f32::INFINITY } else { (border - start[axis]) / way[axis] }
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
            self.seen[slot].free.insert(place_of(voxel));
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

/// What a patch that hangs at `t_map_cam` says, ordered by block.
pub(super) fn trace(
    config: &DenseConfig,
    grid: &CellGrid,
    patch: &KeyframePatch,
    t_map_cam: &Isometry3<f64>,
) -> Vec<Seen> {
    let per_m = 1.0 / config.resolution_m;
    let pose: Isometry3<f32> = t_map_cam.cast();
    let rotation = pose.rotation.to_rotation_matrix();
    let origin = Point3::from(pose.translation.vector);
    // The end of each reading, and whether it is a surface that stays.
    let mut ends: Vec<(Point3<f32>, bool)> = Vec::with_capacity(grid.rays().len());
    for (cell, &[x, y]) in grid.rays().iter().enumerate() {
        let Some(reading) = patch.reading(cell) else { continue };
        let z = reading.depth_m.min(config.max_range_m);
        let stays = !reading.moves && reading.depth_m <= config.max_range_m;
        ends.push((origin + rotation * Vector3::new(x * z, y * z, z), stays));
    }
    let mut window = Window::around(voxel_at(&origin, per_m), ends.iter().map(|(end, _)| voxel_at(end, per_m)));
    for (end, stays) in &ends {
        let voxel = voxel_at(end, per_m);
        let (slot, place) = (window.slot(block_of(voxel)), place_of(voxel));
        if *stays {
            window.seen[slot].hit.insert(place);
        }
        if !window.ended[slot].contains(place) {
            window.ended[slot].insert(place);
            window.pass(&origin, end, per_m);
        }
    }
    let mut seen = window.seen;
    for one in &mut seen {
        one.free.remove_all(&one.hit);
    }
    seen.retain(|one| !one.hit.is_empty() || !one.free.is_empty());
    seen.sort_unstable_by_key(|one| one.block);
    seen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense::scene;

    #[test]
    fn readings_end_on_the_wall_and_pass_what_is_before_it() {
        let config = DenseConfig::default();
        let grid = CellGrid::new(&scene::camera(), config.stride_px);
        let patch = scene::wall(&grid, 2.01, None);
        let seen = trace(&config, &grid, &patch, &Isometry3::identity());
        let find = |z: f32| {
            let voxel = voxel_at(&Point3::new(0.11, 0.07, z), 20.0);
            let one = seen.iter().find(|one| one.block == block_of(voxel)).unwrap();
            (one.hit.contains(place_of(voxel)), one.free.contains(place_of(voxel)))
        };
        assert_eq!(find(2.02), (true, false));
        for z in [0.3, 1.0, 1.93] {
            assert_eq!(find(z), (false, true), "{z}");
        }
        assert_eq!(find(2.08), (false, false), "behind the wall");
        assert!(seen.windows(2).all(|pair| pair[0].block < pair[1].block), "ordered, each block once");
    }

    #[test]
    fn what_moves_leaves_only_the_free_space_before_it() {
        let config = DenseConfig::default();
        let grid = CellGrid::new(&scene::camera(), config.stride_px);
        let mut patch = scene::wall(&grid, 2.01, None);
        patch.depth.iter_mut().for_each(|d| *d |= 1 << 15);
        let seen = trace(&config, &grid, &patch, &Isometry3::identity());
        assert!(seen.iter().all(|one| one.hit.is_empty()) && seen.iter().any(|one| !one.free.is_empty()));
    }
}

//! A coloured point cloud: one point for each occupied voxel.
//!
//! In: a dense map and its volume. Out: the mean of the readings in each occupied voxel; voxels with too few occupied neighbours
//! are left out as outliers.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3};

use crate::dense::voxels::{Block, VOXELS, Voxel, block_of, index_in_block, voxel_at, voxel_in};
use crate::dense::{DenseMap, Volume};

/// A point of a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudPoint {
    /// Its voxel.
    pub voxel: Voxel,
    /// Position in the frame of the volume, m.
    pub position_m: [f32; 3],
    /// Red, green, blue.
    pub color: [u8; 3],
}

/// Sums over the readings in a voxel: offsets from the voxel's corner in voxels, colour, count.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    offset: [f32; 3],
    color: [u32; 3],
    count: u32,
}

/// Returns the cloud of a dense map, ordered by block, then by index in the block. `progress` receives the number of finished
/// patches.
pub fn cloud(dense_map: &DenseMap, volume: &Volume, mut progress: impl FnMut(usize)) -> Vec<CloudPoint> {
    let config = volume.config();
    let per_m = 1.0 / config.resolution_m;
    let mut sums: BTreeMap<Block, Vec<Sum>> = BTreeMap::new();
    for (number, placed) in dense_map.patches.iter().enumerate() {
        progress(number);
        let Some(pose) = volume.pose(number) else { continue };
        let pose: Isometry3<f32> = pose.cast();
        for (p, color) in placed.patch.points(&dense_map.grid, config.max_range_m) {
            let p = pose * p;
            let voxel = voxel_at(&p, per_m);
            let block = block_of(voxel);
            let sums = sums.entry(block).or_insert_with(|| vec![Sum::default(); VOXELS]);
            sums[index_in_block(voxel)].add(&p, per_m, voxel, color);
        }
    }
    let mut points = Vec::new();
    for (block, sums) in &sums {
        for (index, sum) in sums.iter().enumerate().filter(|(_, sum)| sum.count > 0) {
            let voxel = voxel_in(*block, index);
            if volume.is_occupied(voxel) && neighbours(volume, voxel) >= config.min_neighbours {
                points.push(sum.mean(voxel, config.resolution_m));
            }
        }
    }
    points
}

/// Returns the memory that the sums of a cloud take, bytes.
pub(crate) fn bytes(volume: &Volume) -> usize {
    let has_surface = |block: &Block| volume.voxels_in(*block).any(|known| known.occupied);
    volume.blocks().filter(has_surface).count() * VOXELS * size_of::<Sum>()
}

/// Returns the number of occupied voxels among the 26 neighbours of a voxel.
pub(crate) fn neighbours(volume: &Volume, [x, y, z]: Voxel) -> usize {
    let around = (0..27).filter(|i| *i != 13).map(|i| [x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1]);
    around.filter(|voxel| volume.is_occupied(*voxel)).count()
}

impl Sum {
    fn add(&mut self, p: &Point3<f32>, per_m: f32, voxel: Voxel, color: [u8; 3]) {
        for axis in 0..3 {
            self.offset[axis] += p[axis] * per_m - voxel[axis] as f32;
            self.color[axis] += u32::from(color[axis]);
        }
        self.count += 1;
    }

    fn mean(&self, voxel: Voxel, resolution_m: f32) -> CloudPoint {
        let count = self.count as f32;
        CloudPoint {
            voxel,
            position_m: [0, 1, 2].map(|axis| (voxel[axis] as f32 + self.offset[axis] / count) * resolution_m),
            color: self.color.map(|sum| ((sum + self.count / 2) / self.count) as u8),
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::dense::keyframe_patch::CellGrid;
    use crate::dense::{DenseConfig, scene};
    use crate::geometry::Pose;

    #[test]
    fn a_cloud_has_one_point_a_voxel_on_the_surface_with_its_colour() {
        let config = DenseConfig::default();
        let grid = CellGrid::new(&scene::camera(), config.stride_px);
        let patch = scene::wall(&grid, 2.01, None);
        let dense_map = DenseMap::of_poses(grid, [(Pose::identity(), patch)]);
        let volume = dense_map.volume(&config, &UnitQuaternion::identity(), |_| {}).unwrap();
        let points = cloud(&dense_map, &volume, |_| {});
        assert!(points.iter().all(|p| (p.position_m[2] - 2.01).abs() < 1e-3 && p.color == [120, 130, 140]));
        let mut voxels: Vec<_> = points.iter().map(|p| p.voxel).collect();
        voxels.sort_unstable();
        voxels.dedup();
        assert_eq!(voxels.len(), points.len());
        let (width, height) = (2.01 * 159.0 / 134.0, 2.01 * 119.0 / 134.0);
        let expected = width * height / 0.0025;
        assert!((points.len() as f32 - expected).abs() < 0.1 * expected, "{} of {expected}", points.len());
    }
}

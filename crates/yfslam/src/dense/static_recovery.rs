//! Static recovery: cells within a person mask that show a static surface.
//!
//! In: a patch with its pose, and the volume. Out: which of its moving cells are static. Masks are larger than the person, so that
//! no part of a person becomes a surface; images without people need not lose the wall around the person. A reading is static if it
//! ends on a surface of the map, which other patches have made, or if it continues a plane of such surfaces.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use crate::dense::keyframe_patch::{CellGrid, KeyframePatch};
use crate::dense::voxels::voxel_at;
use crate::dense::{DenseConfig, Volume};

/// Cells along each side of the blocks in which planes are fitted.
const BLOCK: usize = 16;
/// Least share of a block's cells that must be static for a plane.
const PLANE_SHARE: f32 = 0.25;
/// Least number of cells of a block and its neighbours on the plane: enough for a wall, a table, a floor, not for the seat of a
/// chair.
const WIDE: usize = 2 * BLOCK * BLOCK;
/// Least share of the static cells of a block that must be on the plane.
const SAME_SHARE: f32 = 0.9;
/// Distance from a plane that is noise at any depth, m.
const NOISE_M: f32 = 0.01;

/// Returns for each cell of a patch whether it is marked as moving but is static.
pub(super) fn recover_static_cells(
    volume: &Volume,
    t_map_cam: &Isometry3<f32>,
    grid: &CellGrid,
    patch: &KeyframePatch,
) -> Vec<bool> {
    let is_static = |cell: usize| patch.moves(cell) && is_on_surface(volume, t_map_cam, grid, patch, cell);
    let recovered: Vec<bool> = (0..grid.rays().len()).map(is_static).collect();
    let mut recovery = Recovery { config: volume.config(), grid, patch, recovered };
    let [columns, rows] = recovery.blocks();
    let blocks = (0..rows).flat_map(|row| (0..columns).map(move |column| [column, row]));
    // Planes are fitted to surfaces of the map only: if recovered cells made planes too, they would extend around a person.
    let planes: Vec<([usize; 2], Plane)> = blocks.filter_map(|block| Some((block, recovery.plane(block)?))).collect();
    for (block, plane) in planes {
        recovery.extend_plane(&plane, block);
    }
    recovery.recovered
}

/// Returns whether the volume has a surface at the end of a cell's reading, or next to it if the voxel itself is unknown.
fn is_on_surface(
    volume: &Volume,
    t_map_cam: &Isometry3<f32>,
    grid: &CellGrid,
    patch: &KeyframePatch,
    cell: usize,
) -> bool {
    let config = volume.config();
    // Beyond its range the volume has no data.
    let Some(reading) = patch.reading(cell).filter(|reading| reading.depth_m <= config.max_range_m) else {
        return false;
    };
    let ([x, y], z) = (grid.rays()[cell], reading.depth_m);
    let at @ [i, j, k] = voxel_at(&(t_map_cam * Point3::new(x * z, y * z, z)), 1.0 / config.resolution_m);
    let neighbour = |n: i32| volume.is_occupied([i + n % 3 - 1, j + n / 3 % 3 - 1, k + n / 9 - 1]);
    volume.get(at).map_or_else(|| (0..27).any(neighbour), |known| known.occupied)
}

/// A patch with the cells that have been recovered.
struct Recovery<'a> {
    config: &'a DenseConfig,
    grid: &'a CellGrid,
    patch: &'a KeyframePatch,
    recovered: Vec<bool>,
}

impl Recovery<'_> {
    /// Returns the number of columns and rows of blocks.
    fn blocks(&self) -> [usize; 2] {
        [self.grid.columns(), self.grid.rows()].map(|cells| cells.div_ceil(BLOCK))
    }

    /// Returns a block and its neighbours.
    fn around(&self, [column, row]: [usize; 2]) -> impl Iterator<Item = [usize; 2]> + use<> {
        let [columns, rows] = self.blocks();
        let near = |at: usize, end: usize| at.saturating_sub(1)..(at + 2).min(end);
        near(row, rows).flat_map(move |row| near(column, columns).map(move |column| [column, row]))
    }

    /// Returns the cells of a block.
    fn cells(&self, [column, row]: [usize; 2]) -> impl Iterator<Item = usize> + use<> {
        let (columns, rows) = (self.grid.columns(), self.grid.rows());
        let range = |at: usize, end: usize| (at * BLOCK)..((at + 1) * BLOCK).min(end);
        range(row, rows).flat_map(move |row| range(column, columns).map(move |column| row * columns + column))
    }

    /// Returns ray and depth, m, of the static cells of a block.
    fn static_readings(&self, block: [usize; 2]) -> impl Iterator<Item = ([f32; 2], f32)> {
        let static_cells = self.cells(block).filter(|cell| !self.patch.moves(*cell) || self.recovered[*cell]);
        static_cells.filter_map(|cell| Some((self.grid.rays()[cell], self.patch.reading(cell)?.depth_m)))
    }

    /// Returns the plane of the static cells of a block, if they are on one and it is large enough.
    fn plane(&self, block: [usize; 2]) -> Option<Plane> {
        let (mut squares, mut sums, mut count) = (Matrix3::zeros(), Vector3::zeros(), 0);
        for ([x, y], z) in self.static_readings(block) {
            let ray = Vector3::new(x, y, 1.0);
            squares += ray * ray.transpose();
            sums += ray / z;
            count += 1;
        }
        if (count as f32) < PLANE_SHARE * (BLOCK * BLOCK) as f32 {
            return None;
        }
        let plane = Plane(squares.cholesky()?.solve(&sums));
        let on_it =
            |block| self.static_readings(block).filter(|(ray, z)| plane.contains(self.config, *ray, *z)).count();
        let is_plane = on_it(block) as f32 >= SAME_SHARE * count as f32;
        let is_wide = || self.around(block).map(on_it).sum::<usize>() >= WIDE;
        (is_plane && is_wide()).then_some(plane)
    }

    /// Recovers the readings on the plane of a block, by region growing over blocks.
    fn extend_plane(&mut self, plane: &Plane, block: [usize; 2]) {
        let mut open: Vec<[usize; 2]> = self.around(block).collect();
        while let Some(block) = open.pop() {
            let mut found = false;
            for cell in self.cells(block) {
                let candidate = self.patch.reading(cell).filter(|reading| reading.moves && !self.recovered[cell]);
                if candidate.is_some_and(|reading| plane.contains(self.config, self.grid.rays()[cell], reading.depth_m))
                {
                    self.recovered[cell] = true;
                    found = true;
                }
            }
            if found {
                open.extend(self.around(block));
            }
        }
    }
}

/// A plane as inverse depth, which is linear in the ray (x, y, 1).
struct Plane(Vector3<f32>);

impl Plane {
    /// Returns whether a reading is on the plane within the noise.
    fn contains(&self, config: &DenseConfig, [x, y]: [f32; 2], z: f32) -> bool {
        let inverse = self.0.dot(&Vector3::new(x, y, 1.0));
        inverse > 0.0 && (z - 1.0 / inverse).abs() <= NOISE_M + config.smooth_noise_per_m * z * z
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::dense::{DenseMap, scene};
    use crate::geometry::Pose;

    const MOVING: u16 = 1 << 15;

    /// Returns the recovered cells of a wall 3 m away with an object in the middle at `object_m`. Cells from column `from` of 80 on
    /// are marked as moving; the map has the columns for which `is_mapped` returns true.
    fn recovered_cells(from: usize, object_m: f32, is_mapped: impl Fn(usize) -> bool) -> (CellGrid, Vec<bool>) {
        let config = DenseConfig::default();
        let grid = CellGrid::new(&scene::camera(), config.stride_px);
        let (mut patch, mut mapped) = (scene::wall(&grid, 3.0, Some(object_m)), scene::wall(&grid, 3.0, None));
        for cell in 0..patch.depth.len() {
            let column = cell % grid.columns();
            if column >= from {
                patch.depth[cell] |= MOVING;
            }
            if !is_mapped(column) {
                mapped.depth[cell] = 0;
                if column < from {
                    patch.depth[cell] = 0;
                }
            }
        }
        let dense_map = DenseMap::of_poses(grid.clone(), [(Pose::identity(), mapped)]);
        let volume = dense_map.volume(&config, &UnitQuaternion::identity(), |_| {}).unwrap();
        let found = recover_static_cells(&volume, &volume.pose(0).unwrap().cast(), &grid, &patch);
        (grid, found)
    }

    #[test]
    fn a_wall_continues_beside_a_person() {
        for object_m in [1.5, 2.7, 2.9] {
            let (grid, found) = recovered_cells(32, object_m, |column| column < 32);
            let at = |column: usize, row: usize| found[row * grid.columns() + column];
            assert!(at(60, 10) && at(79, 59) && at(50, 30), "the wall is recovered in the whole mask");
            assert!((33..48).all(|column| (23..38).all(|row| !at(column, row))), "a person at {object_m} m is not");
            assert!(!at(10, 10), "a cell that is not marked is not recovered");
        }
    }

    #[test]
    fn a_narrow_plane_is_not_extended() {
        let (grid, found) = recovered_cells(32, 1.5, |column| (28..32).contains(&column));
        assert!(!found[10 * grid.columns() + 60], "a strip of 4 cells");
    }
}

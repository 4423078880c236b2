//! Cells within an outline that show no body but what stands beside it.
//!
//! In: a patch in its place, and the volume. Out: which of its cells that are said to move are believed all the same. What moves is
//! outlined generously, for no part of it may become a surface; the view without people need not lose the wall with it. A reading
//! is believed if it ends on a surface of the map, which other views have made; and if it goes on with a plane of such surfaces.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use crate::dense::keyframe_patch::{CellGrid, KeyframePatch};
use crate::dense::voxels::voxel_at;
use crate::dense::{DenseConfig, Volume};

/// Cells along each side of the blocks in which planes are sought.
const BLOCK: usize = 16;
/// Share of a block's cells that have to show a plane before it is carried on.
const PLANE_SHARE: f32 = 0.25;
/// Cells of a block and those next to it that have to be on its plane: a wall, a desk, a floor, not the seat of a chair.
const WIDE: usize = 2 * BLOCK * BLOCK;
/// Share of them that have to be on one plane.
const SAME_SHARE: f32 = 0.9;
/// Least distance from a plane that is noise, m.
const NOISE_M: f32 = 0.01;

/// Of each cell of a patch, whether it moves by its mark but shows what stands.
pub(super) fn beside(volume: &Volume, t_map_cam: &Isometry3<f32>, grid: &CellGrid, patch: &KeyframePatch) -> Vec<bool> {
    let stands = |cell: usize| patch.moves(cell) && stands(volume, t_map_cam, grid, patch, cell);
    let believed: Vec<bool> = (0..grid.rays().len()).map(stands).collect();
    let mut beside = Beside { config: volume.config(), grid, patch, believed };
    let [columns, rows] = beside.blocks();
    let blocks = (0..rows).flat_map(|row| (0..columns).map(move |column| [column, row]));
    // Only what was there before makes planes: carried on from one believed cell to the next they would turn round a body.
    let planes: Vec<([usize; 2], Plane)> = blocks.filter_map(|block| Some((block, beside.plane(block)?))).collect();
    for (block, plane) in planes {
        beside.carry_on(&plane, block);
    }
    beside.believed
}

/// Whether the map has a surface where a cell's reading ends, or one next to it and nobody has seen through the place itself.
fn stands(volume: &Volume, t_map_cam: &Isometry3<f32>, grid: &CellGrid, patch: &KeyframePatch, cell: usize) -> bool {
    let config = volume.config();
    // Far away the volume says nothing.
    let Some(reading) = patch.reading(cell).filter(|reading| reading.depth_m <= config.max_range_m) else {
        return false;
    };
    let ([x, y], z) = (grid.rays()[cell], reading.depth_m);
    let at @ [i, j, k] = voxel_at(&(t_map_cam * Point3::new(x * z, y * z, z)), 1.0 / config.resolution_m);
    let beside = |n: i32| volume.is_occupied([i + n % 3 - 1, j + n / 3 % 3 - 1, k + n / 9 - 1]);
    volume.get(at).map_or_else(|| (0..27).any(beside), |known| known.occupied)
}

/// A patch of which some cells are believed though they move by their mark.
struct Beside<'a> {
    config: &'a DenseConfig,
    grid: &'a CellGrid,
    patch: &'a KeyframePatch,
    believed: Vec<bool>,
}

impl Beside<'_> {
    /// Columns and rows of blocks.
    fn blocks(&self) -> [usize; 2] {
        [self.grid.columns(), self.grid.rows()].map(|cells| cells.div_ceil(BLOCK))
    }

    /// A block and those next to it.
    fn around(&self, [column, row]: [usize; 2]) -> impl Iterator<Item = [usize; 2]> + use<> {
        let [columns, rows] = self.blocks();
        let near = |at: usize, end: usize| at.saturating_sub(1)..(at + 2).min(end);
        near(row, rows).flat_map(move |row| near(column, columns).map(move |column| [column, row]))
    }

    /// The cells of a block.
    fn cells(&self, [column, row]: [usize; 2]) -> impl Iterator<Item = usize> + use<> {
        let (columns, rows) = (self.grid.columns(), self.grid.rows());
        let range = |at: usize, end: usize| (at * BLOCK)..((at + 1) * BLOCK).min(end);
        range(row, rows).flat_map(move |row| range(column, columns).map(move |column| row * columns + column))
    }

    /// Ray and depth, m, of the cells of a block that show what stands.
    fn standing(&self, block: [usize; 2]) -> impl Iterator<Item = ([f32; 2], f32)> {
        let stands = self.cells(block).filter(|cell| !self.patch.moves(*cell) || self.believed[*cell]);
        stands.filter_map(|cell| Some((self.grid.rays()[cell], self.patch.reading(cell)?.depth_m)))
    }

    /// The plane of what stands in a block, if that is one, and a wide one.
    fn plane(&self, block: [usize; 2]) -> Option<Plane> {
        let (mut squares, mut sums, mut count) = (Matrix3::zeros(), Vector3::zeros(), 0);
        for ([x, y], z) in self.standing(block) {
            let ray = Vector3::new(x, y, 1.0);
            squares += ray * ray.transpose();
            sums += ray / z;
            count += 1;
        }
        if (count as f32) < PLANE_SHARE * (BLOCK * BLOCK) as f32 {
            return None;
        }
        let plane = Plane(squares.cholesky()?.solve(&sums));
        let on_it = |block| self.standing(block).filter(|(ray, z)| plane.holds(self.config, *ray, *z)).count();
        let is_plane = on_it(block) as f32 >= SAME_SHARE * count as f32;
        let is_wide = || self.around(block).map(on_it).sum::<usize>() >= WIDE;
        (is_plane && is_wide()).then_some(plane)
    }

    /// Believes readings on the plane of a block, from there on as far as it is not interrupted by a whole block.
    fn carry_on(&mut self, plane: &Plane, block: [usize; 2]) {
        let mut open: Vec<[usize; 2]> = self.around(block).collect();
        while let Some(block) = open.pop() {
            let mut found = false;
            for cell in self.cells(block) {
                let unsure = self.patch.reading(cell).filter(|reading| reading.moves && !self.believed[cell]);
                if unsure.is_some_and(|reading| plane.holds(self.config, self.grid.rays()[cell], reading.depth_m)) {
                    self.believed[cell] = true;
                    found = true;
                }
            }
            if found {
                open.extend(self.around(block));
            }
        }
    }
}

/// Inverse depth over the ray (x, y, 1): that of a plane is linear in it.
struct Plane(Vector3<f32>);

impl Plane {
    /// Whether a reading ends on it, as far as noise tells.
    fn holds(&self, config: &DenseConfig, [x, y]: [f32; 2], z: f32) -> bool {
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

    const MARK: u16 = 1 << 15;

    /// What is believed of a wall 3 m away, right of column `from` of 80 within an outline, and of a body in the middle at `body_m`;
    /// the map has what `stands`.
    fn believed(from: usize, body_m: f32, stands: impl Fn(usize) -> bool) -> (CellGrid, Vec<bool>) {
        let config = DenseConfig::default();
        let grid = CellGrid::new(&scene::camera(), config.stride_px);
        let (mut seen, mut known) = (scene::wall(&grid, 3.0, Some(body_m)), scene::wall(&grid, 3.0, None));
        for cell in 0..seen.depth.len() {
            let column = cell % grid.columns();
            if column >= from {
                seen.depth[cell] |= MARK;
            }
            if !stands(column) {
                known.depth[cell] = 0;
                if column < from {
                    seen.depth[cell] = 0;
                }
            }
        }
        let dense_map = DenseMap::of_poses(grid.clone(), [(Pose::identity(), known)]);
        let volume = dense_map.volume(&config, &UnitQuaternion::identity(), |_| {}).unwrap();
        let found = beside(&volume, &volume.pose(0).unwrap().cast(), &grid, &seen);
        (grid, found)
    }

    #[test]
    fn a_wall_goes_on_beside_a_body() {
        for body_m in [1.5, 2.7, 2.9] {
            let (grid, found) = believed(32, body_m, |column| column < 32);
            let at = |column: usize, row: usize| found[row * grid.columns() + column];
            assert!(at(60, 10) && at(79, 59) && at(50, 30), "the wall is believed as far as the outline goes");
            assert!((33..48).all(|column| (23..38).all(|row| !at(column, row))), "a body at {body_m} m is not");
            assert!(!at(10, 10), "what does not move need not be believed");
        }
    }

    #[test]
    fn a_narrow_plane_is_not_carried_on() {
        let (grid, found) = believed(32, 1.5, |column| (28..32).contains(&column));
        assert!(!found[10 * grid.columns() + 60], "a strip of 4 cells");
    }
}

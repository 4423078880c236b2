//! The ground grid for navigation: obstacles between two heights, projected onto the ground.
//!
//! In: a volume whose z-axis points up. Out: whether each column is occupied, free or unknown.

use std::collections::BTreeMap;

use crate::dense::Volume;
use crate::dense::cloud::neighbours;
use crate::dense::voxels::center_m;

/// The state of a column.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum GridCell {
    /// No voxel of the column is known.
    #[default]
    Unknown,
    /// All known voxels of the column are free.
    Free,
    /// A voxel of the column is occupied.
    Occupied,
}

/// A grid of columns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GroundGrid {
    /// Corner of the first cell with the least x and y, m.
    pub origin_m: [f64; 2],
    /// Side of a cell, m.
    pub resolution_m: f64,
    /// Cells along x.
    pub width: usize,
    /// Cells along y.
    pub height: usize,
    /// States, row by row, least y first.
    pub cells: Vec<GridCell>,
}

/// Returns the grid of what is between the heights `low_m` and `high_m`. Voxels with too few occupied neighbours are outliers and
/// count as free.
pub fn ground_grid(volume: &Volume, [low_m, high_m]: [f32; 2]) -> GroundGrid {
    let config = volume.config();
    let mut columns: BTreeMap<[i32; 2], GridCell> = BTreeMap::new();
    for known in volume.voxels() {
        let z = center_m(known.voxel, config.resolution_m).z;
        if z < low_m || z > high_m {
            continue;
        }
        let is_obstacle = known.occupied && neighbours(volume, known.voxel) >= config.min_neighbours;
        let state = if is_obstacle { GridCell::Occupied } else { GridCell::Free };
        let column = columns.entry([known.voxel[0], known.voxel[1]]).or_default();
        *column = (*column).max(state);
    }
    let (Some(left), Some(right)) = (columns.keys().map(|c| c[0]).min(), columns.keys().map(|c| c[0]).max()) else {
        return GroundGrid { resolution_m: f64::from(config.resolution_m), ..Default::default() };
    };
    let low = columns.keys().map(|c| c[1]).min().unwrap_or(0);
    let high = columns.keys().map(|c| c[1]).max().unwrap_or(0);
    let (width, height) = ((right - left + 1) as usize, (high - low + 1) as usize);
    let mut cells = vec![GridCell::Unknown; width * height];
    for ([x, y], state) in columns {
        cells[(y - low) as usize * width + (x - left) as usize] = state;
    }
    // The decimal value that the user wrote, not its 32-bit approximation.
    let resolution_m = (f64::from(config.resolution_m) * 1e6).round() / 1e6;
    let origin_m = [left, low].map(|v| f64::from(v) * resolution_m);
    GroundGrid { origin_m, resolution_m, width, height, cells }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::dense::{CellGrid, DenseConfig, DenseMap, gravity, scene};
    use crate::geometry::Pose;

    #[test]
    fn a_wall_is_occupied_and_the_space_before_it_is_free() {
        let config = DenseConfig::default();
        let grid = CellGrid::new(&scene::camera(), config.stride_px);
        let patch = scene::wall(&grid, 2.02, None);
        let dense_map = DenseMap::of_poses(grid, [(Pose::identity(), patch)]);
        let turn: UnitQuaternion<f64> = gravity::of_camera();
        let volume = dense_map.volume(&config, &turn, |_| {}).unwrap();
        let ground = ground_grid(&volume, [-0.3, 0.3]);
        let at = |x: f64, y: f64| {
            let [column, row] = [(x, 0), (y, 1)].map(|(v, axis)| ((v - ground.origin_m[axis]) / 0.05).floor() as usize);
            ground.cells[row * ground.width + column]
        };
        assert_eq!(at(2.03, 0.1), GridCell::Occupied);
        assert_eq!(at(1.0, 0.1), GridCell::Free);
        assert_eq!(at(0.5, 1.0), GridCell::Unknown, "outside the field of view");
        assert_eq!(ground.cells.len(), ground.width * ground.height);
    }
}

//! Scenes for the tests of dense maps: flat walls in the images of a small camera.

use crate::camera::Camera;
use crate::dense::keyframe_patch::{CellGrid, KeyframePatch};

/// Returns a camera of 160 × 120 px and about 60°.
pub(crate) fn camera() -> Camera {
    Camera::pinhole(160, 120, 134.0, 134.0, 79.5, 59.5).with_bf(10.0)
}

/// Returns the patch of a wall at `depth_m` with, in the middle, a square object at `object_m`.
pub(crate) fn wall(grid: &CellGrid, depth_m: f32, object_m: Option<f32>) -> KeyframePatch {
    let is_middle = |cell: usize| {
        let (column, row) = (cell % grid.columns(), cell / grid.columns());
        column.abs_diff(grid.columns() / 2) < 8 && row.abs_diff(grid.rows() / 2) < 8
    };
    let depth_of = |cell: usize| object_m.filter(|_| is_middle(cell)).unwrap_or(depth_m);
    KeyframePatch::of_depths((0..grid.columns() * grid.rows()).map(depth_of), [120, 130, 140])
}

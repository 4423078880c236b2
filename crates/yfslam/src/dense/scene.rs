//! What tests of dense maps look at: flat walls seen by a small camera.

use crate::camera::Camera;
use crate::dense::keyframe_patch::{CellGrid, KeyframePatch};

/// A camera of 160 × 120 pixels and 60° or so.
pub(crate) fn camera() -> Camera {
    Camera::pinhole(160, 120, 134.0, 134.0, 79.5, 59.5).with_bf(10.0)
}

/// A wall at `depth_m` with, in the middle, a square thing at `thing_m`.
pub(crate) fn wall(grid: &CellGrid, depth_m: f32, thing_m: Option<f32>) -> KeyframePatch {
    let is_middle = |cell: usize| {
        let (column, row) = (cell % grid.columns(), cell / grid.columns());
        column.abs_diff(grid.columns() / 2) < 8 && row.abs_diff(grid.rows() / 2) < 8
    };
    let at = |cell: usize| thing_m.filter(|_| is_middle(cell)).unwrap_or(depth_m);
    KeyframePatch::of_depths((0..grid.columns() * grid.rows()).map(at), [120, 130, 140])
}

//! A keyframe patch as a source of depth and colour for the image of another view.
//!
//! In: a patch, its pose relative to the view, its recovered static cells. Out: its colours at points of the view, at the exposure
//! of the view.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::dense::Volume;
use crate::dense::keyframe_patch::{CellGrid, KeyframePatch};

/// Depth difference up to which a patch shows the same surface: share of the depth, plus a constant, m.
const SAME_SHARE: f32 = 0.04;
const SAME_M: f32 = 0.04;
/// Least share of the interpolation weight of a likely colour that must come from cells of the surface.
const LIKELY_SHARE: f32 = 0.25;

/// Step between the cells in which exposure is compared, and number of cells needed for that.
const EXPOSURE_STEP: usize = 37;
const EXPOSURE_CELLS: usize = 50;

/// How certain a cell of a patch must be to be used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Certainty {
    /// Nothing moves in the cell, and all around it is the same surface.
    Certain,
    /// Nothing moves in the cell, or static recovery has found that it is static.
    Likely,
}

/// A patch from which depth and colour are taken.
pub(super) struct Source<'a> {
    /// Distance of its pose from that of the view: metres plus twice the angle in radians.
    pub distance: f64,
    pub patch: &'a KeyframePatch,
    /// Which of its moving cells are static by static recovery.
    pub recovered: &'a [bool],
    pub grid: &'a CellGrid,
    pub volume: &'a Volume,
    pub t_view_source: Isometry3<f32>,
    pub t_map_source: Isometry3<f32>,
    /// Factor of its colours, because exposure changes from frame to frame.
    pub gain: Vector3<f32>,
}

impl Source<'_> {
    /// Returns its colour at a point of the view.
    pub(super) fn color_at(&self, point: &Point3<f32>, certainty: Certainty) -> Option<Vector3<f32>> {
        let p = self.t_view_source.inverse_transform_point(point);
        let at = self.grid.project(&p)?;
        interpolated_color(self.grid, self.patch, at, p.z, certainty, self.recovered)
    }

    /// Adapts its exposure to that of the view's own patch, by the surfaces that both show.
    pub(super) fn match_exposure(&mut self, grid: &CellGrid, own: &KeyframePatch) {
        let (mut own_sum, mut source_sum, mut count) = (Vector3::zeros(), Vector3::zeros(), 0);
        for (cell, [x, y]) in grid.rays().iter().enumerate().step_by(EXPOSURE_STEP) {
            let Some(z) = own.surface_m(cell) else { continue };
            if let Some(color) = self.color_at(&Point3::new(x * z, y * z, z), Certainty::Certain) {
                own_sum += Vector3::from(own.color(cell).map(f32::from));
                source_sum += color;
                count += 1;
            }
        }
        if count >= EXPOSURE_CELLS {
            self.gain =
                own_sum.zip_map(&source_sum, |own_sum, source_sum| (own_sum / source_sum.max(1.0)).clamp(0.5, 2.0));
        }
    }
}

/// Returns the interpolated colour of a patch at a position; `None` if another surface or something that moves is there. For a
/// likely colour such cells are left out instead, and `recovered` cells are used.
fn interpolated_color(
    grid: &CellGrid,
    patch: &KeyframePatch,
    [column, row]: [f32; 2],
    z: f32,
    certainty: Certainty,
    recovered: &[bool],
) -> Option<Vector3<f32>> {
    let (left, top) = (column.floor(), row.floor());
    let (dx, dy) = (column - left, row - top);
    let (mut sum, mut weights, mut same) = (Vector3::<f32>::zeros(), 0.0, false);
    for (x, y, weight) in [
        (0.0, 0.0, (1.0 - dx) * (1.0 - dy)),
        (1.0, 0.0, dx * (1.0 - dy)),
        (0.0, 1.0, (1.0 - dx) * dy),
        (1.0, 1.0, dx * dy),
    ] {
        let (c, r) = (left + x, top + y);
        if c < 0.0 || r < 0.0 || c >= grid.columns() as f32 || r >= grid.rows() as f32 {
            continue;
        }
        let cell = r as usize * grid.columns() + c as usize;
        let depth = patch.reading(cell).map(|reading| reading.depth_m);
        let is_other = depth.is_some_and(|depth| (depth - z).abs() > SAME_M + SAME_SHARE * z);
        let is_likely = certainty == Certainty::Likely;
        if is_other || patch.moves(cell) && !(is_likely && recovered[cell]) {
            if is_likely {
                continue;
            }
            return None;
        }
        same |= depth.is_some();
        sum += Vector3::from(patch.color(cell).map(f32::from)) * weight;
        weights += weight;
    }
    let least = if certainty == Certainty::Likely { LIKELY_SHARE } else { 0.0 };
    (same && weights > least).then(|| sum / weights)
}

//! The instance mask on coarse cells of two by two cells, on which the depth history compares frames.
//!
//! In: coarse cells that move or not. Out: their labels and depths.

use crate::dynamic::segment::mask::{InstanceMask, UNTRACKED};

impl InstanceMask {
    /// Returns for each coarse cell (two by two cells) whether it is labelled, and its depth, m; 0 where it is unknown.
    pub(crate) fn coarse_cells(&self) -> impl Iterator<Item = (bool, f32)> + '_ {
        let count = (self.rows / 2) * (self.columns / 2);
        (0..count).map(|coarse| self.upper_left_cell(coarse)).map(|cell| (self.labels[cell] != 0, self.depth_m[cell]))
    }

    /// Returns the track to which a coarse cell belongs.
    pub(crate) fn track_of_coarse_cell(&self, coarse: usize) -> Option<usize> {
        match self.labels[self.upper_left_cell(coarse)] {
            0 | UNTRACKED => None,
            label => Some(usize::from(label) - 1),
        }
    }

    /// Clears the labels of a coarse cell.
    pub(crate) fn clear_coarse_cell(&mut self, coarse: usize) {
        let cell = self.upper_left_cell(coarse);
        for start in [cell, cell + self.columns] {
            self.labels[start..start + 2].fill(0);
        }
    }

    /// Returns the upper left cell of the four cells of a coarse one.
    fn upper_left_cell(&self, coarse: usize) -> usize {
        let half = (self.columns / 2).max(1);
        2 * (coarse / half) * self.columns + 2 * (coarse % half)
    }

    /// Marks a coarse cell and the cells next to it, as far as they have no label.
    pub(crate) fn mark_coarse_cell(&mut self, column: usize, row: usize) {
        for r in (2 * row).saturating_sub(1)..(2 * row + 3).min(self.rows) {
            let start = r * self.columns;
            let cells = start + (2 * column).saturating_sub(1)..start + (2 * column + 3).min(self.columns);
            self.labels[cells].iter_mut().filter(|label| **label == 0).for_each(|label| *label = UNTRACKED);
        }
    }
}

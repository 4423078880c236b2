//! Weak corners in regions without strong ones.
//!
//! In: strong and weak corners of a level. Out: the strong corners, and the weak corners of the cells that have no strong one
//! (ORB-SLAM2, IEEE T-RO 2017, section III: the threshold is lowered in cells without corners).

use super::fast::{Corner, Corners};

/// A grid of square cells. Its buffer is reused.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cells {
    has_strong: Vec<bool>,
}

impl Cells {
    /// Appends to `corners.strong` each weak corner whose cell has no strong one; cells are `side` (≥ 1) px wide.
    pub(super) fn fill_empty(&mut self, side: usize, [width, height]: [usize; 2], corners: &mut Corners) {
        let per_row = width / side + 1;
        self.has_strong.clear();
        self.has_strong.resize(per_row * (height / side + 1), false);
        // A multiplication replaces the slower division by `side`; it is exact below 2^16.
        let reciprocal = (1 << 32) / side as u64 + 1;
        let divided = |v: u16| ((u64::from(v) * reciprocal) >> 32) as usize;
        let cell = |corner: &Corner| divided(corner.y) * per_row + divided(corner.x);
        for corner in &corners.strong {
            self.has_strong[cell(corner)] = true;
        }
        corners.strong.extend(corners.weak.iter().filter(|corner| !self.has_strong[cell(corner)]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weak_corners_are_added_in_cells_without_a_strong_one() {
        let corner = |x, y, score| Corner { x, y, score };
        let strong = vec![corner(29, 29, 30)];
        let weak = vec![corner(0, 0, 10), corner(30, 29, 10), corner(29, 30, 10), corner(65_534, 59, 10)];
        let mut corners = Corners { strong, weak };
        Cells::default().fill_empty(30, [65_535, 60], &mut corners);
        let expected = [corner(29, 29, 30), corner(30, 29, 10), corner(29, 30, 10), corner(65_534, 59, 10)];
        assert_eq!(corners.strong, expected);
    }

    #[test]
    fn the_reciprocal_divides_exactly() {
        for side in [1, 2, 3, 7, 30, 32, 255, 30_000, 65_535, 70_000] {
            let reciprocal = (1 << 32) / side + 1;
            for v in 0..=u64::from(u16::MAX) {
                assert_eq!((v * reciprocal) >> 32, v / side);
            }
        }
    }
}

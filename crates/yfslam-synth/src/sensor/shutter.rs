//! The shutter: the instant at which each row of an image is read.
//!
//! In: the instant of the middle row and the time from the first to the last row. Out: the time of any row. A rolling shutter reads
//! one row after the other at an even pace (Forssén and Ringaby, "Rectifying rolling shutter video from hand-held devices", CVPR
//! 2010, section 3).

/// The times of the rows of one image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shutter {
    /// Time of the row in the middle of the image, s: that of its time stamp.
    pub middle_s: f64,
    /// Time from the first to the last row, s: positive if the top row is read first, 0 if all rows are read at once.
    pub readout_s: f64,
}

impl Shutter {
    /// Returns whether all rows are read at once.
    pub fn is_global(&self) -> bool {
        self.readout_s == 0.0
    }

    /// Returns the time from one row to the next in an image of `rows` rows, s.
    pub fn line_s(&self, rows: usize) -> f64 {
        self.readout_s / rows.saturating_sub(1).max(1) as f64
    }

    /// Returns the time at which `row` of an image of `rows` rows is read, s; rows may lie between pixels.
    pub fn time(&self, row: f64, rows: usize) -> f64 {
        self.middle_s + (row - 0.5 * rows.saturating_sub(1) as f64) * self.line_s(rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_readout_lies_evenly_around_the_middle_row() {
        let shutter = Shutter { middle_s: 2.0, readout_s: 0.03 };
        let near = |row: f64, wanted: f64| assert!((shutter.time(row, 481) - wanted).abs() < 1e-12, "row {row}");
        near(0.0, 1.985);
        near(240.0, 2.0);
        near(480.0, 2.015);
        let upward = Shutter { readout_s: -0.03, ..shutter };
        assert!((upward.time(0.0, 481) - shutter.time(480.0, 481)).abs() < 1e-12);
        assert_eq!(Shutter { readout_s: 0.0, ..shutter }.time(7.0, 481), 2.0);
        assert_eq!(shutter.time(0.0, 1), 2.0);
    }
}

//! Timing of a sequence: rate, gaps, and the time offset between paired images.

use super::{FrameEntry, Sequence};

/// Timing of the frames that are played.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SequenceInfo {
    /// Number of frames.
    pub frames: usize,
    /// Time from the first to the last frame, ns.
    pub duration_ns: i64,
    /// Median time between neighbouring frames, ns; 0 with fewer than two frames.
    pub median_period_ns: i64,
    /// Longest time between neighbouring frames, ns.
    pub max_gap_ns: i64,
    /// Number of gaps longer than twice the median period, where frames are missing.
    pub gaps: usize,
    /// Time offset of the depth or right images; `None` for a monocular camera.
    pub offset: Option<TimeOffset>,
}

/// Stamp of the depth or right image minus that of the colour image over a sequence, ns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TimeOffset {
    /// Signed median; a value far from zero means that one sensor lags.
    pub median_ns: i64,
    /// Largest absolute value.
    pub max_abs_ns: i64,
}

impl SequenceInfo {
    /// Returns the frames per second from the median period; `None` with fewer than two frames.
    pub fn rate_hz(&self) -> Option<f64> {
        (self.median_period_ns > 0).then(|| 1e9 / self.median_period_ns as f64)
    }
}

impl Sequence {
    /// Computes the timing of the frames without opening an image.
    pub fn info(&self) -> SequenceInfo {
        let stamps: Vec<i64> = self.entries.iter().map(|e| e.timestamp_ns).collect();
        let mut periods: Vec<i64> = stamps.windows(2).map(|w| w[1].saturating_sub(w[0])).collect();
        let median_period_ns = median(&mut periods);
        let offset_ns = |e: &FrameEntry| Some(e.paired_image.as_ref()?.stamp_ns.saturating_sub(e.timestamp_ns));
        let mut offsets: Vec<i64> = self.entries.iter().filter_map(offset_ns).collect();
        SequenceInfo {
            frames: stamps.len(),
            duration_ns: stamps.first().zip(stamps.last()).map_or(0, |(first, last)| last.saturating_sub(*first)),
            median_period_ns,
            max_gap_ns: periods.iter().copied().max().unwrap_or(0),
            gaps: periods.iter().filter(|&&period| period > median_period_ns.saturating_mul(2)).count(),
            offset: (!offsets.is_empty()).then(|| TimeOffset {
                median_ns: median(&mut offsets),
                max_abs_ns: offsets.iter().map(|offset| offset.saturating_abs()).max().unwrap_or(0),
            }),
        }
    }
}

/// Returns the upper median, 0 without values. Reorders `values`.
fn median(values: &mut [i64]) -> i64 {
    let middle = values.len() / 2;
    if values.is_empty() { 0 } else { *values.select_nth_unstable(middle).1 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    use crate::sequence::{AssociationReport, GroundTruthReader, Layout, ListedImage};
    use yfslam::config::DepthSource;

    fn sequence(stamps: &[(i64, i64)]) -> Sequence {
        let entry = |&(timestamp_ns, stamp_ns): &(i64, i64)| FrameEntry {
            timestamp_ns,
            color: PathBuf::from("c").into(),
            paired_image: Some(ListedImage { stamp_ns, image: PathBuf::from("d").into() }),
        };
        Sequence {
            folder: ".".into(),
            layout: Layout::Tum,
            depth_source: DepthSource::Image,
            calibration: None,
            ground_truth: GroundTruthReader::tum("groundtruth.txt".into()),
            entries: stamps.iter().map(entry).collect(),
            report: AssociationReport::default(),
            mirror: None,
            unread_calibration: None,
            because: String::new(),
            notes: Vec::new(),
        }
    }

    #[test]
    fn gaps_rate_and_offsets_are_counted() {
        let ms = 1_000_000;
        let info =
            sequence(&[(0, 5), (33, 30), (66, 76), (170, 170), (203, 203)].map(|(c, d)| (c * ms, d * ms))).info();
        assert_eq!((info.frames, info.duration_ns, info.median_period_ns), (5, 203 * ms, 33 * ms));
        assert_eq!((info.max_gap_ns, info.gaps), (104 * ms, 1));
        assert!((info.rate_hz().unwrap() - 30.303).abs() < 1e-3);
        assert_eq!(info.offset, Some(TimeOffset { median_ns: 0, max_abs_ns: 10 * ms }));
    }

    #[test]
    fn one_frame_has_no_rate() {
        let info = sequence(&[(7, 7)]).info();
        assert_eq!((info.frames, info.duration_ns, info.rate_hz(), info.gaps), (1, 0, None, 0));
    }
}

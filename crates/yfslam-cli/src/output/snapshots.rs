//! Images of a few frames for the report: some evenly spread, and the most crowded one.
//!
//! In: every frame after tracking. Out: JPEG images with features and boxes. The choice depends on the frames and their boxes alone, so
//! that methods on the same frames show the same ones.

use anyhow::{Context, Result};
use yfslam::{Frame, RgbImage, Slam};
use yfslam_io::write::encode_jpeg;
use yfslam_report::Snapshot as ReportSnapshot;

use super::overlay::draw_frame;
use crate::draw::shrink::shrink;

/// Quality of the images.
const QUALITY: u8 = 85;

/// Collects snapshots while frames are tracked.
pub struct Snapshots {
    /// Numbers of the frames that are still to come, the next one last.
    planned: Vec<usize>,
    /// Score from which a box counts.
    open_score: f32,
    taken: Vec<Snapshot>,
    /// Area of boxes in the most crowded frame, px², and that frame.
    crowded: Option<(f32, Snapshot)>,
}

struct Snapshot {
    frame: usize,
    image: RgbImage,
    /// Static and dynamic features.
    features: [usize; 2],
}

impl Snapshots {
    /// Plans `count` snapshots of `total` frames, and one of the most crowded frame.
    pub fn new(total: usize, count: usize, open_score: f32) -> Self {
        let mut planned: Vec<usize> = (0..count).map(|k| total * (2 * k + 1) / (2 * count)).collect();
        planned.dedup();
        planned.reverse();
        Self { planned, open_score, taken: Vec::new(), crowded: None }
    }

    /// Takes a snapshot of the frame that `slam` tracked last, if one is planned or it is the most crowded frame so far.
    pub fn record(&mut self, index: usize, frame: &Frame, slam: &Slam) {
        let boxes = slam.detections().iter().filter(|d| d.score >= self.open_score);
        let covered: f32 = boxes.map(|d| d.bbox.area()).sum();
        if covered > self.crowded.as_ref().map_or(0.0, |(most, _)| *most) {
            self.crowded = Some((covered, Snapshot::new(index, frame, slam, self.open_score)));
        }
        if self.planned.last().is_some_and(|next| index >= *next) {
            self.planned.pop();
            self.taken.push(Snapshot::new(index, frame, slam, self.open_score));
        }
    }

    /// Returns the images in order of time.
    ///
    /// # Errors
    /// An image is too large for JPEG.
    pub fn to_images(&self) -> Result<Vec<ReportSnapshot>> {
        let crowded = self.crowded.as_ref().map(|(_, snapshot)| snapshot);
        let mut snapshots: Vec<&Snapshot> = self.taken.iter().collect();
        snapshots.extend(crowded.filter(|crowded| self.taken.iter().all(|taken| taken.frame != crowded.frame)));
        snapshots.sort_by_key(|snapshot| snapshot.frame);
        let is_crowded = |snapshot: &Snapshot| crowded.is_some_and(|crowded| crowded.frame == snapshot.frame);
        let note = |snapshot: &Snapshot| if is_crowded(snapshot) { "the most crowded" } else { "" };
        snapshots.into_iter().map(|snapshot| snapshot.encode(note(snapshot))).collect()
    }
}

impl Snapshot {
    fn new(index: usize, frame: &Frame, slam: &Slam, open_score: f32) -> Self {
        let features = slam.features();
        let dynamic = features.iter().filter(|f| f.trust <= 0.0).count();
        let image = shrink(draw_frame(frame, slam, open_score));
        Self { frame: index, image, features: [features.len() - dynamic, dynamic] }
    }

    fn encode(&self, note: &'static str) -> Result<ReportSnapshot> {
        let Self { frame, image, features } = self;
        let size = [image.width(), image.height()];
        let jpeg = encode_jpeg(image, QUALITY).context("a snapshot is too large for JPEG")?;
        Ok(ReportSnapshot { frame: *frame, note, jpeg, size, features: *features })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn snapshots_are_spread_evenly_over_the_frames() {
        assert_eq!(Snapshots::new(100, 4, 0.5).planned, [87, 62, 37, 12]);
        assert_eq!(Snapshots::new(2, 4, 0.5).planned, [1, 0]);
    }
}

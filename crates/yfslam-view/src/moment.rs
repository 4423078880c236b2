//! What the page shows of one frame: the image, its features, what moves, and the figures of tracking.
//!
//! In: a frame and the system that has just tracked it. Out: a small copy, which another thread makes into a packet.

use serde_json::{Value, json};
use yfslam::{Detection, Frame, Region, RgbImage, Slam, StageTimes, Tracked, TrackingState};
use yfslam_io::write::encode_jpeg;

use crate::cells::Cells;
use crate::packet::{Numbered, PacketBuilder, seconds};

/// Quality of the images.
const QUALITY: u8 = 75;
/// Wider images are halved until they are no wider than this, px.
const MAX_WIDTH_PX: usize = 640;
/// Marks a feature that is matched to a landmark.
const MATCHED: u8 = 1;
/// Bytes of a feature: column and row, px, static probability, marks.
const FEATURE_BYTES: usize = 6;

/// A copy of what is shown of a frame. Its images are shared with the frame.
pub struct Moment {
    number: u64,
    frame: Frame,
    regions: Vec<Region>,
    detections: Vec<Detection>,
    features: Vec<u8>,
    matched: usize,
    tracked: Tracked,
    landmarks: usize,
    keyframes: usize,
}

impl Moment {
    /// Copies what is shown of the frame that `slam` has just tracked.
    pub fn new(number: u64, frame: &Frame, tracked: &Tracked, slam: &Slam) -> Self {
        let mut features = Vec::with_capacity(FEATURE_BYTES * slam.features().len());
        let mut matched = 0;
        for (index, feature) in slam.features().iter().enumerate() {
            let is_matched = slam.is_matched(index);
            matched += usize::from(is_matched);
            // A float cast saturates.
            let [x, y] = feature.raw.map(|at| (at.round() as u16).to_le_bytes());
            features.extend([x[0], x[1], y[0], y[1], (feature.trust * 255.0) as u8, u8::from(is_matched) * MATCHED]);
        }
        Self {
            number,
            frame: frame.clone(),
            regions: slam.moving_regions().to_vec(),
            detections: slam.detections().to_vec(),
            features,
            matched,
            tracked: tracked.clone(),
            // The iterator has its length; to count would visit every landmark.
            landmarks: slam.map().landmarks().size_hint().0,
            keyframes: slam.map().keyframe_count(),
        }
    }

    /// Makes the packet; `ticks` are number, time in seconds, inliers and duration in ms of the frames that the page does not know yet.
    pub fn encode(&self, ticks: &[[f64; 4]], cells: &Cells, start_ns: i64) -> Numbered {
        let Self { tracked, features, .. } = self;
        let image = bounded(&self.frame.color);
        let size = [self.frame.color.width(), self.frame.color.height()];
        let movers = cells.movers(&self.frame, &self.regions);
        let boxes: Vec<Value> = self.detections.iter().map(|d| boxed(&d.bbox, d.score)).collect();
        let regions: Vec<Value> = self.regions.iter().map(|region| boxed(&region.bbox, region.score)).collect();
        let pose = tracked.t_world_cam.map(|pose| pose.to_homogeneous().as_slice().to_vec());
        let head = json!({
            "number": self.number,
            "ticks": ticks,
            "t": seconds(tracked.timestamp_ns, start_ns),
            "state": state_name(tracked.state),
            "reason": tracked.lost_reason.map(|reason| reason.to_string()),
            "inliers": tracked.inliers,
            "features": features.len() / FEATURE_BYTES,
            "matched": self.matched,
            "keyframe": tracked.is_keyframe,
            "loop": tracked.loop_closure.is_some(),
            "landmarks": self.landmarks,
            "keyframes": self.keyframes,
            "times": times_ms(&tracked.times),
            "pose": pose,
            "size": size,
            "boxes": boxes,
            "regions": regions,
            "mask": [cells.columns(), cells.rows()],
        });
        let packet = PacketBuilder::new("frame", head);
        let jpeg = encode_jpeg(image.as_ref().unwrap_or(&self.frame.color), QUALITY).unwrap_or_default();
        let packet = packet.part("image", &jpeg);
        let packet = packet.part("points", features).part("moving", &movers.mask).part("movers", &movers.points);
        Numbered { number: self.number, packet: packet.build() }
    }
}

fn boxed(bbox: &yfslam::BoundingBox, score: f32) -> Value {
    json!([bbox.x_min, bbox.y_min, bbox.x_max, bbox.y_max, score])
}

fn state_name(state: TrackingState) -> &'static str {
    match state {
        TrackingState::NotInitialized => "initialising",
        TrackingState::Tracking => "tracking",
        TrackingState::Lost => "lost",
    }
}

/// Returns the wall times of features, detector, filter, tracking, mapping, loops and dense map, ms.
pub fn times_ms(times: &StageTimes) -> [f64; 7] {
    let StageTimes { features, detector_wait, dynamic, tracking, mapping, loops, .. } = *times;
    let dense = times.dense_patch + times.dense_map;
    [features, detector_wait, dynamic, tracking, mapping, loops, dense]
        .map(|time| (time.as_secs_f64() * 1e5).round() / 100.0)
}

/// Halves an image until it is no wider than is shown; `None` if it is not wider.
fn bounded(image: &RgbImage) -> Option<RgbImage> {
    let factor = image.width().div_ceil(MAX_WIDTH_PX).next_power_of_two();
    if factor == 1 {
        return None;
    }
    let mut small = RgbImage::new((image.width() / factor).max(1), (image.height() / factor).max(1));
    for y in 0..small.height() {
        let rows = [0, factor / 2].map(|below| image.row((y * factor + below).min(image.height() - 1)));
        for (x, pixel) in small.row_mut(y).iter_mut().enumerate() {
            let from = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(row, right)| rows[row][x * factor + right * factor / 2]);
            *pixel = [0, 1, 2].map(|channel| (from.iter().map(|p| u16::from(p[channel])).sum::<u16>() / 4) as u8);
        }
    }
    Some(small)
}

//! Tracks of movable objects over frames: a detection that is missing in some frames must not let a person into the map.
//!
//! In: the detections of a frame, then the segmented instances. Out: tracks, opened at a high score, kept at a low one, and
//! continued without detections with the velocity of their box (Dynamic-VINS, section on missed detections) or, where an instance
//! is segmented, with its motion.

use crate::config::DynamicConfig;
use crate::detect::{BoundingBox, Detection};
use crate::dynamic::track::Track;

/// Overlap from which on a moving object that no detector has found is that of a track. Source: chosen: half.
const SAME_UNKNOWN: f32 = 0.5;
/// Frames for which such an object is remembered after it has moved. Source: chosen: ten seconds; what is put down is often fetched again.
const MAX_UNKNOWN_FRAMES: usize = 300;

/// All tracks, in the order in which they were opened.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tracks {
    /// The tracks.
    pub list: Vec<Track>,
    /// Overlap, track and detection of each pair that may be associated.
    pairs: Vec<(f32, usize, usize)>,
    track_taken: Vec<bool>,
    detection_taken: Vec<bool>,
}

impl Tracks {
    /// Associates the detections of the next frame with the tracks; `depths_m` has the depth of the object in each box, m, where
    /// known, and the last argument width and height of the image, px. A box whose object is nearer or farther than that of a track
    /// belongs to another person who passes by: the track continues without a detection.
    pub(crate) fn update(
        &mut self,
        config: &DynamicConfig,
        max_misses: usize,
        detections: &[Detection],
        depths_m: &[Option<f32>],
        [width, height]: [usize; 2],
    ) {
        self.predict([width, height]);
        self.list.iter_mut().for_each(|track| track.missed_searches += usize::from(!track.is_unknown));
        // Pairs in descending order of overlap; the indices break ties.
        self.pairs.clear();
        for (t, track) in self.list.iter().enumerate() {
            for (d, (detection, depth_m)) in detections.iter().zip(depths_m).enumerate() {
                let iou = track.bbox.iou(&detection.bbox);
                let gap_m = track.depth_m.zip(*depth_m).map_or(0.0, |(a, b)| (a - b).abs());
                let is_same_object =
                    gap_m <= config.track_max_depth_gap_m + config.max_depth_step_m * track.depth_age as f32;
                if iou >= config.track_min_iou && detection.score >= config.keep_score && is_same_object {
                    self.pairs.push((iou, t, d));
                }
            }
        }
        self.pairs.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        self.track_taken.clear();
        self.track_taken.resize(self.list.len(), false);
        self.detection_taken.clear();
        self.detection_taken.resize(detections.len(), false);
        for &(_, t, d) in &self.pairs {
            if !self.track_taken[t] && !self.detection_taken[d] {
                self.track_taken[t] = true;
                self.detection_taken[d] = true;
                self.list[t].associate(&detections[d]);
            }
        }
        for (detection, taken) in detections.iter().zip(&self.detection_taken) {
            if !taken && detection.score >= config.open_score {
                self.list.push(Track::open(detection));
            }
        }
        self.list.retain(|track| track.missed_searches <= max_misses);
    }

    /// Reassigns the box of the new track `from`, whose object would be at depth `center_m`, to a track that has no detection in
    /// this frame, is segmented in front of that depth and has almost the same box; the new track then ends. It was opened because
    /// another person covers most of the box, so that the depth in the box did not fit. Returns whether there is such a track.
    pub(crate) fn reassign_box(&mut self, config: &DynamicConfig, from: usize, center_m: f32) -> bool {
        let Track { bbox, score, depth_m, .. } = self.list[from];
        let is_candidate = |track: &Track| {
            let is_segmented = track.misses > 0 && track.depth_age == 0 && !track.ended;
            is_segmented
                && track.depth_m.is_some_and(|z| z < center_m)
                && track.bbox.iou(&bbox) >= config.full.same_box_iou
        };
        if depth_m.is_some() {
            return false;
        }
        let Some(track) = self.list.iter_mut().find(|track| is_candidate(track)) else { return false };
        track.associate(&Detection { class: 0, score, bbox });
        self.list[from].ended = true;
        true
    }

    /// Opens or continues the track of an object that no detector has found, and that was seen to move. Returns its index, and the track as it was
    /// before.
    pub(crate) fn move_unknown(&mut self, bbox: BoundingBox, depth_m: f32) -> (usize, Option<Track>) {
        let is_same = |track: &Track| track.is_unknown && !track.ended && overlap(&track.bbox, &bbox) >= SAME_UNKNOWN;
        if let Some(t) = self.list.iter().position(is_same) {
            let before = self.list[t];
            self.list[t].move_unknown(bbox, depth_m);
            return (t, Some(before));
        }
        self.list.push(Track::open_unknown(bbox, depth_m));
        (self.list.len() - 1, None)
    }

    /// Takes back [`Self::move_unknown`]: nothing moves there.
    pub(crate) fn restore_unknown(&mut self, t: usize, before: Option<Track>) {
        match before {
            Some(before) => self.list[t] = before,
            None => self.list[t].ended = true,
        }
    }

    /// Predicts the tracks for the next frame by their velocity. On its own it serves frames that no detector has processed: tracks
    /// then continue without limit.
    pub(crate) fn predict(&mut self, [width, height]: [usize; 2]) {
        let image = BoundingBox { x_min: 0.0, y_min: 0.0, x_max: width as f32, y_max: height as f32 };
        self.list.iter_mut().for_each(Track::predict);
        self.list.retain(|track| !track.ended && track.bbox.iou(&image) > 0.0);
        self.list.retain(|track| !track.is_unknown || track.missed_searches <= MAX_UNKNOWN_FRAMES);
    }
}

/// Returns the share of the smaller box that the other one covers.
fn overlap(a: &BoundingBox, b: &BoundingBox) -> f32 {
    let side = |a: [f32; 2], b: [f32; 2]| (a[1].min(b[1]) - a[0].max(b[0])).max(0.0);
    let area = |b: &BoundingBox| (b.x_max - b.x_min) * (b.y_max - b.y_min);
    let common = side([a.x_min, a.x_max], [b.x_min, b.x_max]) * side([a.y_min, a.y_max], [b.y_min, b.y_max]);
    common / area(a).min(area(b)).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamic::segment::mask::Extent;
    use crate::dynamic::track::center;

    fn detection(x: f32, score: f32) -> Detection {
        let bbox = BoundingBox { x_min: x, y_min: 100.0, x_max: x + 100.0, y_max: 400.0 };
        Detection { class: 0, score, bbox }
    }

    #[test]
    fn a_track_continues_over_missed_detections() {
        let config = DynamicConfig::default();
        let mut tracks = Tracks::default();
        for i in 0..10 {
            tracks.update(&config, 10, &[detection(50.0 + 8.0 * i as f32, 0.8)], &[None], [640, 480]);
        }
        for _ in 0..5 {
            tracks.update(&config, 10, &[], &[], [640, 480]);
        }
        assert_eq!((tracks.list.len(), tracks.list[0].misses), (1, 5));
        assert!((tracks.list[0].bbox.x_min - 162.0).abs() < 4.0, "{:?}", tracks.list[0]);
        for _ in 0..10 {
            tracks.update(&config, 10, &[], &[], [640, 480]);
        }
        assert!(tracks.list.is_empty());
    }

    #[test]
    fn a_person_who_passes_in_front_does_not_take_over_a_track() {
        let config = DynamicConfig::default();
        let mut tracks = Tracks::default();
        tracks.update(&config, 10, &[detection(50.0, 0.8)], &[Some(2.0)], [640, 480]);
        tracks.list[0].depth_m = Some(2.0);
        tracks.update(&config, 10, &[detection(60.0, 0.8)], &[Some(1.2)], [640, 480]);
        assert_eq!(tracks.list.iter().map(|t| t.misses).collect::<Vec<_>>(), [1, 0]);
    }

    #[test]
    fn a_detection_of_low_score_keeps_a_track_but_opens_none() {
        let config = DynamicConfig::default();
        let mut tracks = Tracks::default();
        tracks.update(&config, 10, &[detection(50.0, 0.15)], &[None], [640, 480]);
        assert!(tracks.list.is_empty());
        tracks.update(&config, 10, &[detection(50.0, 0.5)], &[None], [640, 480]);
        tracks.update(&config, 10, &[detection(52.0, 0.15)], &[None], [640, 480]);
        assert_eq!((tracks.list.len(), tracks.list[0].misses), (1, 0));
    }

    /// Returns the tracks after ten frames in which a person 2 m away, who is segmented, walks by 8 px a frame.
    fn walker(config: &DynamicConfig) -> Tracks {
        let mut tracks = Tracks::default();
        for i in 0..10 {
            tracks.update(config, 10, &[detection(50.0 + 8.0 * i as f32, 0.8)], &[Some(2.0)], [640, 480]);
            tracks.list[0].depth_m = Some(2.0);
            tracks.list[0].update_extent(config, &Extent { middle: [105.0 + 8.0 * i as f32, 240.0], cells: 1000 });
        }
        tracks
    }

    #[test]
    fn without_a_detector_a_box_moves_with_its_instance() {
        let config = DynamicConfig::default();
        let mut tracks = walker(&config);
        for i in 0..90 {
            tracks.predict([640, 480]);
            // The person turns round at once and is occluded in part for a while: then the box keeps its velocity.
            let cells = if (40..50).contains(&i) { 500 } else { 1000 };
            let middle = [177.0 - i as f32, if cells == 500 { 100.0 } else { 240.0 }];
            tracks.list[0].update_extent(&config, &Extent { middle, cells });
        }
        let [x, y] = center(&tracks.list[0].bbox);
        assert!((x - (177.0 - 89.0 - 5.0)).abs() < 1.0 && (y - 250.0).abs() < 1.0, "{x} {y}");
        for _ in 0..=10 {
            assert_eq!(tracks.list.len(), 1);
            tracks.update(&config, 10, &[], &[], [640, 480]);
        }
        assert!(tracks.list.is_empty(), "searches without a detection end it");
    }

    #[test]
    fn a_box_that_another_person_covers_is_reassigned_to_its_track() {
        let config = DynamicConfig::default();
        let mut tracks = walker(&config);
        // A person 1 m away covers most of the box: that is the depth measured in it, so that a track is opened.
        tracks.update(&config, 10, &[detection(130.0, 0.8)], &[Some(1.0)], [640, 480]);
        tracks.list[0].update_extent(&config, &Extent { middle: [185.0, 240.0], cells: 300 });
        assert_eq!(tracks.list.iter().map(|t| t.misses).collect::<Vec<_>>(), [1, 0]);
        assert!(!tracks.reassign_box(&config, 1, 1.0), "a nearer person is another one");
        assert!(tracks.reassign_box(&config, 1, 3.0), "the wall is not a person");
        assert_eq!((tracks.list[0].misses, tracks.list[0].bbox.x_min, tracks.list[1].ended), (0, 130.0, true));
    }

    #[test]
    fn with_a_detection_of_low_score_the_depth_does_not_jump() {
        let config = DynamicConfig::default();
        let mut tracks = walker(&config);
        tracks.update(&config, 10, &[detection(130.0, 0.8)], &[Some(2.0)], [640, 480]);
        assert!(tracks.list[0].is_depth_plausible(&config, 2.5));
        tracks.update(&config, 10, &[detection(138.0, 0.15)], &[Some(2.0)], [640, 480]);
        assert!(tracks.list[0].misses == 0 && !tracks.list[0].is_depth_plausible(&config, 2.5));
    }

    #[test]
    fn an_object_that_occludes_a_track_becomes_a_track() {
        let config = DynamicConfig::default();
        let mut tracks = walker(&config);
        tracks.predict([640, 480]);
        let track = &mut tracks.list[0];
        assert!(track.is_depth_plausible(&config, 2.1) && !track.is_depth_plausible(&config, 1.5));
        assert_eq!(track.occlude(Some(2.9)), None, "a farther object occludes nothing");
        let in_front = track.occlude(Some(1.5)).unwrap();
        assert_eq!((in_front.depth_m, in_front.bbox), (Some(1.5), track.bbox));
        assert_eq!(track.occlude(Some(1.4)), None, "an occlusion begins once");
    }
}

//! Boxes over time: a detector that blinks must not let a person in.
//!
//! In: the boxes of a frame, then the segmenter of the bodies in them. Out: tracks, opened at a high score, kept at a low one, and carried
//! over misses with the box's own velocity (Dynamic-VINS, section on missed detections) or, where a body is outlined, with the body.

use crate::config::DynamicConfig;
use crate::detect::{BoundingBox, Detection};
use crate::dynamic::Region;
use crate::dynamic::segment::mask::Extent;

/// A movable object followed in the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Track {
    /// Where it is, or should be, px.
    pub bbox: BoundingBox,
    /// Score of its last detection.
    pub score: f32,
    /// Frames since its last detection.
    pub misses: usize,
    /// Depth of the body when last seen, m.
    pub depth_m: Option<f32>,
    /// Frames since it was detected or, by a method that segmenter bodies, outlined there.
    pub depth_age: usize,
    /// Whether it was found to show nothing; the next update drops it.
    pub ended: bool,
    /// Whether the map knows what its box holds. That lasts while much the same box is detected.
    pub refuted: bool,
    /// Frames since its last detection in which a detector looked.
    missed_looks: usize,
    /// Motion of the box's centre, px per frame.
    velocity: [f32; 2],
    /// The body when it was last seen whole; its middle is counted from that of the box.
    body: Extent,
    /// Whether somebody is in front of it.
    hidden: bool,
}

/// All tracks, in the order in which they were opened.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tracks {
    /// The tracks.
    pub list: Vec<Track>,
    /// Overlap, track and detection of each pair that may belong together.
    pairs: Vec<(f32, usize, usize)>,
    track_taken: Vec<bool>,
    detection_taken: Vec<bool>,
}

impl Tracks {
    /// Takes the boxes of the next frame in, with the depth of the body in each, m, where it is known; `size` is the image's width and
    /// height, px. A box whose body is nearer or farther than a track's belongs to somebody else, who walks past: the track is carried on.
    pub(crate) fn update(
        &mut self,
        config: &DynamicConfig,
        max_misses: usize,
        detections: &[Detection],
        depths_m: &[Option<f32>],
        [width, height]: [usize; 2],
    ) {
        self.carry([width, height]);
        self.list.iter_mut().for_each(|track| track.missed_looks += 1);
        // Pairs of track and detection by descending overlap; indices break relative_poses.
        self.pairs.clear();
        for (t, track) in self.list.iter().enumerate() {
            for (d, (detection, depth_m)) in detections.iter().zip(depths_m).enumerate() {
                let iou = track.bbox.iou(&detection.bbox);
                let gap_m = track.depth_m.zip(*depth_m).map_or(0.0, |(a, b)| (a - b).abs());
                let same_body =
                    gap_m <= config.track_max_depth_gap_m + config.max_depth_step_m * track.depth_age as f32;
                if iou >= config.track_min_iou && detection.score >= config.keep_score && same_body {
                    self.pairs.push((iou, t, d));
                }
            }
        }
        self.pairs.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        self.track_taken.clear();
        self.track_taken.resize(self.list.len(), false);
        self.detection_taken.clear();
        self.detection_taken.resize(detections.len(), false);
        for &(iou, t, d) in &self.pairs {
            if !self.track_taken[t] && !self.detection_taken[d] {
                self.track_taken[t] = true;
                self.detection_taken[d] = true;
                self.list[t].refuted &= iou >= config.full.same_box_iou;
                self.list[t].follow(&detections[d]);
            }
        }
        for (detection, taken) in detections.iter().zip(&self.detection_taken) {
            if !taken && detection.score >= config.open_score {
                self.list.push(Track {
                    bbox: detection.bbox,
                    score: detection.score,
                    misses: 0,
                    depth_m: None,
                    depth_age: 0,
                    ended: false,
                    missed_looks: 0,
                    velocity: [0.0; 2],
                    body: Extent::default(),
                    hidden: false,
                    refuted: false,
                });
            }
        }
        self.list.retain(|track| track.missed_looks <= if track.refuted { 0 } else { max_misses });
    }

    /// Gives the box of a new track, whose body would be `center_m` away, to one that was carried and whose body stands before that, if there
    /// is one with much the same box; the new one then ends. It was opened because somebody else covers most of the box, and what is left
    /// of it is the wall.
    pub(crate) fn give_box_back(&mut self, config: &DynamicConfig, from: usize, center_m: f32) -> bool {
        let Track { bbox, score, depth_m, .. } = self.list[from];
        let is_his = |track: &Track| {
            let seen = track.misses > 0 && track.depth_age == 0 && !track.ended;
            seen && track.depth_m.is_some_and(|z| z < center_m) && track.bbox.iou(&bbox) >= config.full.same_box_iou
        };
        if depth_m.is_some() {
            return false;
        }
        let Some(track) = self.list.iter_mut().find(|track| is_his(track)) else { return false };
        track.follow(&Detection { class: 0, score, bbox });
        self.list[from].ended = true;
        true
    }

    /// Takes a frame in for which nobody looked for boxes: tracks are carried on, however long that lasts.
    pub(crate) fn carry(&mut self, [width, height]: [usize; 2]) {
        let image = BoundingBox { x_min: 0.0, y_min: 0.0, x_max: width as f32, y_max: height as f32 };
        for track in &mut self.list {
            track.misses += 1;
            track.depth_age += 1;
            track.bbox = shifted(&track.bbox, track.velocity);
        }
        self.list.retain(|track| !track.ended && track.bbox.iou(&image) > 0.0);
    }
}

impl Track {
    /// Whether it is to be outlined.
    pub(crate) fn is_body(&self) -> bool {
        !self.ended && !self.refuted
    }

    /// Its box, with the depths of the body.
    pub(crate) fn region(&self, config: &DynamicConfig) -> Region {
        let depth_m = self.depth_m.map(|z| [z - config.group_half_width_m, z + config.group_half_width_m]);
        Region { bbox: self.bbox, score: self.score, misses: self.misses, depth_m }
    }

    /// Whether a body that fills its box at this depth, m, can be its own: without a sure box to say so, bodies do not jump.
    pub(crate) fn can_be_at(&self, config: &DynamicConfig, center_m: f32) -> bool {
        let is_sure = self.misses == 0 && self.score >= config.open_score;
        is_sure || self.depth_m.is_none_or(|z| (center_m - z).abs() <= config.full.max_jump_m)
    }

    /// Hides it behind what appeared in its box at this depth, m. Returns a track of that, if it is nearer and came just now: whoever hides
    /// a body that is followed moves too, though no detector may have seen him yet.
    pub(crate) fn hide(&mut self, center_m: Option<f32>) -> Option<Track> {
        let nearer = center_m.filter(|z| !self.hidden && self.depth_m.is_some_and(|own| *z < own))?;
        let in_front = Track { depth_m: Some(nearer), ended: false, ..*self };
        self.hidden = true;
        Some(in_front)
    }

    /// Learns which part of the box the body fills. Without a detection the box follows the body, as long as that is seen whole.
    pub(crate) fn note_body(&mut self, config: &DynamicConfig, body: &Extent) {
        self.hidden = false;
        self.depth_age = 0;
        let [x, y] = center(&self.bbox);
        let offset = [body.middle[0] - x, body.middle[1] - y];
        let is_whole = body.cells as f32 >= config.full.full_visibility_share * self.body.cells as f32;
        if self.misses == 0 {
            self.body = Extent { middle: offset, cells: body.cells };
        } else if is_whole {
            let error = [offset[0] - self.body.middle[0], offset[1] - self.body.middle[1]];
            self.bbox = shifted(&self.bbox, error);
            for (velocity, error) in self.velocity.iter_mut().zip(error) {
                *velocity += 0.5 * error;
            }
            self.body.cells = body.cells;
        }
    }

    fn follow(&mut self, detection: &Detection) {
        let (from, to) = (center(&self.bbox), center(&detection.bbox));
        // The box was already moved by the old velocity: what is left is the error of the prediction. Half of it is believed.
        for axis in 0..2 {
            self.velocity[axis] += 0.5 * (to[axis] - from[axis]) / self.misses.max(1) as f32;
        }
        self.bbox = detection.bbox;
        self.score = detection.score;
        self.misses = 0;
        self.depth_age = 0;
        self.missed_looks = 0;
    }
}

fn center(b: &BoundingBox) -> [f32; 2] {
    [0.5 * (b.x_min + b.x_max), 0.5 * (b.y_min + b.y_max)]
}

fn shifted(b: &BoundingBox, [dx, dy]: [f32; 2]) -> BoundingBox {
    BoundingBox { x_min: b.x_min + dx, y_min: b.y_min + dy, x_max: b.x_max + dx, y_max: b.y_max + dy }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn detection(x: f32, score: f32) -> Detection {
        let bbox = BoundingBox { x_min: x, y_min: 100.0, x_max: x + 100.0, y_max: 400.0 };
        Detection { class: 0, score, bbox }
    }

    #[test]
    fn a_walker_is_carried_over_missed_detections() {
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
    fn somebody_who_passes_in_front_does_not_take_a_track_over() {
        let config = DynamicConfig::default();
        let mut tracks = Tracks::default();
        tracks.update(&config, 10, &[detection(50.0, 0.8)], &[Some(2.0)], [640, 480]);
        tracks.list[0].depth_m = Some(2.0);
        tracks.update(&config, 10, &[detection(60.0, 0.8)], &[Some(1.2)], [640, 480]);
        assert_eq!(tracks.list.iter().map(|t| t.misses).collect::<Vec<_>>(), [1, 0]);
    }

    #[test]
    fn a_faint_box_keeps_a_track_but_opens_none() {
        let config = DynamicConfig::default();
        let mut tracks = Tracks::default();
        tracks.update(&config, 10, &[detection(50.0, 0.15)], &[None], [640, 480]);
        assert!(tracks.list.is_empty());
        tracks.update(&config, 10, &[detection(50.0, 0.5)], &[None], [640, 480]);
        tracks.update(&config, 10, &[detection(52.0, 0.15)], &[None], [640, 480]);
        assert_eq!((tracks.list.len(), tracks.list[0].misses), (1, 0));
    }

    #[test]
    fn a_refuted_box_is_ignored_while_it_stays() {
        let config = DynamicConfig::default();
        let mut tracks = Tracks::default();
        let mut refuted = |next: &[Detection]| {
            tracks.list.clear();
            tracks.update(&config, 10, &[detection(50.0, 0.8)], &[None], [640, 480]);
            tracks.list[0].refuted = true;
            tracks.update(&config, 10, next, &vec![None; next.len()], [640, 480]);
            tracks.list.iter().map(Track::is_body).collect::<Vec<_>>()
        };
        assert_eq!(refuted(&[detection(55.0, 0.8)]), [false]);
        assert_eq!(refuted(&[detection(90.0, 0.8)]), [true], "somebody else");
        assert_eq!(refuted(&[]), [false; 0], "it is not carried");
    }

    /// The tracks after ten frames in which somebody 2 m away walked by 8 px a frame, his body outlined.
    fn walker(config: &DynamicConfig) -> Tracks {
        let mut tracks = Tracks::default();
        for i in 0..10 {
            tracks.update(config, 10, &[detection(50.0 + 8.0 * i as f32, 0.8)], &[Some(2.0)], [640, 480]);
            tracks.list[0].depth_m = Some(2.0);
            tracks.list[0].note_body(config, &Extent { middle: [105.0 + 8.0 * i as f32, 240.0], cells: 1000 });
        }
        tracks
    }

    #[test]
    fn while_nobody_looks_a_box_follows_its_body() {
        let config = DynamicConfig::default();
        let mut tracks = walker(&config);
        for i in 0..90 {
            tracks.carry([640, 480]);
            // He turns round at once, and is hidden in part for a while: then the box keeps its pace.
            let cells = if (40..50).contains(&i) { 500 } else { 1000 };
            let middle = [177.0 - i as f32, if cells == 500 { 100.0 } else { 240.0 }];
            tracks.list[0].note_body(&config, &Extent { middle, cells });
        }
        let [x, y] = center(&tracks.list[0].bbox);
        assert!((x - (177.0 - 89.0 - 5.0)).abs() < 1.0 && (y - 250.0).abs() < 1.0, "{x} {y}");
        for _ in 0..=10 {
            assert_eq!(tracks.list.len(), 1);
            tracks.update(&config, 10, &[], &[], [640, 480]);
        }
        assert!(tracks.list.is_empty(), "looks that find nothing end it");
    }

    #[test]
    fn a_box_in_which_somebody_else_stands_in_front_goes_back_to_whoever_it_belongs_to() {
        let config = DynamicConfig::default();
        let mut tracks = walker(&config);
        // Somebody 1 m away covers most of the box: that is the depth found in it, so that a track is opened.
        tracks.update(&config, 10, &[detection(130.0, 0.8)], &[Some(1.0)], [640, 480]);
        tracks.list[0].note_body(&config, &Extent { middle: [185.0, 240.0], cells: 300 });
        assert_eq!(tracks.list.iter().map(|t| t.misses).collect::<Vec<_>>(), [1, 0]);
        assert!(!tracks.give_box_back(&config, 1, 1.0), "who stands in front of him is somebody else");
        assert!(tracks.give_box_back(&config, 1, 3.0), "the wall is nobody");
        assert_eq!((tracks.list[0].misses, tracks.list[0].bbox.x_min, tracks.list[1].ended), (0, 130.0, true));
    }

    #[test]
    fn a_faint_box_does_not_take_a_body_elsewhere() {
        let config = DynamicConfig::default();
        let mut tracks = walker(&config);
        tracks.update(&config, 10, &[detection(130.0, 0.8)], &[Some(2.0)], [640, 480]);
        assert!(tracks.list[0].can_be_at(&config, 2.5));
        tracks.update(&config, 10, &[detection(138.0, 0.15)], &[Some(2.0)], [640, 480]);
        assert!(tracks.list[0].misses == 0 && !tracks.list[0].can_be_at(&config, 2.5));
    }

    #[test]
    fn who_steps_in_front_of_a_body_is_followed_from_then_on() {
        let config = DynamicConfig::default();
        let mut tracks = walker(&config);
        tracks.carry([640, 480]);
        let track = &mut tracks.list[0];
        assert!(track.can_be_at(&config, 2.1) && !track.can_be_at(&config, 1.5));
        assert_eq!(track.hide(Some(2.9)), None, "what is farther hides nobody");
        let in_front = track.hide(Some(1.5)).unwrap();
        assert_eq!((in_front.depth_m, in_front.bbox), (Some(1.5), track.bbox));
        assert_eq!(track.hide(Some(1.4)), None, "once is enough");
    }
}

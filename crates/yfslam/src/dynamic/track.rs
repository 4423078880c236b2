//! The track of one movable object: its box, depth and extent over frames.
//!
//! In: detections, and the segmented instance of the track. Out: the state of the track, and its region in the image.

use crate::config::{DynamicConfig, FullConfig};
use crate::detect::{BoundingBox, Detection};
use crate::dynamic::Region;
use crate::dynamic::segment::mask::Extent;

/// Probability above which a detection is not believed. Source: OctoMap's largest probability (Hornung et al., Autonomous Robots 2013).
const MAX_PROBABILITY: f32 = 0.97;
/// Least log-odds by detections: at first, a box is believed.
const MIN_PRIOR_LOG_ODDS: f32 = 0.5;
/// Change by a frame in which it has moved. Source: OctoMap's hit, 0.7.
const MOVED_LOG_ODDS: f32 = 0.85;
/// Change by a frame in which it is where it was [`FULL_GAP_S`] before. Source: as [`MOVED_LOG_ODDS`].
const STILL_LOG_ODDS: f32 = 0.85;
/// Most that its features can show. Source: chosen: less than the log-odds of [`MAX_PROBABILITY`], so that a person of whom the detector is
/// certain is not used even while sitting: small motions of a body show late.
const MAX_EVIDENCE: f32 = 3.0;
/// Score of an object that no detector has found.
const UNKNOWN_SCORE: f32 = 0.5;
/// Time in which a movable object that moves has left its place, s. Source: chosen: a slow step.
const FULL_GAP_S: f32 = 0.3;

/// A movable object that is tracked in the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Track {
    /// Bounding box, measured or predicted, px.
    pub bbox: BoundingBox,
    /// Score of its last detection.
    pub score: f32,
    /// Frames since its last detection.
    pub misses: usize,
    /// Depth of the object when it was last measured, m.
    pub depth_m: Option<f32>,
    /// Frames since it was detected or, by methods that segment instances, segmented.
    pub depth_age: usize,
    /// Whether it was found to show no object; the next update removes it.
    pub ended: bool,
    /// Whether it is an object that no detector has found: it was opened because it moves.
    pub is_unknown: bool,
    /// Highest score of its detections.
    best_score: f32,
    /// Log-odds that it moves by what its features have shown.
    evidence: f32,
    /// Frames since its last detection in which the detector processed the image; of an object that no detector has found, frames since it
    /// has moved.
    pub(super) missed_searches: usize,
    /// Velocity of the centre of the box, px per frame.
    velocity: [f32; 2],
    /// The instance when it was last visible as a whole; `middle` is relative to the centre of the box.
    extent: Extent,
    /// Whether another object occludes it.
    occluded: bool,
}

impl Track {
    /// Opens a track for a detection.
    pub(super) fn open(detection: &Detection) -> Self {
        Self {
            bbox: detection.bbox,
            score: detection.score,
            misses: 0,
            depth_m: None,
            depth_age: 0,
            ended: false,
            missed_searches: 0,
            velocity: [0.0; 2],
            extent: Extent::default(),
            occluded: false,
            is_unknown: false,
            best_score: detection.score,
            evidence: 0.0,
        }
    }

    /// Opens a track for an object that no detector has found, and that moves.
    pub(super) fn open_unknown(bbox: BoundingBox, depth_m: f32) -> Self {
        let track = Self::open(&Detection { class: 0, score: UNKNOWN_SCORE, bbox });
        let evidence = 2.0 * MOVED_LOG_ODDS;
        Self { misses: 1, depth_m: Some(depth_m), is_unknown: true, evidence, ..track }
    }

    /// Continues the track of an unknown object that was seen to move.
    pub(super) fn move_unknown(&mut self, bbox: BoundingBox, depth_m: f32) {
        let (from, to) = (center(&self.bbox), center(&bbox));
        for axis in 0..2 {
            self.velocity[axis] += 0.5 * (to[axis] - from[axis]);
        }
        (self.bbox, self.depth_m, self.misses) = (bbox, Some(depth_m), 1);
        self.extent = Extent::default();
    }

    /// Moves the box by the velocity, for a frame without a detection so far.
    pub(super) fn predict(&mut self) {
        self.misses += 1;
        self.depth_age += 1;
        self.missed_searches += usize::from(self.is_unknown);
        self.bbox = shifted(&self.bbox, self.velocity);
    }

    /// Returns whether its instance is to be segmented.
    pub(crate) fn is_active(&self) -> bool {
        !self.ended
    }

    /// Log-odds that it moves: by its detections and by what its features have shown.
    pub(crate) fn moving_log_odds(&self) -> f32 {
        let score = self.best_score.clamp(1.0 - MAX_PROBABILITY, MAX_PROBABILITY);
        libm::logf(score / (1.0 - score)).max(MIN_PRIOR_LOG_ODDS) + self.evidence
    }

    /// Returns whether it is more likely to stand still than to move.
    pub(crate) fn stands_still(&self) -> bool {
        self.moving_log_odds() < 0.0
    }

    /// Returns whether its features have shown that it moves.
    pub(crate) fn is_proven(&self) -> bool {
        self.evidence > 0.0
    }

    /// Returns the probability that it stands still.
    pub(crate) fn static_probability(&self) -> f32 {
        1.0 / (1.0 + libm::expf(self.moving_log_odds()))
    }

    /// Takes into account which share of its features, relative to that of the background, is where it was `gap_s` seconds before.
    pub(crate) fn add_evidence(&mut self, config: &FullConfig, share: f32, gap_s: f32) {
        if share < config.moving_share || share * config.moving_share > 1.0 {
            // Whatever it has shown before, what moves now counts as moving at once. If the background seems to move, the pose follows the instance.
            self.evidence = (self.evidence.max(0.0) + MOVED_LOG_ODDS).min(MAX_EVIDENCE);
            self.missed_searches *= usize::from(!self.is_unknown);
        } else if share >= config.still_share {
            let weight = (gap_s / FULL_GAP_S).min(1.0);
            self.evidence = (self.evidence - STILL_LOG_ODDS * weight).max(-MAX_EVIDENCE);
        }
    }

    /// Returns its box with the depth interval of the object.
    pub(crate) fn region(&self, config: &DynamicConfig) -> Region {
        let depth_m = self.depth_m.map(|z| [z - config.group_half_width_m, z + config.group_half_width_m]);
        Region { bbox: self.bbox, score: self.score, misses: self.misses, depth_m }
    }

    /// Returns whether an object in its box at this depth, m, can be this one: unless a detection of high score says so, the depth
    /// of an object does not jump.
    pub(crate) fn is_depth_plausible(&self, config: &DynamicConfig, center_m: f32) -> bool {
        let is_sure = self.misses == 0 && self.score >= config.open_score;
        is_sure || self.depth_m.is_none_or(|z| (center_m - z).abs() <= config.full.max_jump_m)
    }

    /// Marks it as occluded by an object that appeared in its box at this depth, m. Returns a track of that object if it is nearer
    /// and the occlusion has just begun: an object in front of a tracked person moves too, even if it has not been detected yet.
    pub(crate) fn occlude(&mut self, center_m: Option<f32>) -> Option<Track> {
        let nearer = center_m.filter(|z| !self.occluded && self.depth_m.is_some_and(|own| *z < own))?;
        let in_front = Track { depth_m: Some(nearer), ended: false, ..*self };
        self.occluded = true;
        Some(in_front)
    }

    /// Stores the extent of the segmented instance. Without a detection the box moves with the instance, as long as the whole
    /// instance is visible.
    pub(crate) fn update_extent(&mut self, config: &DynamicConfig, extent: &Extent) {
        self.occluded = false;
        self.depth_age = 0;
        let [x, y] = center(&self.bbox);
        let offset = [extent.middle[0] - x, extent.middle[1] - y];
        let is_whole = extent.cells as f32 >= config.full.full_visibility_share * self.extent.cells as f32;
        if self.misses == 0 {
            self.extent = Extent { middle: offset, cells: extent.cells };
        } else if is_whole {
            let error = [offset[0] - self.extent.middle[0], offset[1] - self.extent.middle[1]];
            self.bbox = shifted(&self.bbox, error);
            for (velocity, error) in self.velocity.iter_mut().zip(error) {
                *velocity += 0.5 * error;
            }
            self.extent.cells = extent.cells;
        }
    }

    /// Continues the track with a detection in this frame.
    pub(super) fn associate(&mut self, detection: &Detection) {
        let (from, to) = (center(&self.bbox), center(&detection.bbox));
        // The box was already moved by the old velocity: what remains is the prediction error, half of which corrects the velocity.
        for axis in 0..2 {
            self.velocity[axis] += 0.5 * (to[axis] - from[axis]) / self.misses.max(1) as f32;
        }
        self.bbox = detection.bbox;
        self.score = detection.score;
        self.best_score = self.best_score.max(detection.score);
        self.misses = 0;
        self.depth_age = 0;
        self.missed_searches = 0;
        self.is_unknown = false;
    }
}

/// Returns the centre of a box, px.
pub(super) fn center(b: &BoundingBox) -> [f32; 2] {
    [0.5 * (b.x_min + b.x_max), 0.5 * (b.y_min + b.y_max)]
}

/// Returns a box moved by an offset, px.
fn shifted(b: &BoundingBox, [dx, dy]: [f32; 2]) -> BoundingBox {
    BoundingBox { x_min: b.x_min + dx, y_min: b.y_min + dy, x_max: b.x_max + dx, y_max: b.y_max + dy }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a track with a detection of that score after frames in which this share of its features was found.
    fn track_after(score: f32, shares: &[f32]) -> Track {
        let config = DynamicConfig::default();
        let mut track = Track::open(&Detection { class: 0, score, bbox: BoundingBox::default() });
        shares.iter().for_each(|share| track.add_evidence(&config.full, *share, 0.4));
        track
    }

    #[test]
    fn what_stands_still_is_trusted_until_it_moves() {
        assert!(!track_after(0.5, &[]).stands_still(), "at first, a box is believed");
        assert!(track_after(0.5, &[1.0; 3]).stands_still());
        assert!(track_after(0.5, &[1.0; 30]).static_probability() > 0.9);
        let moves = track_after(0.5, &[&[1.0; 30][..], &[0.1]].concat());
        assert!(!moves.stands_still() && moves.is_proven(), "at once");
    }

    #[test]
    fn the_surer_the_detector_the_less_a_still_object_is_trusted() {
        let trust = |score| track_after(score, &[1.0; 30]).static_probability();
        assert!(trust(0.3) > trust(0.9) && trust(0.9) > 0.5 && !track_after(1.0, &[1.0; 30]).stands_still());
    }

    #[test]
    fn a_background_that_leaves_its_place_while_the_object_does_not_shows_that_the_pose_follows_the_object() {
        assert!(track_after(0.5, &[4.0]).is_proven());
        assert!(!track_after(0.5, &[0.45; 30]).stands_still(), "in between, nothing is known");
    }
}

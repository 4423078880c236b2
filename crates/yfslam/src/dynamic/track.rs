//! The track of one movable object: its box, depth and extent over frames.
//!
//! In: detections, and the segmented instance of the track. Out: the state of the track, and its region in the image.

use crate::config::DynamicConfig;
use crate::detect::{BoundingBox, Detection};
use crate::dynamic::Region;
use crate::dynamic::segment::mask::Extent;

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
    /// Whether landmarks have shown that its box is false. That holds as long as almost the same box is detected.
    pub refuted: bool,
    /// Frames since its last detection in which the detector processed the image.
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
            refuted: false,
        }
    }

    /// Moves the box by the velocity, for a frame without a detection so far.
    pub(super) fn predict(&mut self) {
        self.misses += 1;
        self.depth_age += 1;
        self.bbox = shifted(&self.bbox, self.velocity);
    }

    /// Returns whether its instance is to be segmented.
    pub(crate) fn is_active(&self) -> bool {
        !self.ended && !self.refuted
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
        self.misses = 0;
        self.depth_age = 0;
        self.missed_searches = 0;
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

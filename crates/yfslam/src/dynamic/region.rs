//! Parts of the image that move, as boxes with depths, and the features on them.

use crate::config::DynamicConfig;
use crate::context::SensorModel;
use crate::detect::BoundingBox;
use crate::dynamic::segment::mask::InstanceMask;
use crate::features::FrameFeatures;
use crate::image::DepthImage;

/// A part of the image that was found to move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// Where it is, px of the raw image.
    pub bbox: BoundingBox,
    /// Confidence of the detection it rests on.
    pub score: f32,
    /// Frames since that detection; 0 if it is of this frame.
    pub misses: usize,
    /// Depths of the moving body, m; `None` if the whole box moves.
    pub depth_m: Option<[f32; 2]>,
}

/// What moves in a frame, pixel by pixel.
#[derive(Clone, Debug, Default)]
pub struct MovingMask {
    /// Segmenter.
    pub(super) bodies: InstanceMask,
    /// Boxes, whole or at the depth of a body.
    pub(super) regions: Vec<Region>,
}

impl MovingMask {
    /// Returns the mask of regions, each whole or at the depth of its body.
    pub fn from_regions(regions: Vec<Region>) -> Self {
        Self { regions, ..Self::default() }
    }

    /// Whether a position of the raw image, px, shows something that moves, or lies within `edge_px` of it.
    pub fn covers(&self, depth: &DepthImage, raw: [f32; 2], edge_px: f32) -> bool {
        self.bodies.covers(raw, edge_px) || self.regions.iter().any(|region| region.covers(depth, raw, edge_px))
    }
}

/// Distrusts the features of all regions. If that leaves too few, the regions of least confidence are given up one by one: a false box
/// must not take the ground from under tracking. Those go to `given_up`.
pub(super) fn apply(
    config: &DynamicConfig,
    regions: &mut Vec<Region>,
    given_up: &mut Vec<Region>,
    depth: &DepthImage,
    features: &mut FrameFeatures,
    sensor: &SensorModel,
) {
    given_up.clear();
    regions.sort_by(|a, b| b.score.total_cmp(&a.score));
    loop {
        let mut trusted = 0;
        for f in &mut features.features {
            let moving = regions.iter().any(|r| r.covers(depth, f.raw, config.edge_px * sensor.scale(f.octave)));
            f.trust = if moving { 0.0 } else { 1.0 };
            trusted += usize::from(!moving);
        }
        if trusted >= config.min_trusted.min(features.len()) {
            return;
        }
        let Some(region) = regions.pop() else { return };
        given_up.push(region);
    }
}

impl Region {
    /// Whether a feature at a raw position belongs to the moving body: inside the box, at the body's depth or without depth, or with the
    /// body within `edge_px` of it.
    pub fn covers(&self, depth: &DepthImage, raw: [f32; 2], edge_px: f32) -> bool {
        let [x, y] = raw;
        if !self.bbox.contains(x, y) {
            return false;
        }
        let Some([near, far]) = self.depth_m else { return true };
        let at = |dx: f32, dy: f32| depth.metres((x + dx + 0.5).max(0.0) as usize, (y + dy + 0.5).max(0.0) as usize);
        let moves = |z: f32| z >= near && z <= far;
        if at(0.0, 0.0).is_none_or(moves) {
            return true;
        }
        // A corner on the outline belongs to neither side: its descriptor sees both.
        let (r, h) = (edge_px, edge_px * std::f32::consts::FRAC_1_SQRT_2);
        [(r, 0.0), (-r, 0.0), (0.0, r), (0.0, -r), (h, h), (h, -h), (-h, h), (-h, -h)]
            .iter()
            .any(|&(dx, dy)| at(dx, dy).is_some_and(moves))
    }
}

//! Regions of the image that move, as bounding boxes with a depth interval.
//!
//! In: regions, the depth image, the features of a frame. Out: the trust of the features, and the mask of what moves for the dense
//! map.

use crate::config::DynamicConfig;
use crate::context::SensorModel;
use crate::detect::BoundingBox;
use crate::dynamic::segment::mask::InstanceMask;
use crate::features::FrameFeatures;
use crate::image::DepthImage;

/// A region of the image that moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// Bounding box, px of the raw image.
    pub bbox: BoundingBox,
    /// Score of the detection that it comes from, in [0, 1].
    pub score: f32,
    /// Frames since that detection; 0 if the detection is of this frame.
    pub misses: usize,
    /// Depth interval of the moving object, m; `None` if everything in the box moves.
    pub depth_m: Option<[f32; 2]>,
}

/// The pixels of a frame that move.
#[derive(Clone, Debug, Default)]
pub struct MovingMask {
    /// Mask of the segmented instances.
    pub(super) instances: InstanceMask,
    /// Boxes that move as a whole or within a depth interval.
    pub(super) regions: Vec<Region>,
}

impl MovingMask {
    /// Returns the mask of these regions.
    pub(crate) fn from_regions(regions: Vec<Region>) -> Self {
        Self { regions, ..Self::default() }
    }

    /// Returns whether a position, px of the raw image, lies on something that moves or within `edge_px` of it; `depth` is the
    /// depth image of the frame, px.
    pub(crate) fn covers(&self, depth: &DepthImage, raw: [f32; 2], edge_px: f32) -> bool {
        self.instances.covers(raw, edge_px) || self.regions.iter().any(|region| region.covers(depth, raw, edge_px))
    }
}

/// Sets the trust of each feature: 0 in a moving region, else 1. If fewer than `config.min_trusted` features remain, the regions of
/// the lowest score are moved to `given_up` one by one: a false detection must not make tracking fail.
pub(super) fn apply_regions(
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
    /// Returns whether a feature at a position, px of the raw image, belongs to the moving object: it lies inside the box, and
    /// within the depth interval, without a measured depth, or within `edge_px` of the object.
    pub(crate) fn covers(&self, depth: &DepthImage, raw: [f32; 2], edge_px: f32) -> bool {
        let [x, y] = raw;
        if !self.bbox.contains(x, y) {
            return false;
        }
        let Some([near, far]) = self.depth_m else { return true };
        let depth_at =
            |dx: f32, dy: f32| depth.metres((x + dx + 0.5).max(0.0) as usize, (y + dy + 0.5).max(0.0) as usize);
        let in_interval = |z: f32| z >= near && z <= far;
        if depth_at(0.0, 0.0).is_none_or(in_interval) {
            return true;
        }
        // The descriptor of a corner at the edge of the object covers object and background: it is not static.
        let (r, h) = (edge_px, edge_px * std::f32::consts::FRAC_1_SQRT_2);
        [(r, 0.0), (-r, 0.0), (0.0, r), (0.0, -r), (h, h), (h, -h), (-h, h), (-h, -h)]
            .iter()
            .any(|&(dx, dy)| depth_at(dx, dy).is_some_and(in_interval))
    }
}

//! Which features may be trusted to be static (YF-SLAM, section 3.3).
//!
//! In: boxes of movable objects, the depth image, the frame's features. Out: each feature's trust. Nothing else in the core knows that
//! people exist.

mod body_mask;
mod boxes;
pub mod depth_group;
mod full;
mod tracks;
mod views;
mod yf;

use serde::{Deserialize, Serialize};

use crate::config::DynamicConfig;
use crate::detection::{BoundingBox, Detection};
use crate::features::FrameFeatures;
use crate::geometry::Pose;
use crate::image::{DepthImage, Image};
use crate::map::{KeyFrameId, Map};
use crate::sensor::SensorModel;
use body_mask::BodyMask;
use full::Full;
use tracks::Tracks;

/// How moving things are kept out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Every feature is trusted, as in ORB-SLAM2.
    None,
    /// Every feature inside a box is dropped.
    Boxes,
    /// YF-SLAM: inside a box, the depth group of the body is dropped and the background stays.
    #[default]
    Yf,
    /// Outlines of bodies in depth, and whatever has moved since earlier views.
    Full,
}

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

/// What is known of a frame before its pose.
pub struct Evidence<'a> {
    /// Boxes of movable objects, at any score.
    pub movable: &'a [Detection],
    /// Pixels of movable objects, where somebody knows them.
    pub mask: Option<&'a Image<u8>>,
    /// The depth image.
    pub depth: &'a DepthImage,
    /// Scales of the pyramid's levels.
    pub scale_factors: &'a [f32],
}

/// A first pose, and what it can be compared with.
pub struct FirstPose<'a> {
    /// The camera.
    pub sensor: &'a SensorModel,
    /// The map.
    pub map: &'a Map,
    /// The pose of the frame.
    pub t_cam_world: &'a Pose,
}

/// A keyframe and the pose of a frame seen from there, `t_cam_reference`: it moves along when the map is corrected.
pub type Tie = (KeyFrameId, Pose);

/// What moves in a frame, pixel by pixel.
#[derive(Clone, Debug, Default)]
pub struct MovingMask {
    bodies: BodyMask,
    regions: Vec<Region>,
}

impl MovingMask {
    /// Whether a position of the raw image, px, shows something that moves, or lies within `edge_px` of it.
    pub fn covers(&self, depth: &DepthImage, raw: [f32; 2], edge_px: f32) -> bool {
        self.bodies.covers(raw, edge_px) || self.regions.iter().any(|region| region.covers(depth, raw, edge_px))
    }
}

/// Decides about the features of one frame after another.
#[derive(Clone, Debug, Default)]
pub struct DynamicFilter {
    tracks: Tracks,
    regions: Vec<Region>,
    /// Regions whose features are needed, though they move.
    given_up: Vec<Region>,
    groups: yf::DepthGroups,
    full: Full,
}

impl DynamicFilter {
    /// A filter whose random draws start from `seed`.
    pub fn new(seed: u64) -> Self {
        Self { groups: yf::DepthGroups::new(seed), ..Self::default() }
    }

    /// Sets the trust of `features` from what boxes, masks and depth tell, before the pose is known.
    pub fn before_pose(&mut self, config: &DynamicConfig, evidence: &Evidence<'_>, features: &mut FrameFeatures) {
        self.regions.clear();
        self.given_up.clear();
        let &Evidence { movable, depth, scale_factors, .. } = evidence;
        let size = [depth.raw.width(), depth.raw.height()];
        match config.method {
            Method::None => return,
            Method::Boxes => self.regions.extend(boxes::regions(config, movable)),
            Method::Yf => {
                let depths = self.groups.depths_of(config, movable, depth, features);
                self.tracks.update(config, config.max_misses, movable, depths, size);
                self.groups.regions(config, &mut self.tracks, depth, features, &mut self.regions);
            }
            Method::Full => {
                let depths = self.groups.depths_of(config, movable, depth, features);
                self.tracks.update(config, config.full.max_misses, movable, depths, size);
                let Self { full, groups, tracks, regions, .. } = self;
                full.before_pose(config, groups, tracks, evidence, features, regions);
                return;
            }
        }
        apply(config, &mut self.regions, &mut self.given_up, depth, features, scale_factors);
    }

    /// Sharpens the trust of `features` when a first pose stands. Returns whether that changed.
    pub fn after_pose(&mut self, config: &DynamicConfig, first: &FirstPose<'_>, features: &mut FrameFeatures) -> bool {
        config.method == Method::Full && self.full.after_pose(config, first, features)
    }

    /// Takes note of the pose of the frame.
    pub fn end_frame(&mut self, config: &DynamicConfig, timestamp_ns: i64, tie: Option<Tie>) {
        if let (Method::Full, Some(tie)) = (config.method, tie) {
            self.full.keep_view(config, timestamp_ns, tie);
        }
    }

    /// The parts of the last frame that were found to move.
    pub fn regions(&self) -> &[Region] {
        &self.regions
    }

    /// What moves in the last frame, whose depth image is given, pixel by pixel: more than features need, for whoever maps surfaces. What
    /// was given up for want of features counts, and bodies are outlined whatever the method.
    pub fn moving_mask(&self, config: &DynamicConfig, depth: &DepthImage) -> MovingMask {
        let bodies = match config.method {
            Method::None | Method::Boxes => BodyMask::default(),
            Method::Yf => Full::outlines(config, &mut self.groups.clone(), &mut self.tracks.clone(), depth),
            Method::Full => self.full.bodies().clone(),
        };
        let regions = match config.method {
            Method::Full => Vec::new(),
            _ => self.regions.iter().chain(&self.given_up).copied().collect(),
        };
        MovingMask { bodies, regions }
    }

    /// Forgets earlier views: the world begins anew.
    pub fn forget_views(&mut self) {
        self.full.forget_views();
    }
}

/// Distrusts the features of all regions. If that leaves too few, the regions of least confidence are given up one by one: a false box
/// must not take the ground from under tracking.
fn apply(
    config: &DynamicConfig,
    regions: &mut Vec<Region>,
    given_up: &mut Vec<Region>,
    depth: &DepthImage,
    features: &mut FrameFeatures,
    scale_factors: &[f32],
) {
    regions.sort_by(|a, b| b.score.total_cmp(&a.score));
    loop {
        let mut trusted = 0;
        for f in &mut features.features {
            let scale = scale_factors.get(usize::from(f.octave)).copied().unwrap_or(1.0);
            let moving = regions.iter().any(|r| r.covers(depth, f.raw, config.edge_px * scale));
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
    fn covers(&self, depth: &DepthImage, raw: [f32; 2], edge_px: f32) -> bool {
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

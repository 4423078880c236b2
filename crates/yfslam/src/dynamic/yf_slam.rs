//! Method `yf`: inside a box, what has the depth of the body is dropped and the background stays (YF-SLAM section 3.3).
//!
//! In: boxes, the depth image, the frame's features. Out: for each track, the depths that move.

use crate::config::DynamicConfig;
use crate::detect::BoundingBox;
use crate::dynamic::region::apply;
use crate::dynamic::segment::depth_clusters::DepthClusters;
use crate::dynamic::segment::segmenter::Segmenter;
use crate::dynamic::tracks::Tracks;
use crate::dynamic::{DynamicFilter, FilterInput, MovingMask, Region};
use crate::features::FrameFeatures;
use crate::image::DepthImage;

/// Follows boxes over time and cuts bodies out of them by depth.
#[derive(Clone, Debug)]
pub(super) struct YfSlam {
    tracks: Tracks,
    groups: DepthClusters,
    regions: Vec<Region>,
    /// Regions whose features are needed, though they move.
    given_up: Vec<Region>,
}

impl YfSlam {
    /// Draws start from `seed`.
    pub(super) fn new(seed: u64) -> Self {
        Self { tracks: Tracks::default(), groups: DepthClusters::new(seed), regions: Vec::new(), given_up: Vec::new() }
    }

    /// Notes the moving region of each track, and the body's depth in the track. A track that was missed and shows no body at its depth
    /// any more is dropped.
    fn cut_out(&mut self, config: &DynamicConfig, depth: &DepthImage, features: &FrameFeatures) {
        let Self { tracks, groups, regions, .. } = self;
        tracks.list.retain_mut(|track| {
            let Some(center_m) = groups.body_of(config, track, depth, features) else {
                // No valid depth: whatever is in a box that was just detected moves; an old box is given up.
                if track.misses == 0 {
                    regions.push(Region { bbox: track.bbox, score: track.score, misses: 0, depth_m: None });
                }
                return track.misses == 0;
            };
            track.depth_m = Some(center_m);
            regions.push(Region {
                bbox: grown(&track.bbox, config.box_margin_share),
                score: track.score,
                misses: track.misses,
                depth_m: Some([
                    center_m - config.group_half_width_m - config.limb_reach_m,
                    center_m + config.group_half_width_m,
                ]),
            });
            true
        });
    }
}

impl DynamicFilter for YfSlam {
    fn before_pose(&mut self, config: &DynamicConfig, input: &FilterInput<'_>, features: &mut FrameFeatures) {
        let &FilterInput { movable, depth, sensor, .. } = input;
        self.regions.clear();
        let depths = self.groups.depths_of(config, movable, depth, features);
        self.tracks.update(config, config.max_misses, movable, depths, [depth.raw.width(), depth.raw.height()]);
        self.cut_out(config, depth, features);
        apply(config, &mut self.regions, &mut self.given_up, depth, features, sensor);
    }

    fn regions(&self) -> &[Region] {
        &self.regions
    }

    fn moving_mask(&self, config: &DynamicConfig, depth: &DepthImage) -> MovingMask {
        let mut segmenter = Segmenter::default();
        segmenter.bodies.begin(depth);
        segmenter.outline(config, &mut self.groups.clone(), &mut self.tracks.clone(), 0.0);
        let regions = self.regions.iter().chain(&self.given_up).copied().collect();
        MovingMask { bodies: segmenter.bodies, regions }
    }
}

/// The box with its sides moved out by `share` of its size.
fn grown(b: &BoundingBox, share: f32) -> BoundingBox {
    let (dx, dy) = (share * (b.x_max - b.x_min), share * (b.y_max - b.y_min));
    BoundingBox { x_min: b.x_min - dx, y_min: b.y_min - dy, x_max: b.x_max + dx, y_max: b.y_max + dy }
}

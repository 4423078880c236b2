//! Method `yf`: inside a bounding box, the depth group of the person is excluded and the background is kept (YF-SLAM, section 3.3).
//!
//! In: detections, the depth image, the features of the frame. Out: the trust of each feature; for each track, the depth interval
//! that moves.

use crate::config::DynamicConfig;
use crate::detect::BoundingBox;
use crate::dynamic::region::apply_regions;
use crate::dynamic::segment::depth_clusters::DepthClusters;
use crate::dynamic::segment::segmenter::Segmenter;
use crate::dynamic::tracks::Tracks;
use crate::dynamic::{DynamicFilter, FilterInput, MovingMask, Region};
use crate::features::FrameFeatures;
use crate::image::DepthImage;

/// The filter of YF-SLAM: tracks bounding boxes and excludes the depth group of the person in each.
#[derive(Clone, Debug)]
pub(super) struct YfSlam {
    tracks: Tracks,
    clusters: DepthClusters,
    regions: Vec<Region>,
    /// Regions whose features are trusted all the same, because too few others remained.
    given_up: Vec<Region>,
}

impl YfSlam {
    /// Returns a filter whose random draws start from `seed`.
    pub(super) fn new(seed: u64) -> Self {
        Self {
            tracks: Tracks::default(),
            clusters: DepthClusters::new(seed),
            regions: Vec::new(),
            given_up: Vec::new(),
        }
    }

    /// Computes the moving region of each track and stores the depth of the person in the track. A track without a detection in
    /// this frame ends if no depth group is found at its depth.
    fn update_regions(&mut self, config: &DynamicConfig, depth: &DepthImage, features: &FrameFeatures) {
        let Self { tracks, clusters, regions, .. } = self;
        tracks.list.retain_mut(|track| {
            let Some(center_m) = clusters.track_depth(config, track, depth, features) else {
                // Without valid depth everything in a detected box is taken to move; a track without a detection ends.
                if track.misses == 0 {
                    regions.push(Region { bbox: track.bbox, score: track.score, misses: 0, depth_m: None });
                }
                return track.misses == 0;
            };
            track.depth_m = Some(center_m);
            regions.push(Region {
                bbox: grow(&track.bbox, config.box_margin_share),
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
        let depths = self.clusters.depths_in_boxes(config, movable, depth, features);
        self.tracks.update(config, config.max_misses, movable, depths, [depth.raw.width(), depth.raw.height()]);
        self.update_regions(config, depth, features);
        apply_regions(config, &mut self.regions, &mut self.given_up, depth, features, sensor);
    }

    fn regions(&self) -> &[Region] {
        &self.regions
    }

    fn moving_mask(&self, config: &DynamicConfig, depth: &DepthImage) -> MovingMask {
        let mut segmenter = Segmenter::default();
        segmenter.instances.begin_frame(depth);
        segmenter.segment(config, &mut self.clusters.clone(), &mut self.tracks.clone(), 0.0);
        let regions = self.regions.iter().chain(&self.given_up).copied().collect();
        MovingMask { instances: segmenter.instances, regions }
    }
}

/// Returns the box grown on each side by `share` of its size.
fn grow(b: &BoundingBox, share: f32) -> BoundingBox {
    let (dx, dy) = (share * (b.x_max - b.x_min), share * (b.y_max - b.y_min));
    BoundingBox { x_min: b.x_min - dx, y_min: b.y_min - dy, x_max: b.x_max + dx, y_max: b.y_max + dy }
}

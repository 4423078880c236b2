//! Method `ds`: the moving consistency check of DS-SLAM (Yu et al., IROS 2018, section III-C).
//!
//! In: consecutive images, detections or a mask of people. Out: while a corner that violates the epipolar geometry lies on a
//! person, the features on all people are excluded; else none are. People are segmented from boxes and depth, where the paper has a
//! segmentation network; the tracked corners are those of the last frame's features. As in the paper, people are not tracked over
//! frames without detections.

use rand_pcg::Pcg32;

use crate::camera::Camera;
use crate::config::DynamicConfig;
use crate::dynamic::segment::depth_clusters::DepthClusters;
use crate::dynamic::segment::mask::InstanceMask;
use crate::dynamic::segment::segmenter::Segmenter;
use crate::dynamic::tracks::Tracks;
use crate::dynamic::{DynamicFilter, FilterInput, MovingMask, Region};
use crate::features::FrameFeatures;
use crate::geometry::{Pair, epipolar_distance, fundamental_ransac};
use crate::image::{DepthImage, Flow};

/// Number of corners that are tracked at most. Source of this and the following constants: DS-SLAM.
const MAX_CORNERS: usize = 1000;
/// Distance from the image border below which a corner is dropped, px.
const BORDER_PX: f32 = 5.0;
/// Sum of absolute differences of 3 × 3 px above which a corner is dropped.
const MAX_DIFFERENCE: f32 = 2120.0;
/// Distance from the epipolar line up to which a pair is an inlier of a fundamental matrix, px.
const RANSAC_LIMIT_PX: f64 = 0.1;
/// Confidence of the RANSAC for that matrix.
const CONFIDENCE: f64 = 0.99;
/// Distance from the epipolar line above which a corner moves, px.
const MOVING_PX: f64 = 1.0;
/// Distance from a person up to which a moving corner counts as evidence that the person moves, px.
const REACH_PX: f32 = 15.0;

/// The filter that excludes people while a corner on one of them moves. Buffers are reused.
#[derive(Clone, Debug)]
pub(crate) struct DsSlam {
    flow: Flow,
    /// Positions of the last frame's features, px of the raw image.
    corners: Vec<[f32; 2]>,
    /// Undistorted positions of tracked corners in the last frame and in this one, px.
    pairs: Vec<Pair>,
    /// Positions of the same corners in this frame, px of the raw image.
    positions_raw: Vec<[f32; 2]>,
    tracks: Tracks,
    clusters: DepthClusters,
    segmenter: Segmenter,
    rng: Pcg32,
    regions: Vec<Region>,
    /// Whether a person moves in this frame.
    people_move: bool,
}

impl DsSlam {
    /// Returns a filter whose random draws start from `seed`.
    pub(crate) fn new(seed: u64) -> Self {
        Self {
            flow: Flow::default(),
            corners: Vec::new(),
            pairs: Vec::new(),
            positions_raw: Vec::new(),
            tracks: Tracks::default(),
            clusters: DepthClusters::new(seed),
            segmenter: Segmenter::default(),
            rng: Pcg32::new(seed, 0xd5),
            regions: Vec::new(),
            people_move: false,
        }
    }

    /// Tracks the corners of the last frame into this one.
    fn track_corners(&mut self, camera: &Camera) {
        let limit = [camera.width as f32 - BORDER_PX, camera.height as f32 - BORDER_PX];
        let undistorted = |[x, y]: [f32; 2]| camera.undistort_px(f64::from(x), f64::from(y)).map(|v| v as f32);
        self.pairs.clear();
        self.positions_raw.clear();
        for &from in &self.corners {
            let Some(to) = self.flow.follow(from) else { continue };
            let inside = (0..2).all(|axis| to[axis] >= BORDER_PX && to[axis] < limit[axis]);
            if inside && self.flow.difference(from, to).is_some_and(|d| d <= MAX_DIFFERENCE) {
                self.pairs.push((undistorted(from), undistorted(to)));
                self.positions_raw.push(to);
            }
        }
    }

    /// Returns whether a corner that moves lies on or near a person.
    fn is_person_moving(&mut self) -> bool {
        let Some(f) = fundamental_ransac(&self.pairs, RANSAC_LIMIT_PX, CONFIDENCE, &mut self.rng) else { return false };
        let moving =
            self.pairs.iter().zip(&self.positions_raw).filter(|(pair, _)| epipolar_distance(&f, pair) > MOVING_PX);
        moving.map(|(_, raw)| *raw).any(|raw| self.segmenter.instances.covers(raw, REACH_PX))
    }
}

impl DynamicFilter for DsSlam {
    fn before_pose(&mut self, config: &DynamicConfig, input: &FilterInput<'_>, features: &mut FrameFeatures) {
        let &FilterInput { movable, depth, sensor, .. } = input;
        self.flow.push(input.gray);
        self.track_corners(&sensor.camera);
        self.tracks.list.clear();
        let depths = self.clusters.depths_in_boxes(config, movable, depth, features);
        self.tracks.update(config, 0, movable, depths, [depth.raw.width(), depth.raw.height()]);
        self.segmenter.begin_frame(input);
        self.segmenter.segment(config, &mut self.clusters, &mut self.tracks, 0.0);
        self.people_move = self.is_person_moving();
        self.regions.clear();
        if self.people_move {
            self.segmenter.set_trust(0.0, sensor, features);
            self.regions.extend(self.tracks.list.iter().map(|track| track.region(config)));
        }
        self.corners.clear();
        self.corners.extend(features.features.iter().map(|f| f.raw).take(MAX_CORNERS));
    }

    fn regions(&self) -> &[Region] {
        &self.regions
    }

    fn moving_mask(&self, _config: &DynamicConfig, _depth: &DepthImage) -> MovingMask {
        let instances = if self.people_move { self.segmenter.instances.clone() } else { InstanceMask::default() };
        MovingMask { instances, ..MovingMask::default() }
    }
}

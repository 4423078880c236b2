//! Method `ds`: the moving-consistency check of DS-SLAM (Yu et al., IROS 2018, section III-C).
//!
//! In: pictures in a row, boxes or a mask of people. Out: while anything that moves against the epipolar geometry lies on a person, all
//! people are dropped; else nobody is. Bodies come from boxes and depth, where the paper has a segmentation network; the corners that are
//! followed are those of the last frame's features. Nothing is carried over frames without boxes, as in the paper.

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

/// Corners that are followed at most. This and what follows: DS-SLAM.
const MAX_CORNERS: usize = 1000;
/// A corner that comes nearer to the border is given up, px.
const BORDER_PX: f32 = 5.0;
/// Sum of absolute differences of 3 × 3 px above which a corner is given up.
const MAX_DIFFERENCE: f32 = 2120.0;
/// Distance from its epipolar line up to which a pair fits a fundamental matrix, px.
const RANSAC_LIMIT_PX: f64 = 0.1;
/// Confidence of the search for that matrix.
const CONFIDENCE: f64 = 0.99;
/// Distance from its epipolar line above which a corner moves, px.
const MOVING_PX: f64 = 1.0;
/// Distance from a person within which a moving corner speaks for the person's moving, px.
const REACH_PX: f32 = 15.0;

/// Drops people while something on them moves. Buffers are reused.
#[derive(Clone, Debug)]
pub(crate) struct DsSlam {
    flow: Flow,
    /// Where the last frame has features, px.
    corners: Vec<[f32; 2]>,
    /// Where they lie in the last frame and in this one, undistorted; beside it, where in the raw image.
    pairs: Vec<Pair>,
    raw: Vec<[f32; 2]>,
    tracks: Tracks,
    groups: DepthClusters,
    segmenter: Segmenter,
    rng: Pcg32,
    regions: Vec<Region>,
    /// Whether people are dropped.
    dropped: bool,
}

impl DsSlam {
    /// Draws start from `seed`.
    pub(crate) fn new(seed: u64) -> Self {
        Self {
            flow: Flow::default(),
            corners: Vec::new(),
            pairs: Vec::new(),
            raw: Vec::new(),
            tracks: Tracks::default(),
            groups: DepthClusters::new(seed),
            segmenter: Segmenter::default(),
            rng: Pcg32::new(seed, 0xd5),
            regions: Vec::new(),
            dropped: false,
        }
    }

    /// Follows the corners of the last frame into this one.
    fn follow(&mut self, camera: &Camera) {
        let limit = [camera.width as f32 - BORDER_PX, camera.height as f32 - BORDER_PX];
        let undistorted = |[x, y]: [f32; 2]| camera.undistort_px(f64::from(x), f64::from(y)).map(|v| v as f32);
        self.pairs.clear();
        self.raw.clear();
        for &from in &self.corners {
            let Some(to) = self.flow.follow(from) else { continue };
            let inside = (0..2).all(|axis| to[axis] >= BORDER_PX && to[axis] < limit[axis]);
            if inside && self.flow.difference(from, to).is_some_and(|d| d <= MAX_DIFFERENCE) {
                self.pairs.push((undistorted(from), undistorted(to)));
                self.raw.push(to);
            }
        }
    }

    /// Whether a corner that moves lies on a body or near one.
    fn somebody_moves(&mut self) -> bool {
        let Some(f) = fundamental_ransac(&self.pairs, RANSAC_LIMIT_PX, CONFIDENCE, &mut self.rng) else { return false };
        let moving = self.pairs.iter().zip(&self.raw).filter(|(pair, _)| epipolar_distance(&f, pair) > MOVING_PX);
        moving.map(|(_, raw)| *raw).any(|raw| self.segmenter.bodies.covers(raw, REACH_PX))
    }
}

impl DynamicFilter for DsSlam {
    fn before_pose(&mut self, config: &DynamicConfig, input: &FilterInput<'_>, features: &mut FrameFeatures) {
        let &FilterInput { movable, depth, sensor, .. } = input;
        self.flow.push(input.gray);
        self.follow(&sensor.camera);
        self.tracks.list.clear();
        let depths = self.groups.depths_of(config, movable, depth, features);
        self.tracks.update(config, 0, movable, depths, [depth.raw.width(), depth.raw.height()]);
        self.segmenter.begin(input);
        self.segmenter.outline(config, &mut self.groups, &mut self.tracks, 0.0);
        self.dropped = self.somebody_moves();
        self.regions.clear();
        if self.dropped {
            self.segmenter.distrust(0.0, sensor, features);
            self.regions.extend(self.tracks.list.iter().map(|track| track.region(config)));
        }
        self.corners.clear();
        self.corners.extend(features.features.iter().map(|f| f.raw).take(MAX_CORNERS));
    }

    fn regions(&self) -> &[Region] {
        &self.regions
    }

    fn moving_mask(&self, _config: &DynamicConfig, _depth: &DepthImage) -> MovingMask {
        let bodies = if self.dropped { self.segmenter.bodies.clone() } else { InstanceMask::default() };
        MovingMask { bodies, ..MovingMask::default() }
    }
}

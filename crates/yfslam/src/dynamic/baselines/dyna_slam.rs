//! Method `dyna`: the multi-view geometry of DynaSLAM (Bescos et al., IEEE RA-L 2018, section III-C).
//!
//! In: boxes or a mask of people, then a first pose and the map's keyframes. Out: people are dropped, and whatever is nearer than points
//! of earlier keyframes that should be seen there. Bodies come from boxes and depth, where the paper has a segmentation network.

use crate::config::DynamicConfig;
use crate::dynamic::segment::depth_clusters::DepthClusters;
use crate::dynamic::segment::segmenter::Segmenter;
use crate::dynamic::tracks::Tracks;
use crate::dynamic::{DynamicFilter, FilterInput, FirstPose, MovingMask, Region};
use crate::features::FrameFeatures;
use crate::geometry::Pose;
use crate::image::DepthImage;
use crate::map::{KeyFrame, KeyFrameId};

/// Distance from a body within which features are dropped, px. This and what follows: DynaSLAM.
const EDGE_PX: f32 = 15.0;
/// Latest keyframes that are considered.
const KEYFRAMES: usize = 20;
/// Keyframes from which the comparison is made.
const MIN_KEYFRAMES: usize = 5;
/// Keyframes that are compared: the farthest.
const REFERENCES: usize = 5;
/// Weights of distance and direction in what is far.
const FAR: [f64; 2] = [0.7, 0.3];
/// Depth up to which a keyframe's points are taken, m, and depth up to which they are compared.
const MAX_DEPTH_M: [f64; 2] = [6.0, 7.0];
/// Angle between the two rays to a point up to which it is compared, degrees.
const MAX_PARALLAX_DEG: f64 = 30.0;
/// Half the side of the patch in which the least difference is sought, px.
const PATCH_PX: f32 = 20.0;
/// Variance of the patch's depth up to which it tells, m².
const MAX_VARIANCE_M2: f32 = 0.001;
/// Difference from the expected depth that only something else explains, m. The paper's τ_z.
const MIN_STEP_M: f32 = 0.4;
/// Difference from the mean of a region up to which a neighbour belongs to it, m.
const REGION_STEP_M: f32 = 0.2;

/// Drops people, and what stands where keyframes saw farther. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub(crate) struct DynaSlam {
    tracks: Tracks,
    groups: DepthClusters,
    segmenter: Segmenter,
    regions: Vec<Region>,
    /// Keyframes by age, and how far each is: metres, radians.
    latest: Vec<(u64, KeyFrameId, [f64; 2])>,
}

impl DynaSlam {
    /// Draws start from `seed`.
    pub(crate) fn new(seed: u64) -> Self {
        Self { groups: DepthClusters::new(seed), ..Self::default() }
    }

    /// Chooses the keyframes to compare with: of the latest, the farthest.
    fn choose(&mut self, first: &FirstPose<'_>) {
        self.latest.clear();
        self.latest.extend(first.map.keyframes().map(|(id, keyframe)| {
            let motion: Pose = first.t_cam_world * keyframe.t_cam_world.inverse();
            (keyframe.sequence, id, [motion.translation.vector.norm(), motion.rotation.angle()])
        }));
        self.latest.sort_unstable_by_key(|(sequence, ..)| std::cmp::Reverse(*sequence));
        self.latest.truncate(KEYFRAMES);
        if self.latest.len() < MIN_KEYFRAMES {
            self.latest.clear();
        }
        let largest = [0, 1].map(|k| self.latest.iter().map(|(_, _, far)| far[k]).fold(1e-9, f64::max));
        let score = |far: &[f64; 2]| FAR[0] * far[0] / largest[0] + FAR[1] * far[1] / largest[1];
        self.latest.sort_by(|a, b| score(&b.2).total_cmp(&score(&a.2)).then(b.0.cmp(&a.0)));
        self.latest.truncate(REFERENCES);
    }

    /// Marks what is nearer than the points of a keyframe allow. Returns whether there is anything.
    fn compare(&mut self, first: &FirstPose<'_>, keyframe: &KeyFrame) -> bool {
        let (camera, pinhole) = (&first.sensor.camera, &first.sensor.pinhole);
        let t_cam_keyframe = first.t_cam_world * keyframe.t_cam_world.inverse();
        let centre = t_cam_keyframe.translation.vector;
        let mut found = false;
        for feature in keyframe.features.features.iter().filter(|f| f.trust > 0.0) {
            let Some(z) = feature.depth_m.map(f64::from).filter(|z| *z < MAX_DEPTH_M[0]) else { continue };
            let p = (t_cam_keyframe * pinhole.unproject(f64::from(feature.u), f64::from(feature.v), z)).coords;
            if p.z <= 0.0 || p.z >= MAX_DEPTH_M[1] || p.angle(&(p - centre)) >= MAX_PARALLAX_DEG.to_radians() {
                continue;
            }
            let [x, y] = camera.distort(p.x / p.z, p.y / p.z).map(|v| v as f32);
            let inside = x > PATCH_PX
                && y > PATCH_PX
                && x < camera.width as f32 - PATCH_PX
                && y < camera.height as f32 - PATCH_PX;
            if !inside {
                continue;
            }
            let bodies = &mut self.segmenter.bodies;
            let Some((step_m, variance)) = bodies.step_behind([x, y], PATCH_PX, p.z as f32) else { continue };
            if step_m > MIN_STEP_M && variance < MAX_VARIANCE_M2 {
                found |= bodies.grow_from([x, y], REGION_STEP_M);
            }
        }
        found
    }
}

impl DynamicFilter for DynaSlam {
    fn before_pose(&mut self, config: &DynamicConfig, input: &FilterInput<'_>, features: &mut FrameFeatures) {
        let &FilterInput { movable, depth, .. } = input;
        self.tracks.list.clear();
        let depths = self.groups.depths_of(config, movable, depth, features);
        self.tracks.update(config, 0, movable, depths, [depth.raw.width(), depth.raw.height()]);
        self.segmenter.begin(input);
        self.segmenter.outline(config, &mut self.groups, &mut self.tracks, 0.0);
        self.regions.clear();
        self.regions.extend(self.tracks.list.iter().map(|track| track.region(config)));
        self.distrust(features);
    }

    fn after_pose(&mut self, _config: &DynamicConfig, first: &FirstPose<'_>, features: &mut FrameFeatures) -> bool {
        self.choose(first);
        let mut found = false;
        for k in 0..self.latest.len() {
            if let Some(keyframe) = first.map.keyframe(self.latest[k].1) {
                found |= self.compare(first, keyframe);
            }
        }
        if found {
            self.distrust(features);
        }
        found
    }

    fn regions(&self) -> &[Region] {
        &self.regions
    }

    fn moving_mask(&self, _config: &DynamicConfig, _depth: &DepthImage) -> MovingMask {
        let bodies = self.segmenter.bodies.clone();
        MovingMask { bodies, ..MovingMask::default() }
    }
}

impl DynaSlam {
    /// Distrusts features on what was outlined or near it.
    fn distrust(&self, features: &mut FrameFeatures) {
        for f in &mut features.features {
            f.trust = if self.segmenter.bodies.covers(f.raw, EDGE_PX) { 0.0 } else { 1.0 };
        }
    }
}

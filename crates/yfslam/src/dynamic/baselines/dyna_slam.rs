//! Method `dyna`: the multi-view geometry of DynaSLAM (Bescos et al., IEEE RA-L 2018, section III-C).
//!
//! In: detections or a mask of people; later a first pose and the keyframes of the map. Out: people are excluded, and everything
//! that is nearer than points of earlier keyframes at the same pixel. People are segmented from boxes and depth, where the paper
//! has a segmentation network.

use crate::config::DynamicConfig;
use crate::dynamic::segment::depth_clusters::DepthClusters;
use crate::dynamic::segment::segmenter::Segmenter;
use crate::dynamic::tracks::Tracks;
use crate::dynamic::{DynamicFilter, FilterInput, FirstPose, MovingMask, Region};
use crate::features::FrameFeatures;
use crate::geometry::Pose;
use crate::image::DepthImage;
use crate::map::{KeyFrame, KeyFrameId};

/// Distance from a segmented instance up to which features are excluded, px. Source of this and the following constants: DynaSLAM.
const EDGE_PX: f32 = 15.0;
/// Number of latest keyframes from which the reference keyframes are chosen.
const KEYFRAMES: usize = 20;
/// Number of keyframes below which nothing is compared.
const MIN_KEYFRAMES: usize = 5;
/// Number of reference keyframes: those farthest from the frame.
const REFERENCES: usize = 5;
/// Weights of translation and rotation in the distance of a keyframe.
const DISTANCE_WEIGHTS: [f64; 2] = [0.7, 0.3];
/// Greatest depth of a keyframe's points, and greatest depth of these points in the frame, m.
const MAX_DEPTH_M: [f64; 2] = [6.0, 7.0];
/// Greatest parallax of a point that is compared, degrees.
const MAX_PARALLAX_DEG: f64 = 30.0;
/// Half the side of the image patch in which the least depth difference is searched, px.
const PATCH_PX: f32 = 20.0;
/// Greatest variance of the patch's depth with which it counts, m².
const MAX_VARIANCE_M2: f32 = 0.001;
/// Difference from the expected depth above which a point is dynamic, m. The paper's τ_z.
const MIN_STEP_M: f32 = 0.4;
/// Difference from the mean depth of a region up to which a neighbour belongs to the region, m.
const REGION_STEP_M: f32 = 0.2;

/// The filter that excludes people and everything nearer than points of earlier keyframes. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub(crate) struct DynaSlam {
    tracks: Tracks,
    clusters: DepthClusters,
    segmenter: Segmenter,
    regions: Vec<Region>,
    /// Reference keyframes: sequence number, id, distance from the frame in metres and radians.
    references: Vec<(u64, KeyFrameId, [f64; 2])>,
}

impl DynaSlam {
    /// Returns a filter whose random draws start from `seed`.
    pub(crate) fn new(seed: u64) -> Self {
        Self { clusters: DepthClusters::new(seed), ..Self::default() }
    }

    /// Chooses the reference keyframes: of the latest, those farthest from the frame.
    fn choose_references(&mut self, first: &FirstPose<'_>) {
        self.references.clear();
        self.references.extend(first.map.keyframes().map(|(id, keyframe)| {
            let motion: Pose = first.t_cam_world * keyframe.t_cam_world.inverse();
            (keyframe.sequence, id, [motion.translation.vector.norm(), motion.rotation.angle()])
        }));
        self.references.sort_unstable_by_key(|(sequence, ..)| std::cmp::Reverse(*sequence));
        self.references.truncate(KEYFRAMES);
        if self.references.len() < MIN_KEYFRAMES {
            self.references.clear();
        }
        let largest = [0, 1].map(|k| self.references.iter().map(|(_, _, distance)| distance[k]).fold(1e-9, f64::max));
        let score = |distance: &[f64; 2]| {
            DISTANCE_WEIGHTS[0] * distance[0] / largest[0] + DISTANCE_WEIGHTS[1] * distance[1] / largest[1]
        };
        self.references.sort_by(|a, b| score(&b.2).total_cmp(&score(&a.2)).then(b.0.cmp(&a.0)));
        self.references.truncate(REFERENCES);
    }

    /// Marks regions that are nearer than the points of a keyframe. Returns whether there is any.
    fn compare_with_keyframe(&mut self, first: &FirstPose<'_>, keyframe: &KeyFrame) -> bool {
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
            let instances = &mut self.segmenter.instances;
            let Some((step_m, variance)) = instances.depth_step([x, y], PATCH_PX, p.z as f32) else { continue };
            if step_m > MIN_STEP_M && variance < MAX_VARIANCE_M2 {
                found |= instances.grow_region([x, y], REGION_STEP_M);
            }
        }
        found
    }
}

impl DynamicFilter for DynaSlam {
    fn before_pose(&mut self, config: &DynamicConfig, input: &FilterInput<'_>, features: &mut FrameFeatures) {
        let &FilterInput { movable, depth, .. } = input;
        self.tracks.list.clear();
        let depths = self.clusters.depths_in_boxes(config, movable, depth, features);
        self.tracks.update(config, 0, movable, depths, [depth.raw.width(), depth.raw.height()]);
        self.segmenter.begin_frame(input);
        self.segmenter.segment(config, &mut self.clusters, &mut self.tracks, 0.0);
        self.regions.clear();
        self.regions.extend(self.tracks.list.iter().map(|track| track.region(config)));
        self.set_trust(features);
    }

    fn after_pose(&mut self, _config: &DynamicConfig, first: &FirstPose<'_>, features: &mut FrameFeatures) -> bool {
        self.choose_references(first);
        let mut found = false;
        for k in 0..self.references.len() {
            if let Some(keyframe) = first.map.keyframe(self.references[k].1) {
                found |= self.compare_with_keyframe(first, keyframe);
            }
        }
        if found {
            self.set_trust(features);
        }
        found
    }

    fn regions(&self) -> &[Region] {
        &self.regions
    }

    fn moving_mask(&self, _config: &DynamicConfig, _depth: &DepthImage) -> MovingMask {
        let instances = self.segmenter.instances.clone();
        MovingMask { instances, ..MovingMask::default() }
    }
}

impl DynaSlam {
    /// Excludes the features on or near a segmented instance.
    fn set_trust(&self, features: &mut FrameFeatures) {
        for f in &mut features.features {
            f.trust = if self.segmenter.instances.covers(f.raw, EDGE_PX) { 0.0 } else { 1.0 };
        }
    }
}

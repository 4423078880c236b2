//! Matching by projection (ORB-SLAM, IEEE T-RO 2015, sections V-B and V-D).
//!
//! In: a frame with a predicted pose, and points with descriptors. Out: new entries in `matches` of the frame. The inner loops are compiled
//! for each instruction set, because Hamming distances take most of the time on processors without a population count instruction.

use fearless_simd::{Level, Simd, dispatch};
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use crate::config::{Config, TrackingConfig};
use crate::context::{Context, SensorModel};
use crate::features::Descriptor;
use crate::features::matching::{RotationHistogram, two_nearest};
use crate::map::{KeyFrame, LandmarkId, Map};
use crate::tracking::tracked_frame::{Match, TrackedFrame};

/// Least depth of a point that is projected, m.
pub(crate) const MIN_DEPTH_M: f64 = 0.01;
/// Tolerance of the least distance at which a landmark is expected. Source: ORB-SLAM (IEEE T-RO 2015, section V-D, scale invariance region),
/// value of ORB-SLAM2.
pub(crate) const MIN_DISTANCE_FACTOR: f64 = 0.8;
/// Tolerance of the largest distance at which a landmark is expected. Source: as [`MIN_DISTANCE_FACTOR`].
pub(crate) const MAX_DISTANCE_FACTOR: f64 = 1.2;
/// Cosine of the angle between the ray and the mean viewing direction above which the search radius is narrow. Source: ORB-SLAM2.
const NARROW_VIEW_COSINE: f64 = 0.998;

/// A camera pose, prepared for the projection of many points.
pub(crate) struct Projector<'a> {
    sensor: &'a SensorModel,
    rotation: Matrix3<f64>,
    translation: Vector3<f64>,
    /// Camera centre in the world, m.
    pub center_world: Point3<f64>,
}

/// Projection of a point into the image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projection {
    /// Undistorted column, px.
    pub u: f32,
    /// Undistorted row, px.
    pub v: f32,
    /// Depth, m.
    pub z_m: f32,
}

impl<'a> Projector<'a> {
    /// Prepares the projection into the camera at `t_cam_world`.
    pub(crate) fn new(sensor: &'a SensorModel, t_cam_world: &Isometry3<f64>) -> Self {
        Self {
            sensor,
            rotation: *t_cam_world.rotation.to_rotation_matrix().matrix(),
            translation: t_cam_world.translation.vector,
            center_world: t_cam_world.inverse_transform_point(&Point3::origin()),
        }
    }

    /// Projects a point of the world; `None` behind the camera or outside the image.
    #[inline]
    pub(crate) fn project(&self, point_world: &Point3<f64>) -> Option<Projection> {
        let p = self.rotation * point_world.coords + self.translation;
        if p.z <= MIN_DEPTH_M {
            return None;
        }
        let [u, v] = self.sensor.pinhole.project(&p);
        let (u, v) = (u as f32, v as f32);
        self.sensor.bounds.contains(u, v).then_some(Projection { u, v, z_m: p.z as f32 })
    }

    /// Returns whether the depth of a feature agrees with the projection: no depth, or disparities that differ by at most `radius` px.
    #[inline]
    pub(crate) fn depth_agrees(&self, depth_m: Option<f32>, projection: &Projection, radius: f32) -> bool {
        let bf = self.sensor.pinhole.bf as f32;
        depth_m.is_none_or(|z| (bf / z - bf / projection.z_m).abs() <= radius)
    }
}

/// The nearest and the second nearest of a series of descriptors, with their octaves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BestTwo {
    /// Index of the nearest feature; `usize::MAX` if there is none.
    pub index: usize,
    /// Hamming distance of the nearest feature; `u32::MAX` if there is none.
    pub distance: u32,
    octave: u8,
    second_distance: u32,
    second_octave: u8,
}

impl BestTwo {
    /// Begins an empty series.
    pub(crate) fn new() -> Self {
        Self { index: usize::MAX, distance: u32::MAX, octave: 0, second_distance: u32::MAX, second_octave: 0 }
    }

    /// Adds a candidate.
    #[inline]
    pub(crate) fn add(&mut self, index: usize, distance: u32, octave: u8) {
        if distance < self.distance {
            (self.second_distance, self.second_octave) = (self.distance, self.octave);
            (self.index, self.distance, self.octave) = (index, distance, octave);
        } else if distance < self.second_distance {
            (self.second_distance, self.second_octave) = (distance, octave);
        }
    }

    /// Returns whether the nearest distance is at most `limit` and less than `ratio` times the second nearest (ratio test).
    pub(crate) fn is_distinct(&self, limit: u32, ratio: f32) -> bool {
        self.distance <= limit
            && (self.second_distance == u32::MAX || (self.distance as f32) < ratio * self.second_distance as f32)
    }

    /// Returns the same as [`BestTwo::is_distinct`], but without the ratio test if both have different octaves.
    pub(crate) fn is_distinct_in_octave(&self, limit: u32, ratio: f32) -> bool {
        self.distance <= limit
            && (self.octave != self.second_octave
                || self.second_distance == u32::MAX
                || (self.distance as f32) <= ratio * self.second_distance as f32)
    }
}

/// Matches the points of `last` around their projections into `current`. Returns the number of matches.
pub(crate) fn search_last_frame(
    context: &Context,
    last: &TrackedFrame,
    current: &mut TrackedFrame,
    radius_px: f32,
    rotation: &mut RotationHistogram,
) -> usize {
    rotation.clear();
    dispatch!(Level::new(), simd => match_last_frame(simd, context, last, current, radius_px, rotation));
    rotation.for_each_outlier(|j| current.matches[j as usize] = None);
    current.match_count()
}

#[inline(always)]
fn match_last_frame<S: Simd>(
    _: S,
    context: &Context,
    last: &TrackedFrame,
    current: &mut TrackedFrame,
    radius_px: f32,
    rotation: &mut RotationHistogram,
) {
    let (sensor, config) = (&context.sensor, &context.config.tracking);
    let projector = Projector::new(sensor, &current.t_cam_world);
    let center_in_last = last.t_cam_world * projector.center_world;
    let baseline = sensor.baseline();
    let coarsest = (sensor.levels() - 1) as u8;
    for (i, matched) in last.matches.iter().enumerate() {
        let Some(matched) = matched else { continue };
        let Some(projection) = projector.project(&matched.point_world) else { continue };
        let feature = &last.features.features[i];
        let radius = radius_px * sensor.scale(feature.octave);
        // After a forward motion the point appears larger, hence at the same or a coarser level; after a backward motion at the same or a finer
        // one.
        let octaves = if center_in_last.z > baseline {
            feature.octave..=coarsest
        } else if center_in_last.z < -baseline {
            0..=feature.octave
        } else {
            feature.octave.saturating_sub(1)..=(feature.octave + 1).min(coarsest)
        };
        let descriptor = &last.features.descriptors[i];
        let mut best = BestTwo::new();
        current.features.for_each_near(projection.u, projection.v, radius, octaves, |j| {
            let f = &current.features.features[j];
            if current.is_matchable(j) && projector.depth_agrees(f.depth_m, &projection, radius) {
                best.add(j, descriptor.distance(&current.features.descriptors[j]), f.octave);
            }
        });
        if best.distance <= config.hamming_high {
            current.matches[best.index] = Some(*matched);
            rotation.add(feature.angle_rad - current.features.features[best.index].angle_rad, best.index as u32);
        }
    }
}

/// Matches the landmarks of a keyframe by descriptor in the whole frame. Returns the number of matches.
pub(crate) fn search_keyframe(
    config: &TrackingConfig,
    keyframe: &KeyFrame,
    map: &Map,
    current: &mut TrackedFrame,
    rotation: &mut RotationHistogram,
) -> usize {
    rotation.clear();
    let candidates: Vec<u32> =
        (0..current.features.len()).filter(|&j| current.is_matchable(j)).map(|j| j as u32).collect();
    for (i, id) in keyframe.observed() {
        let Some(landmark) = map.landmark(id) else { continue };
        let [best, second] = two_nearest(&keyframe.features.descriptors[i], &current.features.descriptors, &candidates);
        let Some(best) = best else { continue };
        let second_distance = second.map_or(u32::MAX, |n| n.distance);
        let distinct = (best.distance as f32) < config.reference_ratio * second_distance as f32;
        let j = best.index as usize;
        if best.distance <= config.hamming_low && distinct && current.is_matchable(j) {
            current.matches[j] = Some(Match::of(id, landmark));
            rotation.add(keyframe.features.features[i].angle_rad - current.features.features[j].angle_rad, best.index);
        }
    }
    rotation.for_each_outlier(|j| current.matches[j as usize] = None);
    current.match_count()
}

/// Matches features of the finest level between the first frame and the current one, each around its last known position, px, and updates
/// these positions. Returns pairs of feature indices (in first, in current).
pub(crate) fn search_first_frame(
    config: &Config,
    first: &TrackedFrame,
    current: &TrackedFrame,
    last_positions: &mut [[f32; 2]],
    rotation: &mut RotationHistogram,
) -> Vec<(usize, usize)> {
    rotation.clear();
    // For each feature of the current frame the nearest feature of the first frame, with its distance.
    let mut nearest: Vec<Option<(u32, usize)>> = vec![None; current.features.len()];
    dispatch!(Level::new(), simd => match_first_frame(simd, config, first, current, last_positions, &mut nearest));
    for (j, (_, i)) in nearest.iter().enumerate().filter_map(|(j, nearest)| Some((j, (*nearest)?))) {
        let turn = first.features.features[i].angle_rad - current.features.features[j].angle_rad;
        rotation.add(turn, j as u32);
    }
    rotation.for_each_outlier(|j| nearest[j as usize] = None);
    let mut matches: Vec<(usize, usize)> =
        nearest.iter().enumerate().filter_map(|(j, nearest)| nearest.map(|(_, i)| (i, j))).collect();
    matches.sort_unstable();
    for &(i, j) in &matches {
        let f = &current.features.features[j];
        last_positions[i] = [f.u, f.v];
    }
    matches
}

#[inline(always)]
fn match_first_frame<S: Simd>(
    _: S,
    config: &Config,
    first: &TrackedFrame,
    current: &TrackedFrame,
    last_positions: &[[f32; 2]],
    nearest: &mut [Option<(u32, usize)>],
) {
    let c = &config.monocular;
    for (i, f) in first.features.features.iter().enumerate() {
        // Only the finest level: the positions of coarser corners are too inaccurate for initialisation.
        if f.octave > 0 || f.trust <= 0.0 {
            continue;
        }
        let [u, v] = last_positions[i];
        let mut best = BestTwo::new();
        current.features.for_each_near(u, v, c.init_radius_px, 0..=0, |j| {
            if current.features.features[j].trust > 0.0 {
                best.add(j, first.features.descriptors[i].distance(&current.features.descriptors[j]), 0);
            }
        });
        if best.is_distinct(config.tracking.hamming_low, c.init_ratio)
            && nearest[best.index].is_none_or(|(distance, _)| best.distance < distance)
        {
            nearest[best.index] = Some((best.distance, i));
        }
    }
}

/// Matches the landmarks of the local map and replaces `visible` by those that are expected in view.
pub(crate) fn search_local_map(
    context: &Context,
    map: &Map,
    landmarks: &[LandmarkId],
    current: &mut TrackedFrame,
    visible: &mut Vec<LandmarkId>,
) {
    dispatch!(Level::new(), simd => match_local_map(simd, context, map, landmarks, current, visible));
}

#[inline(always)]
fn match_local_map<S: Simd>(
    _: S,
    context: &Context,
    map: &Map,
    landmarks: &[LandmarkId],
    current: &mut TrackedFrame,
    visible: &mut Vec<LandmarkId>,
) {
    let (sensor, config) = (&context.sensor, &context.config.tracking);
    visible.clear();
    let projector = Projector::new(sensor, &current.t_cam_world);
    for &id in landmarks {
        let Some(landmark) = map.landmark(id) else { continue };
        let Some(projection) = projector.project(&landmark.position) else { continue };
        let ray = landmark.position - projector.center_world;
        let distance = ray.norm();
        if distance < MIN_DISTANCE_FACTOR * landmark.min_distance_m
            || distance > MAX_DISTANCE_FACTOR * landmark.max_distance_m
        {
            continue;
        }
        let cosine = ray.dot(&landmark.normal) / distance;
        if cosine < config.min_view_cosine {
            continue;
        }
        visible.push(id);
        let octave = sensor.predict_octave(landmark.max_distance_m, distance);
        let radius = config.local_radius_factor
            * sensor.scale(octave)
            * if cosine > NARROW_VIEW_COSINE { config.local_radius_narrow_px } else { config.local_radius_px };
        let best = best_near(current, &projector, &projection, radius, octave, &landmark.descriptor);
        if best.is_distinct_in_octave(config.hamming_high, config.local_ratio) {
            current.matches[best.index] = Some(Match::of(id, landmark));
        }
    }
}

/// Searches the nearest descriptors among the matchable features around a projection, at the predicted octave or one finer.
#[inline(always)]
fn best_near(
    current: &TrackedFrame,
    projector: &Projector<'_>,
    projection: &Projection,
    radius: f32,
    octave: u8,
    descriptor: &Descriptor,
) -> BestTwo {
    let mut best = BestTwo::new();
    current.features.for_each_near(projection.u, projection.v, radius, octave.saturating_sub(1)..=octave, |j| {
        let f = &current.features.features[j];
        if current.is_matchable(j) && projector.depth_agrees(f.depth_m, projection, radius) {
            best.add(j, descriptor.distance(&current.features.descriptors[j]), f.octave);
        }
    });
    best
}

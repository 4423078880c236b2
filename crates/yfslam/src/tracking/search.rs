//! Matching by projection (ORB-SLAM, IEEE T-RO 2015, sections V-B and V-D).
//!
//! In: a frame with a predicted pose, and points with descriptors. Out: new entries in the frame's `matches`. The inner loops are
//! compiled for each instruction set: without one that counts bits, Hamming distances take most of their time.

use fearless_simd::{Level, Simd, dispatch};
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use crate::config::{Config, TrackingConfig};
use crate::context::{Context, SensorModel};
use crate::features::Descriptor;
use crate::features::matching::{RotationHistogram, two_nearest};
use crate::map::{KeyFrame, LandmarkId, Map};
use crate::tracking::tracked_frame::{Match, TrackedFrame};

/// The camera pose in the form projection loops want.
pub(crate) struct Projector<'a> {
    sensor: &'a SensorModel,
    rotation: Matrix3<f64>,
    translation: Vector3<f64>,
    /// The camera's centre in the world, m.
    pub center_world: Point3<f64>,
}

/// A point projected into the image.
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
    /// Prepares projections into the camera at `t_cam_world`.
    pub(crate) fn new(sensor: &'a SensorModel, t_cam_world: &Isometry3<f64>) -> Self {
        Self {
            sensor,
            rotation: *t_cam_world.rotation.to_rotation_matrix().matrix(),
            translation: t_cam_world.translation.vector,
            center_world: t_cam_world.inverse_transform_point(&Point3::origin()),
        }
    }

    /// Projects a world point; `None` behind the camera or outside the image.
    #[inline]
    pub(crate) fn project(&self, point_world: &Point3<f64>) -> Option<Projection> {
        let p = self.rotation * point_world.coords + self.translation;
        if p.z <= 0.01 {
            return None;
        }
        let [u, v] = self.sensor.pinhole.project(&p);
        let (u, v) = (u as f32, v as f32);
        self.sensor.bounds.contains(u, v).then_some(Projection { u, v, z_m: p.z as f32 })
    }

    /// Whether a feature's depth is compatible with the projection: their disparities differ by less than `radius` px.
    #[inline]
    pub(crate) fn depth_agrees(&self, depth_m: Option<f32>, projection: &Projection, radius: f32) -> bool {
        let bf = self.sensor.pinhole.bf as f32;
        depth_m.is_none_or(|z| (bf / z - bf / projection.z_m).abs() <= radius)
    }
}

/// The two nearest descriptors seen so far, with the octave of each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Best {
    /// Index of the nearest feature.
    pub index: usize,
    /// Its Hamming distance.
    pub distance: u32,
    octave: u8,
    second_distance: u32,
    second_octave: u8,
}

impl Best {
    /// Nothing seen yet.
    pub(crate) fn none() -> Self {
        Self { index: usize::MAX, distance: u32::MAX, octave: 0, second_distance: u32::MAX, second_octave: 0 }
    }

    /// Takes a candidate into account.
    #[inline]
    pub(crate) fn offer(&mut self, index: usize, distance: u32, octave: u8) {
        if distance < self.distance {
            (self.second_distance, self.second_octave) = (self.distance, self.octave);
            (self.index, self.distance, self.octave) = (index, distance, octave);
        } else if distance < self.second_distance {
            (self.second_distance, self.second_octave) = (distance, octave);
        }
    }

    /// Whether the nearest is within `limit` and nearer than `ratio` times the second-nearest.
    pub(crate) fn is_distinct(&self, limit: u32, ratio: f32) -> bool {
        self.distance <= limit
            && (self.second_distance == u32::MAX || (self.distance as f32) < ratio * self.second_distance as f32)
    }

    /// As [`Best::is_distinct`], where a rival at another octave does not count.
    pub(crate) fn is_distinct_in_octave(&self, limit: u32, ratio: f32) -> bool {
        self.distance <= limit
            && (self.octave != self.second_octave
                || self.second_distance == u32::MAX
                || (self.distance as f32) <= ratio * self.second_distance as f32)
    }
}

/// Matches the points of `last` around their projection into `current`. Returns the number of matches.
pub(crate) fn search_last_frame(
    context: &Context,
    last: &TrackedFrame,
    current: &mut TrackedFrame,
    radius_px: f32,
    rotation: &mut RotationHistogram,
) -> usize {
    let (_sensor, _config) = (&context.sensor, &context.config.tracking);
    rotation.clear();
    dispatch!(Level::new(), simd => match_last_frame(simd, context, last, current, radius_px, rotation));
    rotation.for_each_outlier(|j| current.matches[j as usize] = None);
    current.matched()
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
    let top = (sensor.levels() - 1) as u8;
    for (i, matched) in last.matches.iter().enumerate() {
        let Some(matched) = matched else { continue };
        let Some(projection) = projector.project(&matched.point_world) else { continue };
        let seen = &last.features.features[i];
        let radius = radius_px * sensor.scale(seen.octave);
        // A camera that moved forward sees the point larger, hence at the same or a coarser level; backward alike.
        let octaves = if center_in_last.z > baseline {
            seen.octave..=top
        } else if center_in_last.z < -baseline {
            0..=seen.octave
        } else {
            seen.octave.saturating_sub(1)..=(seen.octave + 1).min(top)
        };
        let descriptor = &last.features.descriptors[i];
        let mut best = Best::none();
        current.features.for_each_near(projection.u, projection.v, radius, octaves, |j| {
            let f = &current.features.features[j];
            if current.is_open(j) && projector.depth_agrees(f.depth_m, &projection, radius) {
                best.offer(j, descriptor.distance(&current.features.descriptors[j]), f.octave);
            }
        });
        if best.distance <= config.hamming_high {
            current.matches[best.index] = Some(*matched);
            rotation.add(seen.angle_rad - current.features.features[best.index].angle_rad, best.index as u32);
        }
    }
}

/// Matches the landmarks of a keyframe by descriptor alone. Returns the number of matches.
pub(crate) fn search_keyframe(
    config: &TrackingConfig,
    keyframe: &KeyFrame,
    map: &Map,
    current: &mut TrackedFrame,
    rotation: &mut RotationHistogram,
) -> usize {
    rotation.clear();
    let candidates: Vec<u32> = (0..current.features.len()).filter(|&j| current.is_open(j)).map(|j| j as u32).collect();
    for (i, id) in keyframe.observed() {
        let Some(landmark) = map.landmark(id) else { continue };
        let [best, second] = two_nearest(&keyframe.features.descriptors[i], &current.features.descriptors, &candidates);
        let Some(best) = best else { continue };
        let rival = second.map_or(u32::MAX, |n| n.distance);
        let distinct = (best.distance as f32) < config.reference_ratio * rival as f32;
        let j = best.index as usize;
        if best.distance <= config.hamming_low && distinct && current.is_open(j) {
            current.matches[j] = Some(Match::of(id, landmark));
            rotation.add(keyframe.features.features[i].angle_rad - current.features.features[j].angle_rad, best.index);
        }
    }
    rotation.for_each_outlier(|j| current.matches[j as usize] = None);
    current.matched()
}

/// Matches features of the finest level between the first frame and the current one, each around where it was seen last, which is
/// brought up to date. Returns pairs of feature indices (in first, in current).
pub(crate) fn search_first_frame(
    config: &Config,
    first: &TrackedFrame,
    current: &TrackedFrame,
    last_seen: &mut [[f32; 2]],
    rotation: &mut RotationHistogram,
) -> Vec<(usize, usize)> {
    rotation.clear();
    // For each feature of the current frame the feature of the first that it is nearest to, and the distance.
    let mut owner: Vec<Option<(u32, usize)>> = vec![None; current.features.len()];
    dispatch!(Level::new(), simd => match_first_frame(simd, config, first, current, last_seen, &mut owner));
    for (j, (_, i)) in owner.iter().enumerate().filter_map(|(j, owner)| Some((j, (*owner)?))) {
        let turn = first.features.features[i].angle_rad - current.features.features[j].angle_rad;
        rotation.add(turn, j as u32);
    }
    rotation.for_each_outlier(|j| owner[j as usize] = None);
    let mut matches: Vec<(usize, usize)> =
        owner.iter().enumerate().filter_map(|(j, owner)| owner.map(|(_, i)| (i, j))).collect();
    matches.sort_unstable();
    for &(i, j) in &matches {
        let f = &current.features.features[j];
        last_seen[i] = [f.u, f.v];
    }
    matches
}

#[inline(always)]
fn match_first_frame<S: Simd>(
    _: S,
    config: &Config,
    first: &TrackedFrame,
    current: &TrackedFrame,
    last_seen: &[[f32; 2]],
    owner: &mut [Option<(u32, usize)>],
) {
    let c = &config.monocular;
    for (i, f) in first.features.features.iter().enumerate() {
        // The finest level: coarser corners are known too badly to begin with.
        if f.octave > 0 || f.trust <= 0.0 {
            continue;
        }
        let [u, v] = last_seen[i];
        let mut best = Best::none();
        current.features.for_each_near(u, v, c.init_radius_px, 0..=0, |j| {
            if current.features.features[j].trust > 0.0 {
                best.offer(j, first.features.descriptors[i].distance(&current.features.descriptors[j]), 0);
            }
        });
        if best.is_distinct(config.tracking.hamming_low, c.init_ratio)
            && owner[best.index].is_none_or(|(distance, _)| best.distance < distance)
        {
            owner[best.index] = Some((best.distance, i));
        }
    }
}

/// Matches landmarks of the local map that the frame does not see yet. `visible` is refilled with those that lie in view.
pub(crate) fn search_local_map(
    context: &Context,
    map: &Map,
    landmarks: &[LandmarkId],
    current: &mut TrackedFrame,
    visible: &mut Vec<LandmarkId>,
) {
    let (_sensor, _config) = (&context.sensor, &context.config.tracking);
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
        if distance < 0.8 * landmark.min_distance_m || distance > 1.2 * landmark.max_distance_m {
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
            * if cosine > 0.998 { config.local_radius_narrow_px } else { config.local_radius_px };
        let best = best_near(current, &projector, &projection, radius, octave, &landmark.descriptor);
        if best.is_distinct_in_octave(config.hamming_high, config.local_ratio) {
            current.matches[best.index] = Some(Match::of(id, landmark));
        }
    }
}

/// The open feature around a projection whose descriptor is nearest, at the predicted octave or one finer.
#[inline(always)]
fn best_near(
    current: &TrackedFrame,
    projector: &Projector<'_>,
    projection: &Projection,
    radius: f32,
    octave: u8,
    descriptor: &Descriptor,
) -> Best {
    let mut best = Best::none();
    current.features.for_each_near(projection.u, projection.v, radius, octave.saturating_sub(1)..=octave, |j| {
        let f = &current.features.features[j];
        if current.is_open(j) && projector.depth_agrees(f.depth_m, projection, radius) {
            best.offer(j, descriptor.distance(&current.features.descriptors[j]), f.octave);
        }
    });
    best
}

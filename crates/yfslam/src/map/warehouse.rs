//! A robot that drives through the aisles of a warehouse and back to its start, as keyframes without images: maps of any size, for tests and
//! measurements of growth.
//!
//! In: the number of keyframes. Out: a map whose poses have drifted, and the features of every keyframe.

use std::collections::HashMap;

use nalgebra::{Point3, Vector3, Vector6};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

use super::{KeyFrameId, LandmarkId, Map};
use crate::camera::Camera;
use crate::config::Config;
use crate::context::Context;
use crate::features::{Descriptor, Feature, FrameFeatures};
use crate::geometry::{Pose, se3_exp};

/// Distance between keyframes, m.
const STEP_M: f64 = 0.5;
/// New points beside each keyframe.
const POINTS: usize = 30;
/// Depths at which points are seen, m.
const SEEN_M: [f64; 2] = [0.8, 6.0];
/// A place is lost from sight after so many keyframes.
const MEMORY: usize = 60;

/// A path through a warehouse, with points beside it.
pub(crate) struct Warehouse {
    pub context: Context,
    /// True poses, `t_cam_world`: once around, then the beginning again.
    pub truth: Vec<Pose>,
    /// Number of keyframes of a round.
    round: usize,
    points: Vec<Point3<f64>>,
    /// Features of a keyframe that show no landmark.
    clutter: usize,
    /// Landmark of each point, and the keyframe that observed it last.
    landmarks: HashMap<usize, (LandmarkId, usize)>,
    estimate: Pose,
    rng: Pcg64Mcg,
}

impl Warehouse {
    /// Makes a path of about so many keyframes, of which the last `again` show the beginning again.
    pub(crate) fn new(keyframes: usize, again: usize, clutter: usize) -> Self {
        let camera = Camera::pinhole(640, 480, 520.0, 520.0, 320.0, 240.0);
        let scales: Vec<f32> = (0..8).map(|level| 1.2f32.powi(level)).collect();
        let context = Context::new(&camera, &Config::default(), &scales);
        let mut truth = path(keyframes);
        let round = truth.len();
        let shifted = se3_exp(&Vector6::new(0.1, 0.02, 0.0, 0.0, 0.02, 0.0));
        truth.extend_from_within(..again);
        truth[round..].iter_mut().for_each(|pose| *pose = shifted * *pose);
        let mut rng = Pcg64Mcg::seed_from_u64(7);
        let mut points = Vec::new();
        for pose in &truth[..round] {
            for _ in 0..POINTS {
                let side = if rng.next_u32().is_multiple_of(2) { 1.0 } else { -1.0 };
                let [a, b, c] = [0; 3].map(|_| uniform(&mut rng));
                points.push(pose.inverse() * Point3::new(side * (1.6 + 0.4 * a), 2.0 * b - 1.2, STEP_M * c));
            }
        }
        let estimate = Pose::identity();
        Self { context, truth, round, points, clutter, landmarks: HashMap::new(), estimate, rng }
    }

    /// Returns the features of the next keyframe, with the point that each shows, and moves the estimate.
    fn observe(&mut self, k: usize) -> (FrameFeatures, Vec<Option<usize>>) {
        let sensor = &self.context.sensor;
        let (bounds, pinhole) = (sensor.bounds, sensor.pinhole);
        let (mut features, mut descriptors, mut shown) = (Vec::new(), Vec::new(), Vec::new());
        let place = k % self.round;
        let near = place * POINTS..(place + 14) * POINTS;
        for number in near.map(|number| number % self.points.len()) {
            let p = (self.truth[k] * self.points[number]).coords;
            let [u, v] = pinhole.project(&p);
            // Not every corner is detected in every image.
            let is_seen = p.z > SEEN_M[0] && p.z < SEEN_M[1] && uniform(&mut self.rng) < 0.7;
            if !is_seen || !bounds.contains(u as f32, v as f32) {
                continue;
            }
            let octave = sensor.predict_octave(7.0, p.z);
            let [du, dv, dz] = [0; 3].map(|_| normal(&mut self.rng));
            let [u, v] = [(u + 0.7 * du) as f32, (v + 0.7 * dv) as f32];
            let depth_m = Some((p.z * (1.0 + 0.003 * dz * p.z)) as f32);
            features.push(Feature { raw: [u, v], u, v, octave, angle_rad: 0.0, depth_m, trust: 1.0 });
            let mut words = [1, 2, 3, 4].map(|i| mixed(number as u64 * 4 + i));
            (0..8).for_each(|_| words[self.rng.next_u32() as usize % 4] ^= 1 << (self.rng.next_u32() % 64));
            descriptors.push(Descriptor(words));
            shown.push(Some(number));
        }
        for _ in 0..self.clutter {
            let [u, v] = [640.0, 480.0].map(|side| (side * uniform(&mut self.rng)) as f32);
            features.push(Feature { raw: [u, v], u, v, octave: 0, angle_rad: 0.0, depth_m: None, trust: 1.0 });
            descriptors.push(Descriptor([0; 4].map(|_| self.rng.next_u64())));
            shown.push(None);
        }
        (FrameFeatures::from_parts(features, descriptors, bounds), shown)
    }

    /// Moves the estimate to keyframe `k`, with noise.
    fn advance(&mut self, k: usize) {
        if k > 0 {
            let motion = self.truth[k] * self.truth[k - 1].inverse();
            let mut noise = Vector6::from_fn(|_, _| normal(&mut self.rng));
            (0..6).for_each(|i| noise[i] *= if i < 3 { 0.002 } else { 0.0002 });
            noise[4] += 0.00005;
            self.estimate = se3_exp(&noise) * motion * self.estimate;
        }
    }

    /// Inserts keyframe `k` without local mapping: what tracking and mapping give, but quickly.
    pub(crate) fn add(&mut self, map: &mut Map, k: usize) -> KeyFrameId {
        self.advance(k);
        let (features, shown) = self.observe(k);
        let points: Vec<_> = features.features.iter().map(|f| (f.u, f.v, f.depth_m.unwrap_or(1.0))).collect();
        let scales = &self.context.sensor.scale_factors;
        let id = map.insert_keyframe(k as i64 * 100_000_000, self.estimate, features);
        for (feature, number) in shown.iter().enumerate() {
            let Some(number) = *number else { continue };
            let known =
                self.landmarks.get(&number).filter(|(id, last)| map.landmark(*id).is_some() && k < last + MEMORY);
            let landmark = match known {
                Some(&(landmark, _)) => {
                    map.add_observation(landmark, id, feature);
                    Some(landmark)
                }
                None => {
                    let (u, v, z) = points[feature];
                    let p = self.context.sensor.pinhole.unproject(u.into(), v.into(), z.into());
                    map.insert_landmark(self.estimate.inverse() * p, id, feature, [0; 3], scales)
                }
            };
            if let Some(landmark) = landmark {
                self.landmarks.insert(number, (landmark, k));
                map.update_landmark(landmark, scales);
            }
        }
        map.update_covisibility(id);
        id
    }

    /// Returns the root mean square error of the keyframes' positions, m.
    pub(crate) fn error_m(&self, map: &Map) -> f64 {
        let center = |pose: &Pose| pose.inverse().translation.vector;
        let errors = map.keyframes().map(|(_, k)| {
            (center(&k.t_cam_world) - center(&self.truth[(k.timestamp_ns / 100_000_000) as usize])).norm_squared()
        });
        (errors.sum::<f64>() / map.keyframe_count() as f64).sqrt()
    }
}

/// Returns the poses of a round through aisles that are joined by turns, and back.
fn path(keyframes: usize) -> Vec<Pose> {
    let length = if keyframes > 5000 { 200.0 } else { 40.0 };
    let aisles = ((keyframes as f64 * STEP_M / (2.0 * (length + 13.0))) as usize).max(1) * 2;
    let mut poses = Vec::new();
    let (mut x, mut z, mut heading) = (0.0, 0.0, 0.0f64);
    let mut drive = |distance: f64, turn: f64| {
        let steps = (distance / STEP_M).round().max(1.0) as usize;
        for _ in 0..steps {
            let rotation = Vector6::new(0.0, 0.0, 0.0, 0.0, heading, 0.0);
            poses.push((Pose::translation(x, 0.0, z) * se3_exp(&rotation)).inverse());
            heading += turn / steps as f64;
            (x, z) = (x + STEP_M * heading.sin(), z + STEP_M * heading.cos());
        }
    };
    let quarter = std::f64::consts::FRAC_PI_2;
    for aisle in 0..aisles {
        let side = if aisle % 2 == 0 { quarter } else { -quarter };
        drive(length, 0.0);
        if aisle + 1 < aisles {
            drive(10.0, 2.0 * side);
        }
    }
    // Back to the beginning of the first aisle.
    drive(5.0, quarter);
    let back = drive_back(&poses, quarter);
    poses.extend(back);
    poses
}

/// Returns the rest of the round: along the front of the aisles, and into the first one.
fn drive_back(poses: &[Pose], quarter: f64) -> Vec<Pose> {
    let Some(last) = poses.last() else { return Vec::new() };
    let from = last.inverse().translation.vector;
    // The last turn has the radius of the turn before.
    let radius = 5.0 / quarter;
    let along = Vector3::new(radius, 0.0, -radius) - from;
    let steps = (along.norm() / STEP_M) as usize;
    let mut rest: Vec<(Vector3<f64>, f64)> =
        (1..=steps).map(|i| (from + along * (i as f64 / steps as f64), -quarter)).collect();
    for i in 1..10 {
        let heading = -quarter * (1.0 - f64::from(i) / 10.0);
        rest.push((Vector3::new(radius * (1.0 - heading.cos()), 0.0, radius * heading.sin()), heading));
    }
    let pose = |(at, heading): (Vector3<f64>, f64)| {
        let rotation = se3_exp(&Vector6::new(0.0, 0.0, 0.0, 0.0, heading, 0.0));
        (Pose::translation(at.x, at.y, at.z) * rotation).inverse()
    };
    rest.into_iter().map(pose).collect()
}

/// Returns a number in [0, 1).
fn uniform(rng: &mut Pcg64Mcg) -> f64 {
    f64::from(rng.next_u32()) / (f64::from(u32::MAX) + 1.0)
}

/// Returns a number with mean 0 and variance 1, nearly normally distributed.
fn normal(rng: &mut Pcg64Mcg) -> f64 {
    (0..12).map(|_| uniform(rng)).sum::<f64>() - 6.0
}

/// Returns well mixed bits of a number.
fn mixed(number: u64) -> u64 {
    let mut x = number.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

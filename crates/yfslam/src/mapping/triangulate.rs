//! Landmark creation by triangulation, for features without depth or beyond the close limit (ORB-SLAM, IEEE T-RO 2015, section VI-C).
//!
//! In: a new keyframe and its covisible keyframes. Out: new landmarks with observations in two keyframes.

use fearless_simd::{Level, Simd, dispatch};
use nalgebra::{Matrix3, Point3, Vector3};

use crate::context::Context;
use crate::features::Feature;
use crate::geometry::{CHI2_LINE, CHI2_PIXEL, Pose, midpoint, skew};
use crate::image::RgbImage;
use crate::map::{KeyFrame, KeyFrameId, LandmarkId, Map};
use crate::mapping::color_at;
use crate::tracking::search::{BestTwo, MIN_DEPTH_M};

/// Tolerance, in pyramid levels' scale factors, of the ratio between distances and scales in two views (scale consistency). Source: ORB-SLAM
/// (IEEE T-RO 2015, section VI-C), value of ORB-SLAM2.
const SCALE_TOLERANCE: f64 = 1.5;

/// Matches features without landmark between `keyframe` and its best covisible keyframes and triangulates the matches.
pub(super) fn new_landmarks(
    context: &Context,
    map: &mut Map,
    keyframe: KeyFrameId,
    color: &RgbImage,
) -> Vec<LandmarkId> {
    let Context { sensor, config } = context;
    let mut created = Vec::new();
    let Some(k) = map.keyframe(keyframe) else { return created };
    let neighbours: Vec<KeyFrameId> =
        k.covisible.iter().take(config.mapping.triangulation_neighbours).map(|(id, _)| *id).collect();
    for neighbour in neighbours {
        let (Some(a), Some(b)) = (map.keyframe(keyframe), map.keyframe(neighbour)) else { continue };
        let t_b_a = b.t_cam_world * a.t_cam_world.inverse();
        let min_baseline = if sensor.measures_depth {
            sensor.baseline()
        } else {
            config.monocular.min_baseline_share * map.median_depth(b)
        };
        if t_b_a.translation.vector.norm() < min_baseline {
            continue;
        }
        for (i, j) in match_along_epipolar_lines(context, a, b, &t_b_a) {
            let (Some(a), Some(b)) = (map.keyframe(keyframe), map.keyframe(neighbour)) else { break };
            let Some(point) = triangulate(context, a, b, i, j) else { continue };
            let raw = a.features.features[i].raw;
            if let Some(id) = map.insert_landmark(point, keyframe, i, color_at(color, raw), &sensor.scale_factors) {
                map.add_observation(id, neighbour, j);
                map.update_landmark(id, &sensor.scale_factors);
                created.push(id);
            }
        }
    }
    created
}

/// Returns the features of a keyframe that may be triangulated: those without landmark and with trust above 0.
fn unmatched_features(k: &KeyFrame) -> Vec<usize> {
    (0..k.features.len()).filter(|&i| k.landmarks[i].is_none() && k.features.features[i].trust > 0.0).collect()
}

/// Matches features by descriptor near their epipolar line. Returns pairs of feature indices (in a, in b).
fn match_along_epipolar_lines(context: &Context, a: &KeyFrame, b: &KeyFrame, t_b_a: &Pose) -> Vec<(usize, usize)> {
    // Baseline x86-64 has no population count instruction for the distances of descriptors.
    dispatch!(Level::new(), simd => match_features(simd, context, a, b, t_b_a))
}

#[inline(always)]
fn match_features<S: Simd>(_: S, context: &Context, a: &KeyFrame, b: &KeyFrame, t_b_a: &Pose) -> Vec<(usize, usize)> {
    let Context { sensor, config } = context;
    let c = &sensor.pinhole;
    let k_inv = Matrix3::new(1.0 / c.fx, 0.0, -c.cx / c.fx, 0.0, 1.0 / c.fy, -c.cy / c.fy, 0.0, 0.0, 1.0);
    let rotation = *t_b_a.rotation.to_rotation_matrix().matrix();
    // x_bᵀ F x_a = 0
    let fundamental = k_inv.transpose() * skew(&t_b_a.translation.vector) * rotation * k_inv;
    // Position, and squared distance from the line up to which a feature matches, for a line with a normal of length 1.
    let candidates: Vec<(usize, [f64; 3])> = unmatched_features(b)
        .into_iter()
        .map(|j| {
            let g = &b.features.features[j];
            let scale = f64::from(sensor.scale(g.octave));
            (j, [f64::from(g.u), f64::from(g.v), CHI2_LINE * scale * scale])
        })
        .collect();
    let mut is_matched = vec![false; b.features.len()];
    let mut matches = Vec::new();
    for i in unmatched_features(a) {
        let f = &a.features.features[i];
        let line = fundamental * Vector3::new(f64::from(f.u), f64::from(f.v), 1.0);
        let norm2 = line.x * line.x + line.y * line.y;
        let mut best = BestTwo::new();
        for &(j, [u, v, limit]) in &candidates {
            let distance = line.x * u + line.y * v + line.z;
            if distance * distance > limit * norm2 || is_matched[j] {
                continue;
            }
            best.add(j, a.features.descriptors[i].distance(&b.features.descriptors[j]), 0);
        }
        if best.is_distinct(config.tracking.hamming_low, config.mapping.triangulation_ratio) {
            is_matched[best.index] = true;
            matches.push((i, best.index));
        }
    }
    matches
}

/// Returns the point of a match in the world; `None` if its reprojection errors or its scales in the two views do not agree.
fn triangulate(context: &Context, a: &KeyFrame, b: &KeyFrame, i: usize, j: usize) -> Option<Point3<f64>> {
    let Context { sensor, config } = context;
    let (f, g) = (&a.features.features[i], &b.features.features[j]);
    let (t_world_a, t_world_b) = (a.t_cam_world.inverse(), b.t_cam_world.inverse());
    let ray = |f: &Feature| sensor.pinhole.unproject(f64::from(f.u), f64::from(f.v), 1.0).coords;
    let (ray_a, ray_b) = (t_world_a.rotation * ray(f), t_world_b.rotation * ray(g));
    let cosine = ray_a.dot(&ray_b) / (ray_a.norm() * ray_b.norm());
    let (center_a, center_b) = (t_world_a.translation.vector, t_world_b.translation.vector);
    let from_depth = |f: &Feature, t_world_cam: &Pose| {
        f.depth_m.map(|z| t_world_cam * sensor.pinhole.unproject(f64::from(f.u), f64::from(f.v), f64::from(z)))
    };
    let point = if cosine > 0.0 && cosine < config.mapping.max_parallax_cosine {
        midpoint(&center_a, &ray_a, &center_b, &ray_b)?
    } else {
        from_depth(f, &t_world_a).or_else(|| from_depth(g, &t_world_b))?
    };
    for (k, f) in [(a, f), (b, g)] {
        let p = (k.t_cam_world * point).coords;
        let m = sensor.measurement(f);
        if p.z <= MIN_DEPTH_M || m.chi2(&m.residual(&sensor.pinhole, &p)) > m.chi2_limit().max(CHI2_PIXEL) {
            return None;
        }
    }
    // Scale consistency: the ratio of the distances must agree with the ratio of the scales.
    let ratio_distance = (point.coords - center_a).norm() / (point.coords - center_b).norm();
    let ratio_scale = f64::from(sensor.scale(f.octave)) / f64::from(sensor.scale(g.octave));
    let tolerance = SCALE_TOLERANCE * f64::from(sensor.scale(1));
    (ratio_distance < ratio_scale * tolerance && ratio_distance * tolerance > ratio_scale).then_some(point)
}

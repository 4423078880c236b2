//! A second rigid motion in the image: something large that no detector knows moves, or the pose follows it.
//!
//! In: the features of a frame with its first pose, and those of a frame of a quarter of a second before. Out: the features that move together,
//! and whether the first pose follows what moves. Features that the earlier frame shows at the place that the pose predicts have the first
//! motion. Those that it shows elsewhere are searched for a second one by RANSAC on their points in both frames. Which of the two is the
//! motion of the world is decided by what lies farther away and is spread farther over the image: an object occludes the world and is surrounded
//! by it, not the other way.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use rand_pcg::Pcg32;
use rand_pcg::rand_core::Rng;

use crate::config::FullConfig;
use crate::detect::BoundingBox;
use crate::dynamic::full::displacement::Search;
use crate::features::{Feature, FrameFeatures};

/// Draws of three pairs. Source: 99 % certainty with 36 % of the pairs on the object.
const DRAWS: usize = 96;
/// Weight of the first motion, which earlier frames have confirmed. Source: chosen.
const FIRST_WEIGHT: f32 = 1.2;
/// Largest ratio of the two distances for a match that is not ambiguous. Source: Lowe, IJCV 2004, section 7.1.
const MAX_RATIO: f32 = 0.8;

/// A feature that the earlier frame shows elsewhere than the pose predicts.
#[derive(Clone, Copy, Debug)]
struct Pair {
    feature: u32,
    /// Its point in the camera, now and in the earlier frame, m.
    here: Point3<f64>,
    there: Point3<f64>,
    /// Position in the earlier frame, and the tolerance there, px.
    seen: [f32; 2],
    radius: f32,
}

/// The search for a second motion. Buffers are reused.
#[derive(Clone, Debug)]
pub(super) struct SecondMotion {
    rng: Pcg32,
    pairs: Vec<Pair>,
    /// Features with the first motion, and with the second.
    first: Vec<u32>,
    second: Vec<u32>,
    trial: Vec<u32>,
    /// The second motion: from the camera now to that of the earlier frame.
    pub motion: Isometry3<f64>,
    sorted: Vec<f32>,
}

/// What was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Found {
    /// Whether the first pose follows the object, and the second motion is that of the world.
    pub pose_follows_object: bool,
    /// Whether both motions could be that of the world.
    pub is_open: bool,
}

impl SecondMotion {
    /// Returns a search whose random draws start from `seed`.
    pub(super) fn new(seed: u64) -> Self {
        Self {
            rng: Pcg32::new(seed, 0x2bad),
            pairs: Vec::new(),
            first: Vec::new(),
            second: Vec::new(),
            trial: Vec::new(),
            motion: Isometry3::identity(),
            sorted: Vec::new(),
        }
    }

    /// Returns the features of the object and those of the world of the last search.
    pub(super) fn groups(&self, found: Found) -> (&[u32], &[u32]) {
        if found.pose_follows_object { (&self.first, &self.second) } else { (&self.second, &self.first) }
    }

    /// Searches a second motion among the candidates; `is_on_object` tells which features lie on an object that has
    /// moved before.
    pub(super) fn search(
        &mut self,
        config: &FullConfig,
        search: &Search<'_>,
        features: &FrameFeatures,
        is_candidate: impl Fn(usize) -> bool,
        is_on_object: impl Fn(u32) -> bool,
    ) -> Option<Found> {
        self.collect(config, search, features, is_candidate);
        if self.pairs.len() < config.second_motion_min_features {
            return None;
        }
        self.fit(search);
        if self.second.len() < config.second_motion_min_features {
            return None;
        }
        // What has moved before is not the world, whatever its size.
        let is_known = |group: &[u32]| 2 * group.iter().filter(|i| is_on_object(**i)).count() > group.len();
        let [first_moved, second_moved] = [&self.first, &self.second].map(|group| is_known(group));
        if first_moved != second_moved {
            return Some(Found { pose_follows_object: first_moved, is_open: false });
        }
        let Self { first, second, sorted, .. } = self;
        let mut weight = |group: &[u32]| {
            let (b, depth_m) = extent(features, group, sorted)?;
            Some((b.x_max - b.x_min) * (b.y_max - b.y_min) * depth_m)
        };
        let (first, second) = (FIRST_WEIGHT * weight(first).unwrap_or(0.0), weight(second).unwrap_or(0.0));
        Some(Found { pose_follows_object: second > first, is_open: second > 0.5 * first && first > 0.5 * second })
    }

    /// Sorts the features into those at their place and those that are shown elsewhere.
    fn collect(
        &mut self,
        config: &FullConfig,
        search: &Search<'_>,
        features: &FrameFeatures,
        is_candidate: impl Fn(usize) -> bool,
    ) {
        self.pairs.clear();
        self.pairs.reserve(features.len());
        for group in [&mut self.first, &mut self.second, &mut self.trial] {
            group.clear();
            group.reserve(features.len());
        }
        self.sorted.reserve(features.len());
        let pinhole = &search.sensor.pinhole;
        for (i, f) in features.features.iter().enumerate() {
            let Some(z) = f.depth_m.filter(|_| is_candidate(i)) else { continue };
            let Some(found) = search.find(f, &features.descriptors[i]) else { continue };
            if found {
                self.first.push(i as u32);
                continue;
            }
            let here = pinhole.unproject(f64::from(f.u), f64::from(f.v), f64::from(z));
            let place = search.t_earlier_cam * here;
            let [u, v] = pinhole.project(&place.coords).map(|v| v as f32);
            let octaves = f.octave.saturating_sub(1)..=f.octave + 1;
            let (mut best, mut least, mut next) = (None, u32::MAX, u32::MAX);
            search.earlier.for_each_near(u, v, config.second_motion_px, octaves, |j| {
                let distance = features.descriptors[i].distance(&search.earlier.descriptors[j]);
                if distance < least {
                    (best, next, least) = (Some(j), least, distance);
                } else {
                    next = next.min(distance);
                }
            });
            let is_clear = least <= config.displacement_max_bits && least as f32 <= MAX_RATIO * next as f32;
            let Some(other) = best.filter(|_| is_clear).map(|j| &search.earlier.features[j]) else { continue };
            let Some(z) = other.depth_m else { continue };
            self.pairs.push(Pair {
                feature: i as u32,
                here,
                there: pinhole.unproject(f64::from(other.u), f64::from(other.v), f64::from(z)),
                seen: [other.u, other.v],
                radius: config.displacement_px * search.sensor.scale(f.octave),
            });
        }
    }

    /// Fits a rigid motion to as many pairs as possible.
    fn fit(&mut self, search: &Search<'_>) {
        self.second.clear();
        let count = self.pairs.len() as u32;
        for _ in 0..DRAWS {
            let draw: [Pair; 3] = std::array::from_fn(|_| self.pairs[(self.rng.next_u32() % count) as usize]);
            let Some(motion) = rigid_motion(draw.iter()) else { continue };
            self.keep_if_better(search, &motion);
        }
        for _ in 0..2 {
            let fitting = self.pairs.iter().filter(|pair| self.second.binary_search(&pair.feature).is_ok());
            let Some(motion) = rigid_motion(fitting) else { return };
            self.keep_if_better(search, &motion);
        }
    }

    /// Keeps the pairs that fit a motion if they are more than those of the best one so far.
    fn keep_if_better(&mut self, search: &Search<'_>, motion: &Isometry3<f64>) {
        self.trial.clear();
        let pinhole = &search.sensor.pinhole;
        let fits = |pair: &&Pair| {
            let place = motion * pair.here;
            let [u, v] = pinhole.project(&place.coords).map(|v| v as f32);
            let disparity = (pinhole.bf / place.z - pinhole.bf / pair.there.z) as f32;
            place.z > 0.0
                && (u - pair.seen[0]).abs() <= pair.radius
                && (v - pair.seen[1]).abs() <= pair.radius
                && disparity.abs() <= pair.radius
        };
        self.trial.extend(self.pairs.iter().filter(fits).map(|pair| pair.feature));
        if self.trial.len() >= self.second.len() {
            std::mem::swap(&mut self.trial, &mut self.second);
            self.motion = *motion;
        }
    }
}

/// Returns the box and the median depth, m, of features, without the outermost ones; `None` if there are none.
pub(super) fn extent(features: &FrameFeatures, group: &[u32], sorted: &mut Vec<f32>) -> Option<(BoundingBox, f32)> {
    let last = group.len().checked_sub(1)?;
    let mut quantiles = |of: &dyn Fn(&Feature) -> f32, shares: [f32; 2]| {
        sorted.clear();
        sorted.extend(group.iter().map(|&i| of(&features.features[i as usize])));
        sorted.sort_unstable_by(f32::total_cmp);
        shares.map(|share| sorted[(share * last as f32) as usize])
    };
    let [x_min, x_max] = quantiles(&|f| f.raw[0], [0.04, 0.96]);
    let [y_min, y_max] = quantiles(&|f| f.raw[1], [0.04, 0.96]);
    let [depth_m, _] = quantiles(&|f| f.depth_m.unwrap_or(0.0), [0.5; 2]);
    Some((BoundingBox { x_min, y_min, x_max, y_max }, depth_m))
}

/// Returns the rigid motion that brings `here` onto `there` (Umeyama, IEEE TPAMI 1991); `None` if the points lie on a line.
fn rigid_motion<'a>(pairs: impl Iterator<Item = &'a Pair> + Clone) -> Option<Isometry3<f64>> {
    let count = pairs.clone().count().max(1) as f64;
    let mean = |of: &dyn Fn(&Pair) -> Vector3<f64>| pairs.clone().map(of).sum::<Vector3<f64>>() / count;
    let (here, there) = (mean(&|pair| pair.here.coords), mean(&|pair| pair.there.coords));
    let covariance: Matrix3<f64> =
        pairs.clone().map(|pair| (pair.there.coords - there) * (pair.here.coords - here).transpose()).sum();
    let svd = covariance.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    // Two directions must be determined, the third one follows.
    if svd.singular_values[1] < 1e-4 * count {
        return None;
    }
    let sign = (u * v_t).determinant().signum();
    let rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t;
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    Some(Isometry3::from_parts(Translation3::from(there - rotation * here), rotation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::config::Config;
    use crate::context::SensorModel;
    use crate::dynamic::full::displacement::tests::descriptor;

    /// Returns the features of a room 3 m away and, in the middle of the image, of an object 1.5 m away that is shifted by that many pixels.
    fn features(sensor: &SensorModel, shift_px: f32) -> FrameFeatures {
        let mut all = Vec::new();
        for i in 0..480u32 {
            let (u, v) = (12.0 + (i % 30) as f32 * 21.0, 10.0 + (i / 30) as f32 * 29.0);
            let is_object = (200.0..440.0).contains(&u) && (120.0..360.0).contains(&v);
            let (u, z) = if is_object { (u + shift_px, 1.5) } else { (u, 3.0 + 0.01 * (i % 7) as f32) };
            all.push(Feature { raw: [u, v], u, v, octave: 0, angle_rad: 0.0, depth_m: Some(z), trust: 1.0 });
        }
        FrameFeatures::from_parts(all, (0..480).map(descriptor).collect(), sensor.bounds)
    }

    /// Returns what is found when the object has moved by `shift_px`, for a first pose of the camera in the earlier frame, and how many features
    /// of the groups of object and world lie on the object.
    fn found(shift_px: f32, t_earlier_cam: Isometry3<f64>) -> Option<(Found, [usize; 2], Isometry3<f64>)> {
        let (camera, settings) = (Camera::pinhole(640, 480, 520.0, 520.0, 320.0, 240.0), Config::default());
        let (sensor, config) = (SensorModel::new(&camera, &settings, &[1.0]), &settings.dynamic.full);
        let (earlier, now) = (features(&sensor, 0.0), features(&sensor, shift_px));
        let search = Search { config, sensor: &sensor, earlier: &earlier, t_earlier_cam };
        let mut second = SecondMotion::new(0);
        let found = second.search(config, &search, &now, |_| true, |_| false)?;
        let near = |group: &[u32]| group.iter().filter(|i| now.features[**i as usize].depth_m == Some(1.5)).count();
        let (object, world) = second.groups(found);
        Some((found, [near(object), near(world)], second.motion))
    }

    #[test]
    fn an_object_that_moves_is_found_beside_the_world() {
        assert_eq!(found(0.0, Isometry3::identity()), None);
        let (found, [on_object, on_world], _) = found(12.0, Isometry3::identity()).unwrap();
        assert!(!found.pose_follows_object && on_object > 60 && on_world == 0, "{found:?} {on_object} {on_world}");
    }

    #[test]
    fn a_pose_that_follows_the_object_is_found_and_corrected() {
        // So far has the object moved by 12 px at 1.5 m.
        let follows = Isometry3::translation(-12.0 / 520.0 * 1.5, 0.0, 0.0);
        let (found, [on_object, on_world], motion) = found(12.0, follows).unwrap();
        assert!(found.pose_follows_object && on_object > 60 && on_world == 0, "{found:?} {on_object} {on_world}");
        assert!(motion.translation.vector.norm() < 1e-3 && motion.rotation.angle() < 1e-3, "the camera did not move");
    }
}

//! Initialisation without depth: a map from two frames between which the camera has moved enough (ORB-SLAM, IEEE T-RO 2015, section IV).
//!
//! In: consecutive frames with the trust of their features. Out: a [`TwoViewMap`] as soon as two frames determine motion and points. Its unit
//! of length is the median depth of the points in the first frame, because a single camera does not measure the scale.

use std::sync::Arc;

use nalgebra::Point3;

use crate::config::Config;
use crate::context::Context;
use crate::features::matching::RotationHistogram;
use crate::geometry::{Pair, Pose, TwoView, reconstruct};
use crate::image::RgbImage;
use crate::optimize::bundle::{BundleProblem, Observation};
use crate::tracking::TrackedFrame;
use crate::tracking::search::search_first_frame;

/// A frame of the initialisation, and its image.
#[derive(Clone, Debug)]
pub(crate) struct StartFrame {
    /// Frame with its pose.
    pub frame: TrackedFrame,
    /// Colour image.
    pub color: Arc<RgbImage>,
}

/// A landmark: its feature in the first frame, its feature in the second frame, and its position in the world.
pub(super) type StartPoint = (usize, usize, Point3<f64>);

/// An initial map of two frames.
#[derive(Clone, Debug)]
pub(crate) struct TwoViewMap {
    /// First frame, whose camera frame is the world frame.
    pub first: StartFrame,
    /// Second frame.
    pub second: StartFrame,
    /// Landmarks.
    pub points: Vec<StartPoint>,
}

/// Search for two frames from which a map can be initialised.
#[derive(Clone, Debug, Default)]
pub(crate) struct TwoViewInitialiser {
    first: Option<StartFrame>,
    /// Last known position of each feature of the first frame, undistorted px.
    last_positions: Vec<[f32; 2]>,
    rotation: RotationHistogram,
}

impl TwoViewInitialiser {
    /// Removes the first frame.
    pub(crate) fn reset(&mut self) {
        self.first = None;
    }

    /// Tries to initialise a map from the first frame and `current`. If they have too few matches, `current` becomes the first frame.
    pub(crate) fn add(
        &mut self,
        context: &Context,
        current: &TrackedFrame,
        color: &Arc<RgbImage>,
    ) -> Option<TwoViewMap> {
        let Context { sensor, config } = context;
        let c = &config.monocular;
        let Some(first) = &self.first else {
            self.begin(config, current, color);
            return None;
        };
        let matches = search_first_frame(config, &first.frame, current, &mut self.last_positions, &mut self.rotation);
        if matches.len() < c.init_min_matches {
            self.begin(config, current, color);
            return None;
        }
        let at = |frame: &TrackedFrame, i: usize| {
            let f = &frame.features.features[i];
            [f.u, f.v]
        };
        let pairs: Vec<Pair> = matches.iter().map(|&(i, j)| (at(&first.frame, i), at(current, j))).collect();
        let found = reconstruct(&sensor.pinhole, c, config.depth.corner_sigma_px, &pairs);
        let adjusted = match &found {
            Ok(found) => adjust(context, first, current, &matches, found),
            Err(error) => {
                tracing::debug!(matches = matches.len(), %error, "two frames do not determine a map yet");
                None
            }
        };
        let (t_second_first, points) = adjusted?;
        let mut first = self.first.take()?;
        first.frame.t_cam_world = Pose::identity();
        let mut second = StartFrame { frame: current.clone(), color: Arc::clone(color) };
        second.frame.t_cam_world = t_second_first;
        Some(TwoViewMap { first, second, points })
    }

    /// Makes `current` the first frame if it has more static features than the number of matches needed.
    fn begin(&mut self, config: &Config, current: &TrackedFrame, color: &Arc<RgbImage>) {
        let static_features = current.features.features.iter().filter(|f| f.trust > 0.0 && f.octave == 0).count();
        self.first = (static_features > config.monocular.init_min_matches)
            .then(|| StartFrame { frame: current.clone(), color: Arc::clone(color) });
        self.last_positions.clear();
        self.last_positions.extend(current.features.features.iter().map(|f| [f.u, f.v]));
    }
}

/// Refines the two frames by bundle adjustment, then scales all lengths to a median depth of 1. `None` if too few points remain or the
/// direction of the baseline is too uncertain.
fn adjust(
    context: &Context,
    first: &StartFrame,
    current: &TrackedFrame,
    matches: &[(usize, usize)],
    found: &TwoView,
) -> Option<(Pose, Vec<StartPoint>)> {
    let Context { sensor, config } = context;
    let mut problem = BundleProblem {
        camera: sensor.pinhole,
        poses: vec![found.t_second_first, Pose::identity()],
        free_poses: 1,
        points: Vec::new(),
        observations: Vec::new(),
    };
    let mut features = Vec::new();
    for (&(i, j), point) in matches.iter().zip(&found.points).filter_map(|(m, p)| Some((m, (*p)?))) {
        let number = problem.points.len();
        problem.points.push(point);
        for (pose, feature) in [(0, &current.features.features[j]), (1, &first.frame.features.features[i])] {
            let (measurement, trust) = (sensor.measurement(feature), f64::from(feature.trust));
            problem.observations.push(Observation { pose, point: number, measurement, trust });
        }
        features.push((i, j));
    }
    problem.solve(&config.bundle, config.monocular.init_bundle_iterations, true);
    problem.drop_outliers();
    let sigma_deg = problem.two_view_sigma().to_degrees();
    let min_parallax = config.monocular.init_min_parallax_deg.to_radians();
    let second_center = problem.poses[0].inverse_transform_point(&Point3::origin());
    let fits = |number: usize| {
        let point = problem.points[number];
        let is_inlier = problem.observations[2 * number..2 * number + 2].iter().all(|o| o.trust > 0.0);
        is_inlier && point.coords.angle(&(point - second_center)) >= min_parallax
    };
    let kept: Vec<usize> = (0..features.len()).filter(|&number| fits(number)).collect();
    tracing::debug!(model = ?found.model, points = kept.len(), sigma_deg, "two frames determine motion and points");
    if kept.len() < config.tracking.init_min_landmarks || sigma_deg > config.monocular.init_max_sigma_deg {
        return None;
    }
    let mut depths: Vec<f64> = kept.iter().map(|&number| problem.points[number].z).collect();
    let middle = depths.len() / 2;
    let median = *depths.select_nth_unstable_by(middle, f64::total_cmp).1;
    let mut t_second_first = problem.poses[0];
    t_second_first.translation.vector /= median;
    let scaled = |number: usize| Point3::from(problem.points[number].coords / median);
    Some((
        t_second_first,
        kept.iter().map(|&number| (features[number].0, features[number].1, scaled(number))).collect(),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::context::SensorModel;
    use crate::features::{Descriptor, Feature, FrameFeatures, ImageBounds};
    use nalgebra::Vector3;

    fn context() -> Context {
        Context { sensor: crate::map::scene::Scene::new().sensor, config: Config::default() }
    }

    /// Returns the frame of a camera at `t_cam_world` that observes 300 points, beginning with number `from`.
    fn frame(sensor: &SensorModel, t_cam_world: &Pose, from: usize) -> TrackedFrame {
        let (mut features, mut descriptors) = (Vec::new(), Vec::new());
        for number in from..from + 300 {
            let (u, v) = (20.0 + 30.0 * (number % 20) as f64, 20.0 + 30.0 * (number / 20 % 15) as f64);
            let p = t_cam_world * sensor.pinhole.unproject(u, v, 2.0 + 2.0 * ((number * 37 % 101) as f64 / 101.0));
            let [u, v] = sensor.pinhole.project(&p.coords).map(|x| x as f32);
            features.push(Feature { raw: [u, v], u, v, octave: 0, angle_rad: 0.0, depth_m: None, trust: 1.0 });
            let hash = |k: u64| (number as u64 * 4 + k).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            descriptors
                .push(Descriptor([0, 1, 2, 3].map(|k| hash(k) ^ (hash(k) >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9))));
        }
        let bounds = ImageBounds { u_min: 0.0, u_max: 640.0, v_min: 0.0, v_max: 480.0 };
        let mut frame = TrackedFrame::default();
        frame.features = FrameFeatures::from_parts(features, descriptors, bounds);
        frame
    }

    fn initialise(context: &Context, poses: &[(Pose, usize)]) -> Vec<Option<TwoViewMap>> {
        let mut initialiser = TwoViewInitialiser::default();
        let add = |(pose, from): &(Pose, usize)| {
            initialiser.add(context, &frame(&context.sensor, pose, *from), &Arc::default())
        };
        poses.iter().map(add).collect()
    }

    #[test]
    fn two_views_initialise_a_map_with_median_depth_one() {
        let context = context();
        let motion = Pose::new(Vector3::new(-0.25, 0.02, 0.05), Vector3::new(0.01, 0.03, 0.0));
        let mut starts = initialise(&context, &[(Pose::identity(), 0), (motion, 0)]);
        let start = starts.pop().flatten().unwrap();
        assert!(starts[0].is_none() && start.points.len() > 250, "{}", start.points.len());
        let mut depths: Vec<f64> = start.points.iter().map(|(.., p)| p.z).collect();
        depths.sort_by(f64::total_cmp);
        assert!((depths[depths.len() / 2] - 1.0).abs() < 1e-9);
        let found = start.second.frame.t_cam_world;
        assert!(found.rotation.angle_to(&motion.rotation) < 1e-3);
        assert!(found.translation.vector.angle(&motion.translation.vector) < 5e-3);
        // Depths are from 2 to 4: the median is 3 of the true unit.
        let scale = motion.translation.vector.norm() / found.translation.vector.norm();
        assert!((scale - 3.0).abs() < 0.1, "{scale}");
        assert!(start.points.iter().all(|(i, j, _)| i == j));
    }

    #[test]
    fn a_frame_with_other_points_becomes_the_first() {
        let context = context();
        let moved = |x: f64| Pose::translation(x, 0.0, 0.0);
        let starts = initialise(&context, &[(moved(0.0), 0), (moved(0.0), 1000), (moved(-0.25), 1000)]);
        assert_eq!(starts.iter().map(Option::is_some).collect::<Vec<_>>(), [false, false, true]);
    }

    #[test]
    fn a_short_and_uncertain_motion_initialises_no_map() {
        let context = context();
        let starts = initialise(&context, &[(Pose::identity(), 0), (Pose::translation(-0.02, 0.0, 0.0), 0)]);
        assert!(starts.iter().all(Option::is_none));
    }
}

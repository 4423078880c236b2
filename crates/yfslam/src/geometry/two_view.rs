//! Motion and structure from two images (ORB-SLAM, IEEE T-RO 2015, section IV).
//!
//! In: positions of the same points in two images of a calibrated camera. Out: the motion between them up to the length of its baseline,
//! and the points; or the reason why they are not certain. RANSAC estimates a homography, for planar scenes, and a fundamental matrix, for
//! all others. The model with the higher score gives several motions, of which one must have clearly more inliers than the others.

use nalgebra::{Matrix3, Point3, Vector3};
use rand_pcg::Pcg32;
use rand_pcg::rand_core::Rng;

use super::fundamental::{Pair, eight_point, epipolar_distance};
use super::homography::{homography, motions_of_homography, transfer_distance2};
use super::{CHI2_LINE, CHI2_PIXEL, Pinhole, Pose, midpoint, motions_of_essential};
use crate::config::MonocularConfig;

/// Pairs needed by the eight-point algorithm, and drawn in each iteration.
const SAMPLE_PAIRS: usize = 8;
/// Pairs of a sample that determine a homography.
const PLANE_PAIRS: usize = 4;
/// Stream of the random numbers.
const STREAM: u64 = 0x2_71e5;

/// Model that explains the pairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Model {
    /// Homography: a planar scene, or little parallax.
    Plane,
    /// Fundamental matrix: any other scene.
    General,
}

/// Reconstruction from two images.
#[derive(Clone, Debug)]
pub(crate) struct TwoView {
    /// Motion that maps points of the first camera into the second; its baseline has length 1.
    pub t_second_first: Pose,
    /// Point of each pair in the frame of the first camera, in baselines; `None` for outliers. Points with little parallax are included,
    /// although their depth is uncertain.
    pub points: Vec<Option<Point3<f64>>>,
    /// Model with the higher score.
    pub model: Model,
}

/// Reason why two images give no certain reconstruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum ReconstructionError {
    /// There are fewer pairs than a model needs, or no pair is an inlier.
    #[error("no model fits the matches")]
    NoModel,
    /// Too few inliers of the model are inliers of a motion.
    #[error("the best motion has {inliers} inliers of {of} points")]
    TooFewInliers {
        /// Inliers of the best motion.
        inliers: usize,
        /// Inliers of the model.
        of: usize,
    },
    /// A second motion has nearly as many inliers: the camera has hardly moved, or the two views of a plane allow both.
    #[error("two motions have {inliers} and {second} inliers")]
    Ambiguous {
        /// Inliers of the best motion.
        inliers: usize,
        /// Inliers of the second motion.
        second: usize,
    },
    /// Too few points have parallax: the camera has hardly moved, or only turned.
    #[error("only {with_parallax} points have parallax")]
    LittleParallax {
        /// Points with parallax.
        with_parallax: usize,
    },
}

/// Reconstructs the motion between two images and the points. Positions are undistorted px with a standard deviation of `sigma_px`.
///
/// # Errors
/// If the pairs give no certain reconstruction.
pub(crate) fn reconstruct(
    camera: &Pinhole,
    config: &MonocularConfig,
    sigma_px: f64,
    pairs: &[Pair],
) -> Result<TwoView, ReconstructionError> {
    let variance = sigma_px * sigma_px;
    let models = ransac(config, variance, pairs);
    let (plane_score, general_score) = (models.plane.score, models.general.score);
    if plane_score + general_score <= 0.0 {
        return Err(ReconstructionError::NoModel);
    }
    let k = Matrix3::new(camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0);
    let (model, motions, inliers) = if plane_score > config.plane_share * (plane_score + general_score) {
        let inliers = models.plane.inliers(pairs, variance);
        let rays = k.try_inverse().ok_or(ReconstructionError::NoModel)? * models.plane.matrix * k;
        (Model::Plane, motions_of_homography(&with_positive_depths(rays, camera, &inliers)), inliers)
    } else {
        let inliers = models.general.inliers(pairs, variance);
        (Model::General, motions_of_essential(&(k.transpose() * models.general.matrix * k)), inliers)
    };
    let evaluate = |motion: &Pose| Hypothesis::evaluate(camera, config, variance, *motion, pairs, &inliers);
    let mut hypotheses: Vec<Hypothesis> = motions.iter().map(evaluate).collect();
    hypotheses.sort_by_key(|h| std::cmp::Reverse(h.inliers));
    let (of, second) = (inliers.iter().flatten().count(), hypotheses.get(1).map_or(0, |h| h.inliers));
    let Some(Hypothesis { motion, points, inliers, with_parallax }) = hypotheses.into_iter().next() else {
        return Err(ReconstructionError::NoModel);
    };
    if (inliers as f64) < config.init_min_inlier_share * of as f64 {
        Err(ReconstructionError::TooFewInliers { inliers, of })
    } else if second as f64 > config.init_max_rival_share * inliers as f64 {
        Err(ReconstructionError::Ambiguous { inliers, second })
    } else if with_parallax < config.init_min_points {
        Err(ReconstructionError::LittleParallax { with_parallax })
    } else {
        Ok(TwoView { t_second_first: motion, points, model })
    }
}

/// Chooses the sign of a homography of rays for which the inliers lie in front of both cameras.
fn with_positive_depths(rays: Matrix3<f64>, camera: &Pinhole, inliers: &[Option<Pair>]) -> Matrix3<f64> {
    let agree = |(first, second): &Pair| ray(camera, second).dot(&(rays * ray(camera, first))).signum();
    let sum: f64 = inliers.iter().flatten().map(agree).sum();
    if sum < 0.0 { -rays } else { rays }
}

fn ray(camera: &Pinhole, [u, v]: &[f32; 2]) -> Vector3<f64> {
    camera.unproject(f64::from(*u), f64::from(*v), 1.0).coords
}

/// A homography or a fundamental matrix with its inverse or transpose and its score.
#[derive(Clone, Copy)]
struct Candidate {
    model: Model,
    matrix: Matrix3<f64>,
    /// Model from the second image to the first.
    backward: Matrix3<f64>,
    score: f64,
}

/// Best candidate of each model.
struct Models {
    plane: Candidate,
    general: Candidate,
}

/// Estimates both models from random samples of eight pairs, of which the first four determine the homography. The best candidate of each
/// is then fitted to all its inliers.
fn ransac(config: &MonocularConfig, variance: f64, pairs: &[Pair]) -> Models {
    let mut models = Models { plane: Candidate::empty(Model::Plane), general: Candidate::empty(Model::General) };
    if pairs.len() < SAMPLE_PAIRS {
        return models;
    }
    // The generator is seeded in each call, so that a result depends on its input only.
    let mut rng = Pcg32::new(config.seed, STREAM);
    for _ in 0..config.init_ransac_iterations {
        let sample: [Pair; SAMPLE_PAIRS] =
            std::array::from_fn(|_| pairs[((u64::from(rng.next_u32()) * pairs.len() as u64) >> 32) as usize]);
        models.plane.replace_if_better(homography(sample[..PLANE_PAIRS].iter().copied()), pairs, variance);
        models.general.replace_if_better(eight_point(sample.iter().copied()), pairs, variance);
    }
    let (on_plane, general) = (models.plane.inliers(pairs, variance), models.general.inliers(pairs, variance));
    models.plane.replace_if_better(homography(on_plane.iter().flatten().copied()), pairs, variance);
    models.general.replace_if_better(eight_point(general.iter().flatten().copied()), pairs, variance);
    models
}

impl Candidate {
    fn empty(model: Model) -> Self {
        Self { model, matrix: Matrix3::zeros(), backward: Matrix3::zeros(), score: 0.0 }
    }

    /// Replaces the matrix by another one if that has a higher score.
    fn replace_if_better(&mut self, matrix: Option<Matrix3<f64>>, pairs: &[Pair], variance: f64) {
        let Some(matrix) = matrix else { return };
        let backward = match self.model {
            Model::Plane => matrix.try_inverse(),
            Model::General => Some(matrix.transpose()),
        };
        let Some(backward) = backward else { return };
        let mut other = Self { model: self.model, matrix, backward, score: 0.0 };
        other.score = pairs.iter().map(|pair| other.pair_score(pair, variance).unwrap_or(0.0)).sum();
        if other.score > self.score {
            *self = other;
        }
    }

    /// Returns what a pair adds to the score (equation 2 of the paper, in both directions); `None` for an outlier.
    fn pair_score(&self, pair: &Pair, variance: f64) -> Option<f64> {
        let swapped = (pair.1, pair.0);
        let [forward, backward] = match self.model {
            Model::Plane => [transfer_distance2(&self.matrix, pair), transfer_distance2(&self.backward, &swapped)],
            Model::General => {
                [epipolar_distance(&self.matrix, pair).powi(2), epipolar_distance(&self.backward, &swapped).powi(2)]
            }
        }
        .map(|distance2| distance2 / variance);
        let limit = match self.model {
            Model::Plane => CHI2_PIXEL,
            Model::General => CHI2_LINE,
        };
        (forward < limit && backward < limit).then_some(2.0 * CHI2_PIXEL - forward - backward)
    }

    /// Returns the inliers at their indices, `None` for outliers.
    fn inliers(&self, pairs: &[Pair], variance: f64) -> Vec<Option<Pair>> {
        pairs.iter().map(|pair| self.pair_score(pair, variance).map(|_| *pair)).collect()
    }
}

/// A motion and its inliers.
struct Hypothesis {
    motion: Pose,
    /// Points in front of both cameras that project to their measured positions; `None` for outliers.
    points: Vec<Option<Point3<f64>>>,
    /// Number of points.
    inliers: usize,
    /// Number of points with parallax.
    with_parallax: usize,
}

impl Hypothesis {
    /// Triangulates the pairs with a motion.
    fn evaluate(
        camera: &Pinhole,
        config: &MonocularConfig,
        variance: f64,
        motion: Pose,
        pairs: &[Pair],
        model_inliers: &[Option<Pair>],
    ) -> Self {
        let min_parallax = config.init_min_parallax_deg.to_radians();
        let t_first_second = motion.inverse();
        let projects_to = |p: Vector3<f64>, measured: &[f32; 2]| {
            let [u, v] = camera.project(&p);
            let error2 = (u - f64::from(measured[0])).powi(2) + (v - f64::from(measured[1])).powi(2);
            p.z > 0.0 && error2 <= CHI2_PIXEL * variance
        };
        let mut with_parallax = 0;
        let mut point_of = |pair: &Pair| {
            let (a, b) = (ray(camera, &pair.0), t_first_second.rotation * ray(camera, &pair.1));
            let point = midpoint(&Vector3::zeros(), &a, &t_first_second.translation.vector, &b)?;
            let fits = projects_to(point.coords, &pair.0) && projects_to((motion * point).coords, &pair.1);
            with_parallax += usize::from(fits && a.angle(&b) >= min_parallax);
            fits.then_some(point)
        };
        let points: Vec<Option<Point3<f64>>> = pairs
            .iter()
            .zip(model_inliers)
            .map(|(pair, inlier)| inlier.as_ref().and_then(|_| point_of(pair)))
            .collect();
        let inliers = points.iter().flatten().count();
        Self { motion, points, inliers, with_parallax }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const CAMERA: Pinhole = Pinhole { fx: 500.0, fy: 500.0, cx: 320.0, cy: 240.0, bf: 40.0 };

    /// Projects points into both cameras; returns the pairs and points that lie in both images.
    fn observe(motion: &Pose, points: &[Point3<f64>]) -> (Vec<Pair>, Vec<Point3<f64>>) {
        let project = |p: &Point3<f64>| {
            let [u, v] = CAMERA.project(&p.coords);
            let inside = p.z > 0.2 && (0.0..640.0).contains(&u) && (0.0..480.0).contains(&v);
            inside.then_some([u as f32, v as f32])
        };
        points.iter().filter_map(|p| Some(((project(p)?, project(&(motion * p))?), *p))).unzip()
    }

    /// Returns points on the rays through a grid of pixels, at the depths that `depth` returns.
    fn scene(depth: impl Fn(f64, f64, usize) -> f64) -> Vec<Point3<f64>> {
        let grid = (0..15).flat_map(|row| (0..20).map(move |column| (column, row)));
        grid.enumerate()
            .map(|(i, (column, row))| {
                let (u, v) = (16.0 + 32.0 * f64::from(column), 16.0 + 32.0 * f64::from(row));
                CAMERA.unproject(u, v, depth((u - 320.0) / 500.0, (v - 240.0) / 500.0, i))
            })
            .collect()
    }

    /// Returns a scene with irregular depths between 1.5 and 4.5.
    fn room() -> Vec<Point3<f64>> {
        scene(|_, _, i| 1.5 + 3.0 * ((i * 37 % 101) as f64 / 101.0))
    }

    /// Replaces every fourth pair by a wrong match.
    fn with_outliers(mut pairs: Vec<Pair>) -> Vec<Pair> {
        for (i, pair) in pairs.iter_mut().enumerate().step_by(4) {
            pair.1[0] += 20.0 + (i * 13 % 60) as f32;
            pair.1[1] -= 60.0 - (i * 29 % 110) as f32;
        }
        pairs
    }

    /// Adds noise of half a pixel, the same in every test.
    fn with_noise(mut pairs: Vec<Pair>) -> Vec<Pair> {
        let mut rng = Pcg32::new(3, 4);
        for value in pairs.iter_mut().flat_map(|(a, b)| a.iter_mut().chain(b)) {
            let uniform = || f64::from(rng.next_u32()) / f64::from(u32::MAX) - 0.5;
            *value += std::iter::repeat_with(uniform).take(4).sum::<f64>() as f32 * 0.87;
        }
        pairs
    }

    /// Returns the matrix that maps pixels of the first camera to epipolar lines of the second.
    fn fundamental(motion: &Pose) -> Matrix3<f64> {
        let inverse = Matrix3::new(500.0, 0.0, 320.0, 0.0, 500.0, 240.0, 0.0, 0.0, 1.0).try_inverse().unwrap();
        let essential = motion.translation.vector.cross_matrix() * motion.rotation.to_rotation_matrix().matrix();
        inverse.transpose() * essential * inverse
    }

    /// Returns the errors of the direction of a baseline and of a rotation, rad.
    fn errors(found: &Pose, truth: &Pose) -> (f64, f64) {
        (found.translation.vector.angle(&truth.translation.vector), found.rotation.angle_to(&truth.rotation))
    }

    fn reconstruct_default(pairs: &[Pair]) -> Result<TwoView, ReconstructionError> {
        reconstruct(&CAMERA, &MonocularConfig::default(), 1.0, pairs)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn a_room_is_reconstructed_up_to_scale(
            shift in prop::array::uniform3(-0.3f64..0.3),
            turn in prop::array::uniform3(-0.1f64..0.1),
        ) {
            prop_assume!(shift[0].hypot(shift[1]) > 0.15);
            let motion = Pose::new(shift.into(), turn.into());
            let (correct, points) = observe(&motion, &room());
            let baseline = motion.translation.vector.norm();
            // Wrong matches that lie on their epipolar line by chance disturb the result, and more so with a short baseline.
            for (pairs, limit) in [(correct.clone(), 1e-3), (with_outliers(correct.clone()), 0.008 / baseline)] {
                let found = reconstruct_default(&pairs);
                prop_assert!(found.is_ok(), "{found:?}");
                let found = found.unwrap();
                prop_assert_eq!(found.model, Model::General);
                let (direction, rotation) = errors(&found.t_second_first, &motion);
                prop_assert!(direction < limit && rotation < 0.3 * limit, "{} {}", direction, rotation);
                let relative_error = |p: &Point3<f64>, truth: &Point3<f64>| (p.coords * baseline - truth.coords).norm() / truth.z;
                let (mut accurate, mut accepted) = (0, 0);
                for (i, (p, truth)) in found.points.iter().zip(&points).enumerate() {
                    let Some(p) = p else { continue };
                    if pairs[i] == correct[i] {
                        accepted += 1;
                        // The error of the motion adds to that of a point; that of the rotation grows with the distance.
                        let limit = 0.05 + direction + rotation * truth.z / baseline;
                        accurate += usize::from(relative_error(p, truth) < limit);
                    } else {
                        // Two images cannot reject a wrong match that lies on its epipolar line.
                        let limit_px = 3.0 + CAMERA.fx * (direction + rotation);
                        prop_assert!(epipolar_distance(&fundamental(&motion), &pairs[i]) < limit_px);
                    }
                }
                prop_assert!(accurate * 20 >= accepted * 19 && accurate > 100, "{} of {}", accurate, accepted);
            }
        }

        #[test]
        fn a_plane_is_reconstructed_correctly_or_refused(
            shift in prop::array::uniform3(-0.6f64..0.6),
            turn in prop::array::uniform3(-0.1f64..0.1),
            slope in prop::array::uniform2(-0.6f64..0.6),
        ) {
            prop_assume!(Vector3::from(shift).norm() > 0.3);
            let motion = Pose::new(shift.into(), turn.into());
            let (pairs, _) = observe(&motion, &scene(|x, y, _| 2.0 / (1.0 + slope[0] * x + slope[1] * y)));
            prop_assume!(pairs.len() > 120);
            for pairs in [pairs.clone(), with_outliers(pairs)] {
                match reconstruct_default(&pairs) {
                    Ok(found) => {
                        prop_assert_eq!(found.model, Model::Plane);
                        let (direction, rotation) = errors(&found.t_second_first, &motion);
                        prop_assert!(direction < 0.03 && rotation < 0.01, "{} {}", direction, rotation);
                    }
                    Err(error) => prop_assert!(!matches!(error, ReconstructionError::NoModel), "{}", error),
                }
            }
        }

        #[test]
        fn a_camera_that_only_turns_is_refused(turn in prop::array::uniform3(-0.15f64..0.15)) {
            let motion = Pose::new(Vector3::zeros(), turn.into());
            let (pairs, _) = observe(&motion, &room());
            for pairs in [pairs.clone(), with_outliers(pairs.clone()), with_noise(pairs)] {
                let found = reconstruct_default(&pairs);
                prop_assert!(found.is_err(), "{found:?}");
            }
        }
    }

    #[test]
    fn a_tilted_plane_is_reconstructed_with_a_long_baseline() {
        let motion = Pose::new(Vector3::new(-0.7, 0.1, 0.2), Vector3::new(0.0, 0.3, 0.05));
        let (pairs, points) = observe(&motion, &scene(|x, y, _| 2.0 / (1.0 + 0.5 * x - 0.3 * y)));
        let found = reconstruct_default(&with_noise(pairs)).unwrap();
        assert_eq!(found.model, Model::Plane);
        let (direction, rotation) = errors(&found.t_second_first, &motion);
        assert!(direction < 0.02 && rotation < 0.01, "{direction} {rotation}");
        assert!(found.points.iter().flatten().count() * 10 > points.len() * 9);
    }

    #[test]
    fn a_room_is_reconstructed_despite_noise() {
        let motion = Pose::new(Vector3::new(0.3, 0.0, -0.1), Vector3::new(0.02, 0.05, 0.0));
        let found = reconstruct_default(&with_noise(with_outliers(observe(&motion, &room()).0))).unwrap();
        let (direction, rotation) = errors(&found.t_second_first, &motion);
        assert!(direction < 0.05 && rotation < 0.01, "{direction} {rotation}");
    }

    #[test]
    fn too_few_pairs_are_refused() {
        assert_eq!(reconstruct_default(&[([1.0, 2.0], [3.0, 4.0]); 7]).unwrap_err(), ReconstructionError::NoModel);
        assert!(reconstruct_default(&[([1.0, 2.0], [3.0, 4.0]); 60]).is_err());
    }
}

//! Motion and structure from two pictures (ORB-SLAM, IEEE T-RO 2015, section IV).
//!
//! In: positions of the same points in two pictures of a calibrated camera. Out: the motion between them up to its length, and the points;
//! or why there are none. A homography, for planes, and a fundamental matrix, for all else, are sought side by side; the one that explains
//! more proposes motions, of which one must clearly be right.

use nalgebra::{Matrix3, Point3, Vector3};
use rand_pcg::Pcg32;
use rand_pcg::rand_core::Rng;

use super::fundamental::{Pair, eight_point, epipolar_distance};
use super::homography::{homography, motions_of_homography, transfer_distance2};
use super::{Pinhole, Pose, midpoint, motions_of_essential};
use crate::config::MonocularConfig;
use crate::optimize::residual::CHI2_PIXEL;

/// χ² with one degree of freedom: limit for the distance from an epipolar line.
const CHI2_LINE: f64 = 3.84;

/// What the points look like to two cameras.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Model {
    /// A plane, or so little parallax that it might be one.
    Plane,
    /// Anything else.
    General,
}

/// Two pictures that were understood.
#[derive(Clone, Debug)]
pub(crate) struct TwoView {
    /// Maps points of the first camera into the second; the baseline has length 1.
    pub t_second_first: Pose,
    /// The point of each pair in the frame of the first camera, in baselines; `None` for those that do not fit. Points with little parallax
    /// are among them, however badly that fixes their depth.
    pub points: Vec<Option<Point3<f64>>>,
    /// Which model explained the pairs.
    pub model: Model,
}

/// Why two pictures were not understood.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Refused {
    /// Fewer pairs than a model needs, or none that fit one.
    #[error("no model fits the matches")]
    NoModel,
    /// Points that are explained by the model, but by no motion.
    #[error("the best motion explains {fitting} of {of} points")]
    Contradicted {
        /// Points that fit the motion.
        fitting: usize,
        /// Points that fit the model.
        of: usize,
    },
    /// Another motion explains as much: the camera has hardly moved, or the two views of a plane leave it open.
    #[error("two motions explain {fitting} and {rival} points")]
    Ambiguous {
        /// Points of the best motion.
        fitting: usize,
        /// Points of the second.
        rival: usize,
    },
    /// Too few points with parallax: the camera has hardly moved, or only turned.
    #[error("only {with_parallax} points have parallax")]
    LittleParallax {
        /// Their number.
        with_parallax: usize,
    },
}

/// The motion between two pictures and the points that both show. Positions are undistorted px with a standard deviation of `sigma_px`.
///
/// # Errors
/// [`Refused`] if the pairs do not tell for certain.
pub(crate) fn reconstruct(
    camera: &Pinhole,
    config: &MonocularConfig,
    sigma_px: f64,
    pairs: &[Pair],
) -> Result<TwoView, Refused> {
    let variance = sigma_px * sigma_px;
    let models = ransac(config, variance, pairs);
    let (plane_score, general_score) = (models.plane.score, models.general.score);
    if plane_score + general_score <= 0.0 {
        return Err(Refused::NoModel);
    }
    let k = Matrix3::new(camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0);
    let (model, motions, fits) = if plane_score > config.plane_share * (plane_score + general_score) {
        let fits = models.plane.fits(pairs, variance);
        let rays = k.try_inverse().ok_or(Refused::NoModel)? * models.plane.matrix * k;
        (Model::Plane, motions_of_homography(&facing(rays, camera, &fits)), fits)
    } else {
        let fits = models.general.fits(pairs, variance);
        (Model::General, motions_of_essential(&(k.transpose() * models.general.matrix * k)), fits)
    };
    let judge = |motion: &Pose| Hypothesis::of(camera, config, variance, *motion, pairs, &fits);
    let mut hypotheses: Vec<Hypothesis> = motions.iter().map(judge).collect();
    hypotheses.sort_by_key(|h| std::cmp::Reverse(h.fitting));
    let (of, rival) = (fits.iter().flatten().count(), hypotheses.get(1).map_or(0, |h| h.fitting));
    let Some(Hypothesis { motion, points, fitting, with_parallax }) = hypotheses.into_iter().next() else {
        return Err(Refused::NoModel);
    };
    if (fitting as f64) < config.init_min_inlier_share * of as f64 {
        Err(Refused::Contradicted { fitting, of })
    } else if rival as f64 > config.init_max_rival_share * fitting as f64 {
        Err(Refused::Ambiguous { fitting, rival })
    } else if with_parallax < config.init_min_points {
        Err(Refused::LittleParallax { with_parallax })
    } else {
        Ok(TwoView { t_second_first: motion, points, model })
    }
}

/// The homography of rays with the sign that keeps what is seen in front of both cameras.
fn facing(rays: Matrix3<f64>, camera: &Pinhole, fits: &[Option<Pair>]) -> Matrix3<f64> {
    let agree = |(first, second): &Pair| ray(camera, second).dot(&(rays * ray(camera, first))).signum();
    let sum: f64 = fits.iter().flatten().map(agree).sum();
    if sum < 0.0 { -rays } else { rays }
}

fn ray(camera: &Pinhole, [u, v]: &[f32; 2]) -> Vector3<f64> {
    camera.unproject(f64::from(*u), f64::from(*v), 1.0).coords
}

/// A homography or a fundamental matrix, with its inverse or transpose and what speaks for it.
#[derive(Clone, Copy)]
struct Candidate {
    kind: Model,
    matrix: Matrix3<f64>,
    back: Matrix3<f64>,
    score: f64,
}

/// The best of both models.
struct Models {
    plane: Candidate,
    general: Candidate,
}

/// Draws eight pairs at a time for the fundamental matrix, of which four do for the homography; the best of each is fitted once more to
/// all that agree with it.
fn ransac(config: &MonocularConfig, variance: f64, pairs: &[Pair]) -> Models {
    let mut models = Models { plane: Candidate::none(Model::Plane), general: Candidate::none(Model::General) };
    if pairs.len() < 8 {
        return models;
    }
    // Seeded anew for each call: a result depends on its input alone.
    let mut rng = Pcg32::new(config.seed, 0x2_71e5);
    for _ in 0..config.init_ransac_iterations {
        let picked: [Pair; 8] =
            std::array::from_fn(|_| pairs[((u64::from(rng.next_u32()) * pairs.len() as u64) >> 32) as usize]);
        models.plane.challenge(homography(picked[..4].iter().copied()), pairs, variance);
        models.general.challenge(eight_point(picked.iter().copied()), pairs, variance);
    }
    let agreeing = |candidate: &Candidate| candidate.fits(pairs, variance);
    let (on_plane, general) = (agreeing(&models.plane), agreeing(&models.general));
    models.plane.challenge(homography(on_plane.iter().flatten().copied()), pairs, variance);
    models.general.challenge(eight_point(general.iter().flatten().copied()), pairs, variance);
    models
}

impl Candidate {
    fn none(kind: Model) -> Self {
        Self { kind, matrix: Matrix3::zeros(), back: Matrix3::zeros(), score: 0.0 }
    }

    /// Takes another matrix in its place if that explains more.
    fn challenge(&mut self, matrix: Option<Matrix3<f64>>, pairs: &[Pair], variance: f64) {
        let Some(matrix) = matrix else { return };
        let back = match self.kind {
            Model::Plane => matrix.try_inverse(),
            Model::General => Some(matrix.transpose()),
        };
        let Some(back) = back else { return };
        let mut other = Self { kind: self.kind, matrix, back, score: 0.0 };
        other.score = pairs.iter().map(|pair| other.gain(pair, variance).unwrap_or(0.0)).sum();
        if other.score > self.score {
            *self = other;
        }
    }

    /// What a pair adds to the score (equation 2 of the paper, both ways); `None` if it does not fit.
    fn gain(&self, pair: &Pair, variance: f64) -> Option<f64> {
        let turned = (pair.1, pair.0);
        let [there, back] = match self.kind {
            Model::Plane => [transfer_distance2(&self.matrix, pair), transfer_distance2(&self.back, &turned)],
            Model::General => {
                [epipolar_distance(&self.matrix, pair).powi(2), epipolar_distance(&self.back, &turned).powi(2)]
            }
        }
        .map(|distance2| distance2 / variance);
        let limit = match self.kind {
            Model::Plane => CHI2_PIXEL,
            Model::General => CHI2_LINE,
        };
        (there < limit && back < limit).then_some(2.0 * CHI2_PIXEL - there - back)
    }

    /// The pairs that fit, at their places.
    fn fits(&self, pairs: &[Pair], variance: f64) -> Vec<Option<Pair>> {
        pairs.iter().map(|pair| self.gain(pair, variance).map(|_| *pair)).collect()
    }
}

/// A motion, and the points that speak for it.
struct Hypothesis {
    motion: Pose,
    /// Points that fit it: they lie before both cameras and where they were seen.
    points: Vec<Option<Point3<f64>>>,
    /// Their number.
    fitting: usize,
    /// The number of those that have parallax.
    with_parallax: usize,
}

impl Hypothesis {
    fn of(
        camera: &Pinhole,
        config: &MonocularConfig,
        variance: f64,
        motion: Pose,
        pairs: &[Pair],
        fits: &[Option<Pair>],
    ) -> Self {
        let min_parallax = config.init_min_parallax_deg.to_radians();
        let t_first_second = motion.inverse();
        let is_seen_at = |p: Vector3<f64>, seen: &[f32; 2]| {
            let [u, v] = camera.project(&p);
            let error2 = (u - f64::from(seen[0])).powi(2) + (v - f64::from(seen[1])).powi(2);
            p.z > 0.0 && error2 <= CHI2_PIXEL * variance
        };
        let mut with_parallax = 0;
        let mut point_of = |pair: &Pair| {
            let (a, b) = (ray(camera, &pair.0), t_first_second.rotation * ray(camera, &pair.1));
            let point = midpoint(&Vector3::zeros(), &a, &t_first_second.translation.vector, &b)?;
            let fits = is_seen_at(point.coords, &pair.0) && is_seen_at((motion * point).coords, &pair.1);
            with_parallax += usize::from(fits && a.angle(&b) >= min_parallax);
            fits.then_some(point)
        };
        let points: Vec<Option<Point3<f64>>> =
            pairs.iter().zip(fits).map(|(pair, fits)| fits.as_ref().and_then(|_| point_of(pair))).collect();
        let fitting = points.iter().flatten().count();
        Self { motion, points, fitting, with_parallax }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const CAMERA: Pinhole = Pinhole { fx: 500.0, fy: 500.0, cx: 320.0, cy: 240.0, bf: 40.0 };

    /// What both cameras see of the points, and the points that both see.
    fn shown(motion: &Pose, points: &[Point3<f64>]) -> (Vec<Pair>, Vec<Point3<f64>>) {
        let seen = |p: &Point3<f64>| {
            let [u, v] = CAMERA.project(&p.coords);
            let inside = p.z > 0.2 && (0.0..640.0).contains(&u) && (0.0..480.0).contains(&v);
            inside.then_some([u as f32, v as f32])
        };
        points.iter().filter_map(|p| Some(((seen(p)?, seen(&(motion * p))?), *p))).unzip()
    }

    /// Points on rays through a grid of pixels, at the depths that `depth` gives.
    fn scene(depth: impl Fn(f64, f64, usize) -> f64) -> Vec<Point3<f64>> {
        let grid = (0..15).flat_map(|row| (0..20).map(move |column| (column, row)));
        grid.enumerate()
            .map(|(i, (column, row))| {
                let (u, v) = (16.0 + 32.0 * f64::from(column), 16.0 + 32.0 * f64::from(row));
                CAMERA.unproject(u, v, depth((u - 320.0) / 500.0, (v - 240.0) / 500.0, i))
            })
            .collect()
    }

    /// A room: depths between 1.5 and 4.5 in no order.
    fn room() -> Vec<Point3<f64>> {
        scene(|_, _, i| 1.5 + 3.0 * ((i * 37 % 101) as f64 / 101.0))
    }

    /// Every fourth pair is a wrong match.
    fn with_outliers(mut pairs: Vec<Pair>) -> Vec<Pair> {
        for (i, pair) in pairs.iter_mut().enumerate().step_by(4) {
            pair.1[0] += 20.0 + (i * 13 % 60) as f32;
            pair.1[1] -= 60.0 - (i * 29 % 110) as f32;
        }
        pairs
    }

    /// Half a pixel of noise, the same in every test.
    fn with_noise(mut pairs: Vec<Pair>) -> Vec<Pair> {
        let mut rng = Pcg32::new(3, 4);
        for value in pairs.iter_mut().flat_map(|(a, b)| a.iter_mut().chain(b)) {
            let uniform = || f64::from(rng.next_u32()) / f64::from(u32::MAX) - 0.5;
            *value += std::iter::repeat_with(uniform).take(4).sum::<f64>() as f32 * 0.87;
        }
        pairs
    }

    /// The matrix that maps pixels of the first camera to lines of the second.
    fn fundamental(motion: &Pose) -> Matrix3<f64> {
        let inverse = Matrix3::new(500.0, 0.0, 320.0, 0.0, 500.0, 240.0, 0.0, 0.0, 1.0).try_inverse().unwrap();
        let essential = motion.translation.vector.cross_matrix() * motion.rotation.to_rotation_matrix().matrix();
        inverse.transpose() * essential * inverse
    }

    /// Angles by which a motion is wrong in direction and in turn, radians.
    fn errors(found: &Pose, truth: &Pose) -> (f64, f64) {
        (found.translation.vector.angle(&truth.translation.vector), found.rotation.angle_to(&truth.rotation))
    }

    fn reconstructed(pairs: &[Pair]) -> Result<TwoView, Refused> {
        reconstruct(&CAMERA, &MonocularConfig::default(), 1.0, pairs)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn a_room_is_understood_up_to_its_scale(
            shift in prop::array::uniform3(-0.3f64..0.3),
            turn in prop::array::uniform3(-0.1f64..0.1),
        ) {
            prop_assume!(shift[0].hypot(shift[1]) > 0.15);
            let motion = Pose::new(shift.into(), turn.into());
            let (seen, points) = shown(&motion, &room());
            let baseline = motion.translation.vector.norm();
            // A wrong match that lies on its epipolar line by chance bends the result a little, the more the shorter the baseline.
            for (pairs, limit) in [(seen.clone(), 1e-3), (with_outliers(seen.clone()), 0.008 / baseline)] {
                let found = reconstructed(&pairs);
                prop_assert!(found.is_ok(), "{found:?}");
                let found = found.unwrap();
                prop_assert_eq!(found.model, Model::General);
                let (direction, rotation) = errors(&found.t_second_first, &motion);
                prop_assert!(direction < limit && rotation < 0.3 * limit, "{} {}", direction, rotation);
                let off = |p: &Point3<f64>, truth: &Point3<f64>| (p.coords * baseline - truth.coords).norm() / truth.z;
                let (mut right, mut accepted) = (0, 0);
                for (i, (p, truth)) in found.points.iter().zip(&points).enumerate() {
                    let Some(p) = p else { continue };
                    if pairs[i] == seen[i] {
                        accepted += 1;
                        // As right as the motion: a turn moves what is far by more.
                        let limit = 0.05 + direction + rotation * truth.z / baseline;
                        right += usize::from(off(p, truth) < limit);
                    } else {
                        // All that two pictures can say of a match is whether it lies on its epipolar line.
                        let limit_px = 3.0 + CAMERA.fx * (direction + rotation);
                        prop_assert!(epipolar_distance(&fundamental(&motion), &pairs[i]) < limit_px);
                    }
                }
                prop_assert!(right * 20 >= accepted * 19 && right > 100, "{} of {}", right, accepted);
            }
        }

        #[test]
        fn a_plane_is_understood_or_refused_but_never_mistaken(
            shift in prop::array::uniform3(-0.6f64..0.6),
            turn in prop::array::uniform3(-0.1f64..0.1),
            slope in prop::array::uniform2(-0.6f64..0.6),
        ) {
            prop_assume!(Vector3::from(shift).norm() > 0.3);
            let motion = Pose::new(shift.into(), turn.into());
            let (pairs, _) = shown(&motion, &scene(|x, y, _| 2.0 / (1.0 + slope[0] * x + slope[1] * y)));
            prop_assume!(pairs.len() > 120);
            for pairs in [pairs.clone(), with_outliers(pairs)] {
                match reconstructed(&pairs) {
                    Ok(found) => {
                        prop_assert_eq!(found.model, Model::Plane);
                        let (direction, rotation) = errors(&found.t_second_first, &motion);
                        prop_assert!(direction < 0.03 && rotation < 0.01, "{} {}", direction, rotation);
                    }
                    Err(refused) => prop_assert!(!matches!(refused, Refused::NoModel), "{}", refused),
                }
            }
        }

        #[test]
        fn a_camera_that_only_turns_is_refused(turn in prop::array::uniform3(-0.15f64..0.15)) {
            let motion = Pose::new(Vector3::zeros(), turn.into());
            let (pairs, _) = shown(&motion, &room());
            for pairs in [pairs.clone(), with_outliers(pairs.clone()), with_noise(pairs)] {
                let found = reconstructed(&pairs);
                prop_assert!(found.is_err(), "{found:?}");
            }
        }
    }

    #[test]
    fn a_tilted_plane_seen_from_well_apart_is_understood() {
        let motion = Pose::new(Vector3::new(-0.7, 0.1, 0.2), Vector3::new(0.0, 0.3, 0.05));
        let (pairs, points) = shown(&motion, &scene(|x, y, _| 2.0 / (1.0 + 0.5 * x - 0.3 * y)));
        let found = reconstructed(&with_noise(pairs)).unwrap();
        assert_eq!(found.model, Model::Plane);
        let (direction, rotation) = errors(&found.t_second_first, &motion);
        assert!(direction < 0.02 && rotation < 0.01, "{direction} {rotation}");
        assert!(found.points.iter().flatten().count() * 10 > points.len() * 9);
    }

    #[test]
    fn a_room_is_understood_despite_noise() {
        let motion = Pose::new(Vector3::new(0.3, 0.0, -0.1), Vector3::new(0.02, 0.05, 0.0));
        let found = reconstructed(&with_noise(with_outliers(shown(&motion, &room()).0))).unwrap();
        let (direction, rotation) = errors(&found.t_second_first, &motion);
        assert!(direction < 0.05 && rotation < 0.01, "{direction} {rotation}");
    }

    #[test]
    fn too_few_pairs_are_refused() {
        assert_eq!(reconstructed(&[([1.0, 2.0], [3.0, 4.0]); 7]).unwrap_err(), Refused::NoModel);
        assert!(reconstructed(&[([1.0, 2.0], [3.0, 4.0]); 60]).is_err());
    }
}

//! In: matched poses. Out: the transform that aligns the estimate with the reference, and the absolute trajectory error.
//!
//! Minimises Σ ‖r − (s R e + t)‖² in closed form: rotation by the largest eigenvector of the quaternion matrix of Horn, "Closed-form
//! solution of absolute orientation using unit quaternions", JOSA A 1987, §4; scale as in Umeyama, TPAMI 1991, equation 42.

use crate::{EvalError, Match, StampedPose, Statistics};
use nalgebra::{Isometry3, Matrix3, Matrix4, Quaternion, SymmetricEigen, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Eigenvalue gap, as a fraction of the largest eigenvalue, below which the rotation is undetermined: 1 µm across for each metre along.
const MIN_RELATIVE_GAP: f64 = 1e-12;
/// Spread, as a fraction of the distance from the origin (1 m at least), below which all positions are equal up to rounding.
const MIN_RELATIVE_SPREAD: f64 = 1e-9;

/// Which transforms the alignment may use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AlignmentKind {
    /// Rotation and translation: for sensors that measure scale, such as RGB-D.
    #[default]
    Se3,
    /// Rotation, translation and scale: for monocular estimates. It hides the scale error, so state it beside the result.
    Sim3,
    /// Rotation and translation that bring the first poses together, as `--align_origin` of `evo`.
    Origin,
    /// None: both trajectories are in the same world.
    None,
}

impl fmt::Display for AlignmentKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Se3 => "SE(3)",
            Self::Sim3 => "Sim(3)",
            Self::Origin => "first pose",
            Self::None => "not aligned",
        })
    }
}

/// A transform from the world of the estimate into the world of the reference: x ↦ scale · rotation · x + translation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Alignment {
    /// Degrees of freedom.
    pub kind: AlignmentKind,
    /// Rotation; serialised as x, y, z, w.
    pub rotation: UnitQuaternion<f64>,
    /// Translation, m.
    pub translation: Vector3<f64>,
    /// Scale, 1 except for [`AlignmentKind::Sim3`].
    pub scale: f64,
}

impl Alignment {
    /// Transforms an estimated pose into the world of the reference.
    pub fn apply(&self, pose: &StampedPose) -> StampedPose {
        let position = self.scale * (self.rotation * pose.t_world_cam.translation.vector) + self.translation;
        let rotation = self.rotation * pose.t_world_cam.rotation;
        StampedPose::new(pose.timestamp_ns, Isometry3::from_parts(position.into(), rotation))
    }

    /// Scales the estimated positions of the matches, for errors that need no other part of the alignment.
    pub fn scaled(&self, matches: &[Match]) -> Vec<Match> {
        let scaled = |pose: &StampedPose| {
            let mut pose = *pose;
            pose.t_world_cam.translation.vector *= self.scale;
            pose
        };
        matches.iter().map(|m| Match { estimate: scaled(&m.estimate), ..*m }).collect()
    }
}

impl fmt::Display for Alignment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.kind {
            AlignmentKind::Se3 | AlignmentKind::Origin | AlignmentKind::None => write!(f, "{}", self.kind),
            AlignmentKind::Sim3 => write!(f, "{}, scale s = {:.4}", self.kind, self.scale),
        }
    }
}

/// Absolute trajectory error: distances between reference and aligned estimated positions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ate {
    /// The alignment used.
    pub alignment: Alignment,
    /// Distances, m.
    pub translation_m: Statistics,
}

/// Finds the transform that aligns the estimated positions with the reference, in the least squares sense for
/// [`AlignmentKind::Se3`] and [`AlignmentKind::Sim3`].
///
/// # Errors
/// There are fewer than three matches, or the positions lie on a line or at a point; without a fit, there are no matches.
pub fn align(matches: &[Match], kind: AlignmentKind) -> Result<Alignment, EvalError> {
    let rigid = |pose: Isometry3<f64>| Alignment {
        kind,
        rotation: pose.rotation,
        translation: pose.translation.vector,
        scale: 1.0,
    };
    match (kind, matches.first()) {
        (AlignmentKind::Se3 | AlignmentKind::Sim3, _) => {}
        (_, None) => return Err(EvalError::TooFewMatches { found: 0, needed: 1 }),
        (AlignmentKind::Origin, Some(first)) => {
            return Ok(rigid(first.reference.t_world_cam * first.estimate.t_world_cam.inverse()));
        }
        (AlignmentKind::None, Some(_)) => return Ok(rigid(Isometry3::identity())),
    }
    if matches.len() < 3 {
        return Err(EvalError::TooFewMatches { found: matches.len(), needed: 3 });
    }
    let n = matches.len() as f64;
    let mean_r = matches.iter().map(|m| position(&m.reference)).sum::<Vector3<f64>>() / n;
    let mean_e = matches.iter().map(|m| position(&m.estimate)).sum::<Vector3<f64>>() / n;
    let centred = || matches.iter().map(|m| (position(&m.reference) - mean_r, position(&m.estimate) - mean_e));
    let square_r: f64 = centred().map(|(r, _)| r.norm_squared()).sum();
    let square_e: f64 = centred().map(|(_, e)| e.norm_squared()).sum();
    let correlation: Matrix3<f64> = centred().map(|(r, e)| e * r.transpose()).sum();

    let (reference_spread_m, estimate_spread_m) = ((square_r / n).sqrt(), (square_e / n).sqrt());
    let at_one_point = |spread_m: f64, mean: &Vector3<f64>| spread_m <= MIN_RELATIVE_SPREAD * mean.norm().max(1.0);
    let eigen = SymmetricEigen::new(horn_matrix(&correlation));
    let best = eigen.eigenvalues.imax();
    let largest = eigen.eigenvalues.max();
    let second =
        eigen.eigenvalues.iter().enumerate().filter(|&(i, _)| i != best).map(|(_, &v)| v).fold(f64::MIN, f64::max);
    if at_one_point(reference_spread_m, &mean_r)
        || at_one_point(estimate_spread_m, &mean_e)
        || largest - second <= MIN_RELATIVE_GAP * largest
    {
        return Err(EvalError::Degenerate { reference_spread_m, estimate_spread_m });
    }

    let q = eigen.eigenvectors.column(best);
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]));
    // The largest eigenvalue is Σ r · R e.
    let scale = if kind == AlignmentKind::Sim3 { largest / square_e } else { 1.0 };
    Ok(Alignment { kind, rotation, translation: mean_r - scale * (rotation * mean_e), scale })
}

/// Computes the absolute trajectory error of matched poses after alignment (Sturm et al. 2012, §V-B).
///
/// # Errors
/// Those of [`align`].
pub fn ate(matches: &[Match], kind: AlignmentKind) -> Result<Ate, EvalError> {
    let alignment = align(matches, kind)?;
    let error_m = |m: &Match| (position(&m.reference) - position(&alignment.apply(&m.estimate))).norm();
    let errors_m: Vec<f64> = matches.iter().map(error_m).collect();
    let translation_m = Statistics::of(&errors_m).ok_or(EvalError::TooFewMatches { found: 0, needed: 3 })?;
    Ok(Ate { alignment, translation_m })
}

fn position(pose: &StampedPose) -> Vector3<f64> {
    pose.t_world_cam.translation.vector
}

/// Returns Horn's symmetric matrix N, whose quadratic form in a unit quaternion (w, x, y, z) is Σ r · R e, from S = Σ e rᵀ.
pub fn horn_matrix(s: &Matrix3<f64>) -> Matrix4<f64> {
    let (sxx, sxy, sxz) = (s.m11, s.m12, s.m13);
    let (syx, syy, syz) = (s.m21, s.m22, s.m23);
    let (szx, szy, szz) = (s.m31, s.m32, s.m33);
    #[rustfmt::skip]
    let n = Matrix4::new(
        sxx + syy + szz, syz - szy,        szx - sxz,        sxy - syx,
        syz - szy,       sxx - syy - szz,  sxy + syx,        szx + sxz,
        szx - sxz,       sxy + syx,       -sxx + syy - szz,  syz + szy,
        sxy - syx,       szx + sxz,        syz + szy,       -sxx - syy + szz,
    );
    n
}

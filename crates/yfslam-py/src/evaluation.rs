//! `yfslam.evaluate` and `yfslam.align`: errors of trajectories.

use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use yfslam::nalgebra::Matrix4;
use yfslam_eval::{
    Alignment, AlignmentKind, Delta, EvalError, EvalOptions, ExpectedFrames, RpeOptions, Statistics, associate,
};

use crate::arrays::array;
use crate::error::failure;
use crate::results::tuple;
use crate::trajectory::Trajectory;

const KINDS: [(&str, AlignmentKind); 4] = [
    ("se3", AlignmentKind::Se3),
    ("sim3", AlignmentKind::Sim3),
    ("origin", AlignmentKind::Origin),
    ("none", AlignmentKind::None),
];

fn kind(name: &str) -> PyResult<AlignmentKind> {
    let found = KINDS.iter().find(|(known, _)| *known == name);
    let names = || KINDS.map(|(known, _)| known).join(", ");
    found.map(|(_, kind)| *kind).ok_or_else(|| failure(format!("unknown alignment '{name}'; give one of {}", names())))
}

fn max_diff_ns(ms: f64) -> PyResult<u64> {
    if (0.0..=1e9).contains(&ms) {
        return Ok((ms * 1e6) as u64);
    }
    Err(failure(format!("max_difference_ms is {ms}; give milliseconds, such as 20")))
}

/// Compares an estimate with the reference.
#[pyfunction]
#[pyo3(signature = (reference, estimate, *, alignment="se3", max_difference_ms=20.0, expected_ns=None))]
pub fn evaluate<'py>(
    py: Python<'py>,
    reference: &Trajectory,
    estimate: &Trajectory,
    alignment: &str,
    max_difference_ms: f64,
    expected_ns: Option<PyReadonlyArray1<'py, i64>>,
) -> PyResult<Bound<'py, PyAny>> {
    let expected = expected_ns.map_or(ExpectedFrames::Unknown, |stamps| {
        ExpectedFrames::StampsNs(stamps.as_array().iter().copied().collect())
    });
    let mut options = EvalOptions {
        max_diff_ns: max_diff_ns(max_difference_ms)?,
        alignment: kind(alignment)?,
        expected,
        ..EvalOptions::default()
    };
    let evaluation = py.detach(|| {
        let all = yfslam_eval::evaluate(&reference.poses, &estimate.poses, &options);
        // Short trajectories have no two poses that are a second apart.
        all.or_else(|error| match error {
            EvalError::NoPairs { .. } => {
                options.rpe = vec![RpeOptions::per_frame()];
                yfslam_eval::evaluate(&reference.poses, &estimate.poses, &options)
            }
            other => Err(other),
        })
    });
    let evaluation = evaluation.map_err(failure)?;
    let rpe = |seconds: bool| {
        let found = evaluation.rpe.iter().find(|rpe| matches!(rpe.options.delta, Delta::Seconds(_)) == seconds);
        found
            .map(|rpe| Ok::<_, PyErr>((statistics(py, &rpe.translation_m)?, statistics(py, &rpe.rotation_deg)?)))
            .transpose()
    };
    let fields = (
        statistics(py, &evaluation.ate.translation_m)?,
        align_tuple(py, &evaluation.ate.alignment)?,
        evaluation.scale(),
        rpe(false)?,
        rpe(true)?,
        evaluation.matches,
        evaluation.coverage.map(|coverage| coverage.fraction),
    );
    tuple(py, "Evaluation", fields)
}

/// Returns the alignment that brings an estimate onto the reference, and the aligned estimate.
#[pyfunction]
#[pyo3(signature = (reference, estimate, *, alignment="se3", max_difference_ms=20.0))]
pub fn align<'py>(
    py: Python<'py>,
    reference: &Trajectory,
    estimate: &Trajectory,
    alignment: &str,
    max_difference_ms: f64,
) -> PyResult<(Bound<'py, PyAny>, Trajectory)> {
    let matches = associate(&reference.poses, &estimate.poses, max_diff_ns(max_difference_ms)?).map_err(failure)?;
    let found = yfslam_eval::align(&matches, kind(alignment)?).map_err(failure)?;
    let poses = estimate.poses.iter().map(|pose| found.apply(pose)).collect();
    Ok((align_tuple(py, &found)?, Trajectory { poses }))
}

fn statistics<'py>(py: Python<'py>, s: &Statistics) -> PyResult<Bound<'py, PyAny>> {
    tuple(py, "Statistics", (s.count, s.rmse, s.mean, s.median, s.std, s.min, s.max))
}

fn align_tuple<'py>(py: Python<'py>, found: &Alignment) -> PyResult<Bound<'py, PyAny>> {
    let mut matrix: Matrix4<f64> = found.rotation.to_homogeneous() * found.scale;
    matrix[(3, 3)] = 1.0;
    matrix.fixed_view_mut::<3, 1>(0, 3).copy_from(&found.translation);
    let matrix = array(py, [4, 4], matrix.transpose().as_slice().to_vec())?;
    tuple(py, "Alignment", (matrix, found.scale))
}

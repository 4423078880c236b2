//! Results as numpy arrays.

use numpy::ndarray::{Array, IntoDimension};
use numpy::{Element, PyArray, PyArray2, PyArray3};
use pyo3::prelude::*;
use yfslam::Pose;
use yfslam::nalgebra::Matrix6;

use crate::error::failure;

/// Returns an array of this shape, row by row.
pub fn array<'py, T: Element, D: IntoDimension>(
    py: Python<'py>,
    shape: D,
    values: Vec<T>,
) -> PyResult<Bound<'py, PyArray<T, D::Dim>>> {
    let array = Array::from_shape_vec(shape.into_dimension(), values).map_err(failure)?;
    Ok(PyArray::from_owned_array(py, array))
}

/// Returns N rows of K values.
pub fn rows<'py, T: Element, const K: usize>(
    py: Python<'py>,
    rows: impl IntoIterator<Item = [T; K]>,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let values: Vec<T> = rows.into_iter().flatten().collect();
    array(py, [values.len() / K.max(1), K], values)
}

/// Returns a pose as a 4 × 4 matrix.
pub fn pose<'py>(py: Python<'py>, pose: &Pose) -> PyResult<Bound<'py, PyArray2<f64>>> {
    array(py, [4, 4], matrix(pose).to_vec())
}

/// Returns poses as N × 4 × 4 matrices.
pub fn poses<'py>(py: Python<'py>, poses: impl IntoIterator<Item = Pose>) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let values: Vec<f64> = poses.into_iter().flat_map(|pose| matrix(&pose)).collect();
    array(py, [values.len() / 16, 4, 4], values)
}

/// Returns the rows of the homogeneous matrix of a pose.
fn matrix(pose: &Pose) -> [f64; 16] {
    // nalgebra keeps columns; the transposed matrix has the rows in this order.
    let columns = pose.to_homogeneous().transpose();
    std::array::from_fn(|index| columns.as_slice().get(index).copied().unwrap_or_default())
}

/// Returns a covariance as a 6 × 6 matrix.
pub fn covariance<'py>(py: Python<'py>, covariance: &Matrix6<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    array(py, [6, 6], covariance.transpose().as_slice().to_vec())
}

//! Results as the named tuples of `yfslam._results`.

use pyo3::call::PyCallArgs;
use pyo3::prelude::*;

/// Returns the named tuple of this name with these fields.
pub fn tuple<'py>(py: Python<'py>, name: &str, fields: impl PyCallArgs<'py>) -> PyResult<Bound<'py, PyAny>> {
    py.import("yfslam._results")?.getattr(name)?.call1(fields)
}

//! Errors of the libraries as exceptions of Python.

use std::fmt::Display;

use pyo3::exceptions::PyException;
use pyo3::{PyErr, create_exception};

create_exception!(
    yfslam,
    Error,
    PyException,
    "Something that cannot be used; the message names it and says what to do."
);
create_exception!(
    yfslam,
    FrameRejected,
    Error,
    "A frame that does not fit the camera or the time before it; the next frame is handled as if this one had not come."
);

/// Returns an error of a library as `yfslam.Error`.
pub fn failure(error: impl Display) -> PyErr {
    Error::new_err(error.to_string())
}

/// Returns an error with its causes in one line.
pub fn failure_with_causes(error: &anyhow::Error) -> PyErr {
    Error::new_err(format!("{error:#}"))
}

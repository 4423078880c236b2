//! The native module of the Python package `yfslam`; `python/yfslam` has the rest of the package, with types and documentation.
//!
//! ```text
//! numpy arrays ──images──► Frame ──Slam──► Tracked, Trajectory ──► numpy arrays
//! recording: what `yfslam run` reads        command: the program `yfslam` itself
//! ```
//!
//! Everything that takes time runs without the interpreter's lock, so that other threads of Python go on.
#![deny(unsafe_code)]

mod arrays;
mod camera;
mod command;
mod config;
mod dense;
mod detector;
mod error;
mod evaluation;
mod frame;
mod images;
mod logging;
mod maps;
mod recording;
mod results;
mod slam;
mod synth;
mod tracked;
mod trajectory;

use pyo3::prelude::*;

#[pymodule(gil_used = true)]
fn _yfslam(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    // Loads the interface of numpy now: within a later call, Ctrl-C could break it off.
    drop(numpy::PyArray1::<u8>::zeros(py, 0, false));
    logging::begin();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("Error", py.get_type::<error::Error>())?;
    module.add("FrameRejected", py.get_type::<error::FrameRejected>())?;
    module.add_class::<camera::Camera>()?;
    module.add_class::<dense::DenseMap>()?;
    module.add_class::<dense::PySavedMap>()?;
    module.add_class::<frame::Frame>()?;
    module.add_class::<recording::Recording>()?;
    module.add_class::<recording::RecordingIterator>()?;
    module.add_class::<slam::Slam>()?;
    module.add_class::<synth::SynthFrame>()?;
    module.add_class::<synth::World>()?;
    module.add_class::<synth::WorldIterator>()?;
    module.add_class::<tracked::Tracked>()?;
    module.add_class::<trajectory::Trajectory>()?;
    module.add_function(wrap_pyfunction!(camera::presets, module)?)?;
    module.add_function(wrap_pyfunction!(command::run_program, module)?)?;
    module.add_function(wrap_pyfunction!(config::default_config_toml, module)?)?;
    module.add_function(wrap_pyfunction!(dense::load_dense_map, module)?)?;
    module.add_function(wrap_pyfunction!(dense::load_map, module)?)?;
    module.add_function(wrap_pyfunction!(evaluation::align, module)?)?;
    module.add_function(wrap_pyfunction!(evaluation::evaluate, module)?)?;
    module.add_function(wrap_pyfunction!(recording::open, module)?)?;
    module.add_function(wrap_pyfunction!(synth::worlds, module)?)?;
    module.add_function(wrap_pyfunction!(trajectory::load_trajectory, module)?)?;
    Ok(())
}

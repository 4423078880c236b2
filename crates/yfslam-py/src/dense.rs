//! `yfslam.DenseMap`: cloud, grid and mesh of a dense map.

use std::path::PathBuf;

use numpy::PyArray1;
use pyo3::prelude::*;
use yfslam::dense::{
    CloudPoint, DenseConfig, DenseError, GridCell, GroundGrid, Mesh, Up, Volume, check_products, cloud, ground_grid,
    mesh,
};
use yfslam::nalgebra::{UnitQuaternion, Vector3};
use yfslam::{MapError, SavedMap};
use yfslam_io::write_atomically;

use crate::arrays::{self, array, rows};
use crate::config;
use crate::error::failure;
use crate::results::tuple;

/// A dense map at one time.
#[pyclass(frozen, module = "yfslam")]
pub struct DenseMap {
    map: yfslam::dense::DenseMap,
    config: DenseConfig,
    turn: UnitQuaternion<f64>,
}

/// Reads the dense map of a file: `dense.map` of a run, or a saved map that has one.
#[pyfunction]
#[pyo3(signature = (path, *, config=None, up=UpArg(Up::Level)))]
pub fn load_dense_map(
    py: Python<'_>,
    path: PathBuf,
    config: Option<&Bound<'_, PyAny>>,
    up: UpArg,
) -> PyResult<DenseMap> {
    let config = config::resolve(config)?.dense;
    py.detach(|| {
        let bytes = yfslam_io::read_file(&path).map_err(failure)?;
        let map = yfslam::dense::DenseMap::from_bytes(&bytes)
            .map_err(|error: MapError| failure(format!("{}: {error}", path.display())))?;
        Ok(DenseMap::new(map, config, up.0))
    })
}

impl DenseMap {
    pub fn new(map: yfslam::dense::DenseMap, config: DenseConfig, up: Up) -> Self {
        let turn = map.turn(up);
        Self { map, config, turn }
    }

    fn volume(&self, config: &DenseConfig) -> Result<Volume, DenseError> {
        self.map.volume(config, &self.turn, |_| {})
    }

    /// Returns the configuration with another resolution, if one is given.
    fn settings(&self, resolution_m: Option<f32>) -> PyResult<DenseConfig> {
        let mut config = self.config.clone();
        if let Some(resolution_m) = resolution_m {
            config.resolution_m = resolution_m;
            let whole = yfslam::Config { dense: config.clone(), ..yfslam::Config::default() };
            whole.validate().map_err(failure)?;
        }
        Ok(config)
    }

    /// Calls `f` with the volume, without the interpreter's lock.
    fn product<T: Send>(
        &self,
        py: Python<'_>,
        resolution_m: Option<f32>,
        f: impl FnOnce(&Volume) -> Result<T, DenseError> + Send,
    ) -> PyResult<T> {
        let config = self.settings(resolution_m)?;
        py.detach(|| self.volume(&config).and_then(|volume| f(&volume))).map_err(failure)
    }
}

#[pymethods]
impl DenseMap {
    /// Rotation, 3 x 3, from the world of the trajectory into that of the products, whose z-axis points up.
    #[getter]
    fn rotation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let matrix = self.turn.to_rotation_matrix().into_inner().transpose();
        Ok(array(py, [3, 3], matrix.as_slice().to_vec())?.into_any())
    }

    /// Height of the floor, m; None if none was measured.
    #[getter]
    fn floor_m(&self) -> Option<f64> {
        self.map.floor_m(&self.turn)
    }

    /// Returns a coloured point for each occupied voxel.
    #[pyo3(signature = (*, resolution_m=None))]
    fn cloud<'py>(&self, py: Python<'py>, resolution_m: Option<f32>) -> PyResult<Bound<'py, PyAny>> {
        let points: Vec<CloudPoint> = self.product(py, resolution_m, |volume| {
            check_products(volume, true, false)?;
            Ok(cloud(&self.map, volume, |_| {}))
        })?;
        let positions = rows(py, points.iter().map(|point| point.position_m))?;
        let colors = rows(py, points.iter().map(|point| point.color))?;
        tuple(py, "Cloud", (positions, colors))
    }

    /// Returns the grid of obstacles between two heights, m.
    #[pyo3(signature = (low_m, high_m, *, resolution_m=None))]
    fn grid<'py>(
        &self,
        py: Python<'py>,
        low_m: f32,
        high_m: f32,
        resolution_m: Option<f32>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if low_m.is_nan() || high_m.is_nan() || low_m >= high_m {
            return Err(failure(format!("the heights {low_m} and {high_m} m do not ascend")));
        }
        let ground: GroundGrid = self.product(py, resolution_m, |volume| Ok(ground_grid(volume, [low_m, high_m])))?;
        let cell = |cell: &GridCell| -> i8 {
            match cell {
                GridCell::Unknown => -1,
                GridCell::Free => 0,
                GridCell::Occupied => 100,
            }
        };
        let cells = array(py, [ground.height, ground.width], ground.cells.iter().map(cell).collect())?;
        tuple(py, "Grid", (cells, PyArray1::from_slice(py, &ground.origin_m), ground.resolution_m))
    }

    /// Returns the coloured triangles of the surfaces.
    #[pyo3(signature = (*, resolution_m=None))]
    fn mesh<'py>(&self, py: Python<'py>, resolution_m: Option<f32>) -> PyResult<Bound<'py, PyAny>> {
        let made: Mesh = self.product(py, resolution_m, |volume| {
            check_products(volume, false, true)?;
            Ok(mesh(&self.map, volume, |_, _| {}))
        })?;
        let vertices = rows(py, made.vertices_m.iter().copied())?;
        let colors = rows(py, made.colors.iter().copied())?;
        let triangles = rows(py, made.triangles.iter().copied())?;
        tuple(py, "Mesh", (vertices, colors, triangles))
    }

    /// Returns the poses of the keyframe patches in the world of the products, N x 4 x 4.
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(arrays::poses(py, self.map.patches.iter().map(|patch| self.turn * patch.t_world_cam))?.into_any())
    }

    /// Writes the dense map to a file for `yfslam map` and `load_dense_map`.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| {
            let bytes = self.map.to_bytes().map_err(failure)?;
            write_atomically(&path, |file| file.write_all(&bytes)).map_err(failure)
        })
    }

    fn __len__(&self) -> usize {
        self.map.patches.len()
    }

    fn __repr__(&self) -> String {
        format!("DenseMap({} keyframe patches, {} MB)", self.map.patches.len(), self.map.bytes() / 1_000_000)
    }
}

/// The argument `up`: "level", "camera", or a direction in the world of the map.
#[derive(Clone, Copy)]
pub struct UpArg(pub Up);

impl<'a, 'py> FromPyObject<'a, 'py> for UpArg {
    type Error = PyErr;

    fn extract(value: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(name) = value.extract::<String>() {
            return match &*name {
                "level" => Ok(Self(Up::Level)),
                "camera" => Ok(Self(Up::Camera)),
                _ => Err(failure(format!("up is '{name}'; give 'level', 'camera' or a direction x, y, z"))),
            };
        }
        let direction: [f64; 3] = value.extract()?;
        let vector = Vector3::from(direction);
        if !(vector.norm().is_finite() && vector.norm() > 1e-9) {
            return Err(failure(format!("up is {direction:?}, which is no direction")));
        }
        Ok(Self(Up::Direction(vector)))
    }
}

/// `yfslam.load_map`: a saved map as arrays.
#[pyclass(frozen, module = "yfslam", name = "SavedMap")]
pub struct PySavedMap {
    pub map: SavedMap,
}

/// Reads a saved map.
#[pyfunction]
pub fn load_map(py: Python<'_>, path: PathBuf) -> PyResult<PySavedMap> {
    py.detach(|| {
        let bytes = yfslam_io::read_file(&path).map_err(failure)?;
        let map = SavedMap::from_bytes(&bytes).map_err(|error| failure(format!("{}: {error}", path.display())))?;
        Ok(PySavedMap { map })
    })
}

#[pymethods]
impl PySavedMap {
    /// Returns the landmarks.
    fn landmarks<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        crate::maps::landmarks(py, &crate::maps::landmark_rows(self.map.map()))
    }

    /// Returns the keyframes.
    fn keyframes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        crate::maps::keyframes(py, &crate::maps::keyframe_rows(self.map.map()))
    }

    #[pyo3(signature = (*, config=None, up=UpArg(Up::Level)))]
    fn dense_map(&self, config: Option<&Bound<'_, PyAny>>, up: UpArg) -> PyResult<Option<DenseMap>> {
        let config = config::resolve(config)?.dense;
        Ok(self.map.dense().map(|dense| DenseMap::new(dense.clone(), config, up.0)))
    }
}

//! Maps that people use: occupancy, clouds, grids, meshes, and the view without people.
//!
//! ```text
//! frame ─► patch ──hangs on its keyframe──► mapper ─► volume      occupied, free, unknown; follows every correction
//!          depth and colour without          │
//!          edges; what moves is marked       └──► dense_map ─► cloud, grid, mesh, classes, background
//! ```
//!
//! Nothing that moves makes a surface: the dynamic filter's decision is cut into the patch. What it missed is taken back by the views
//! that come after and see through it.

mod background;
mod classes;
mod cloud;
mod gravity;
mod grid;
mod keyframe_patch;
mod mapper;
#[cfg(test)]
mod memory_tests;
mod mesh;
mod object_masks;
mod persist;
#[cfg(test)]
mod scene;
mod static_recovery;
mod trace;
mod view;
mod volume;
mod voxels;

pub use crate::config::DenseConfig;
pub use background::{Background, Backgrounds};
pub use classes::{Classes, classes};
pub use cloud::{CloudPoint, cloud};
pub use gravity::Up;
pub use grid::{GridCell, GroundGrid, ground_grid};
pub use keyframe_patch::{CellGrid, KeyframePatch};
pub(crate) use mapper::{DenseMapper, Source};
pub use mesh::{Mesh, mesh};
pub use view::DenseView;
pub use volume::{KnownVoxel, Volume};
pub use voxels::{Block, SIDE as BLOCK_SIDE, Voxel, block_of, center_m, voxel_at};

use nalgebra::UnitQuaternion;

use crate::config::ConfigError;
use crate::geometry::Pose;
use crate::map::persist::MapError;

/// Why no dense map can be made.
#[derive(Debug, thiserror::Error)]
pub enum DenseError {
    /// A value of the configuration with which nothing can work.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// Pieces of an earlier session on other cells.
    #[error(
        "its patches have cells of {found} px of a camera of {width} × {height}, this session has cells of {wanted} px: take the same camera, \
         and dense.stride_px = {found}"
    )]
    Cells {
        /// Pixels along each side of their cells.
        found: usize,
        /// The same of this session.
        wanted: usize,
        /// Their camera's width, px.
        width: usize,
        /// Their camera's height, px.
        height: usize,
    },
    /// Pieces of another map.
    #[error("a patch hangs on keyframe {0}, which the map does not have: the patches are of another map")]
    Keyframe(u64),
    /// More memory than is allowed.
    #[error(
        "at {resolution_m} m {what} would take about {needed_mb} MB, more than the {allowed_mb} MB that dense.max_memory_mb allows: choose \
         a resolution of {fits_m} m or coarser (dense.resolution_m), a shorter dense.max_range_m, or allow more"
    )]
    Memory {
        /// Side of a voxel, m.
        resolution_m: f32,
        /// What takes it.
        what: &'static str,
        /// How much, MB.
        needed_mb: usize,
        /// How much is allowed, MB.
        allowed_mb: usize,
        /// Side of a voxel with which it is less, m.
        fits_m: f32,
    },
    /// The system was built without a dense map.
    #[error("the system was built without a dense map: give the builder a dense configuration (`SlamBuilder::dense`)")]
    Disabled,
    /// A thread could not be started.
    #[error("the thread of the dense map could not be started: {0}; raise the limit of threads of this user")]
    Thread(#[from] std::io::Error),
}

/// Pieces in their places: what all products are made of.
#[derive(Clone, Debug, PartialEq)]
pub struct DenseMap {
    /// The cells of the patches.
    pub grid: CellGrid,
    /// In the order in which they were cut.
    pub patches: Vec<PlacedPatch>,
    /// Those of submaps that are not joined with that of most patches, each in its own world, with its place among all patches. No product
    /// shows them; they come in when their submap is joined in a later session.
    pub apart: Vec<(usize, PlacedPatch)>,
    /// Names of the classes that cells may have, from class 1 on; none if no detector looked for static_objects.
    pub class_names: Vec<String>,
}

/// A patch in its place.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedPatch {
    /// Time of the frame, ns.
    pub timestamp_ns: i64,
    /// Sequence number of the keyframe it hangs on.
    pub keyframe: u64,
    /// World from camera.
    pub t_world_cam: Pose,
    /// Depth and colour.
    pub patch: KeyframePatch,
}

impl DenseMap {
    /// Returns the map as bytes, for [`DenseMap::from_bytes`].
    ///
    /// # Errors
    /// If it cannot be written, which would be a fault of this program.
    pub fn to_bytes(&self) -> Result<Vec<u8>, MapError> {
        persist::encode(self)
    }

    /// Reads the dense map in `bytes` and checks it: a file of its own, or the first part of a saved map.
    ///
    /// # Errors
    /// If the bytes are no dense map, of another version, cut, altered, or contradict themselves; if they are a map without a dense one.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, MapError> {
        persist::decode(bytes)
    }

    /// A dense_map of patches whose places, world from camera, no map has to say; numbered in the order given.
    #[cfg(test)]
    pub(crate) fn of_poses(grid: CellGrid, patches: impl IntoIterator<Item = (Pose, KeyframePatch)>) -> Self {
        let number = |(number, (t_world_cam, patch))| PlacedPatch {
            timestamp_ns: number as i64,
            keyframe: number as u64,
            t_world_cam,
            patch,
        };
        Self {
            patches: patches.into_iter().enumerate().map(number).collect(),
            apart: Vec::new(),
            grid,
            class_names: Vec::new(),
        }
    }

    /// Returns the rotation after which the z-axis of the world points up.
    pub fn turn(&self, up: Up) -> UnitQuaternion<f64> {
        gravity::turn(self, up)
    }

    /// Returns the height of the floor in a world turned by `turn`, m; `None` where no floor was measured.
    pub fn floor_m(&self, turn: &UnitQuaternion<f64>) -> Option<f64> {
        gravity::floor_m(self, turn)
    }

    /// Bytes of memory that its patches take.
    pub fn bytes(&self) -> usize {
        self.patches.iter().map(|one| one.patch.bytes()).sum()
    }

    /// Returns the volume of all patches in a world turned by `turn`, within the memory that the configuration allows. `progress`
    /// receives the number of patches that are done.
    ///
    /// # Errors
    /// Where it would take more memory.
    pub fn volume(
        &self,
        config: &DenseConfig,
        turn: &UnitQuaternion<f64>,
        mut progress: impl FnMut(usize),
    ) -> Result<Volume, DenseError> {
        let mut refused = None;
        let volume = self.fill(config, turn, |number, volume| {
            progress(number);
            let bytes = volume.bytes();
            if check_memory(config, "the map", bytes).is_err() {
                // As much again for each patch that is still to come.
                refused = check_memory(config, "the map", bytes / number.max(1) * self.patches.len()).err();
            }
            refused.is_none()
        });
        refused.map_or(Ok(volume), Err)
    }

    /// Enters patches for as long as `goes_on`, which is asked before each, says so.
    fn fill(
        &self,
        config: &DenseConfig,
        turn: &UnitQuaternion<f64>,
        mut goes_on: impl FnMut(usize, &Volume) -> bool,
    ) -> Volume {
        let mut volume = Volume::new(config);
        for (number, one) in self.patches.iter().enumerate() {
            if !goes_on(number, &volume) {
                return volume;
            }
            volume.place(number, &self.grid, &one.patch, Some(&(turn * one.t_world_cam)));
        }
        goes_on(self.patches.len(), &volume);
        volume.settle();
        volume
    }
}

/// Whether `what` may take so many bytes.
///
/// # Errors
/// If the configuration allows less.
pub(crate) fn check_memory(config: &DenseConfig, what: &'static str, bytes: usize) -> Result<(), DenseError> {
    let (needed_mb, allowed_mb) = (bytes.div_ceil(1_000_000), config.max_memory_mb);
    if needed_mb <= allowed_mb {
        return Ok(());
    }
    // Surfaces grow with the square of the resolution, space with its cube: the square is the safe side. In steps of 5 mm.
    let finer = (needed_mb as f32 / allowed_mb as f32).sqrt();
    let fits_m = ((config.resolution_m * finer * 200.0).ceil() / 200.0).min(0.2);
    Err(DenseError::Memory { resolution_m: config.resolution_m, what, needed_mb, allowed_mb, fits_m })
}

/// Checks whether the cloud and the mesh of a volume may be made.
///
/// # Errors
/// If one of those wanted would take more memory than the configuration of the volume allows.
pub fn check_products(volume: &Volume, wants_cloud: bool, wants_mesh: bool) -> Result<(), DenseError> {
    if wants_cloud {
        check_memory(volume.config(), "the cloud", cloud::bytes(volume))?;
    }
    if wants_mesh {
        check_memory(volume.config(), "the mesh", mesh::bytes(volume))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_that_would_take_too_much_memory_is_refused_and_the_resolution_that_is_advised_fits() {
        let mut config = DenseConfig { resolution_m: 0.01, max_memory_mb: 2, ..Default::default() };
        let grid = CellGrid::new(&scene::camera(), config.stride_px);
        let pose = |k: u32| Pose::translation(0.0, 0.0, f64::from(k) * 0.4);
        let dense_map =
            DenseMap::of_poses(grid.clone(), (0..6).map(|k| (pose(k), scene::wall(&grid, 3.01, Some(1.5)))));
        let turn = UnitQuaternion::identity();
        let error = dense_map.volume(&config, &turn, |_| {}).err().unwrap();
        let DenseError::Memory { fits_m, allowed_mb: 2, .. } = error else { panic!("{error}") };
        assert!(error.to_string().contains("at 0.01 m the map would take"), "{error}");
        config.resolution_m = fits_m;
        let volume = dense_map.volume(&config, &turn, |_| {}).unwrap();
        assert!(volume.bytes() <= 2_000_000);
        assert!(volume.voxels().count() > 1000);
    }
}

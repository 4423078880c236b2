//! The dense map: occupied, free and unknown space with colour and class, and the products made of it: cloud, grid, mesh, images
//! without people.
//!
//! ```text
//! keyframe ─► keyframe_patch ─► mapper ─► volume     occupied, free, unknown; follows every correction of the map
//!             depth and colour       │
//!             without edges; what    └────► DenseMap ─► cloud, grid, mesh, classes, background
//!             moves is marked
//! ```
//!
//! In: keyframes with colour and depth, the pixels that move, and the poses that the map gives. Out: the dense map and its
//! products. What moves makes no surface: the dynamic filter's mask is part of each patch. A moving object that the filter missed
//! disappears when later patches show free space there.

mod background;
mod block_state;
mod classes;
mod cloud;
mod fusion;
mod gravity;
mod grid;
mod keyframe_patch;
mod map_frame;
mod mapper;
#[cfg(test)]
mod memory_tests;
mod mesh;
mod object_masks;
#[cfg(feature = "persist")]
mod persist;
#[cfg(test)]
mod scene;
mod shutter;
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
pub use map_frame::MapFrame;
pub(crate) use mapper::{DenseMapper, Source};
pub use mesh::{Mesh, mesh};
pub(crate) use shutter::RowShift;
pub use view::DenseView;
pub use volume::{KnownVoxel, Volume};
pub use voxels::{Block, SIDE as BLOCK_SIDE, Voxel, center_m, voxel_at};

use nalgebra::UnitQuaternion;

use crate::config::ConfigError;
use crate::geometry::Pose;
#[cfg(feature = "persist")]
use crate::map::persist::MapError;

/// The reasons why a dense map or a product cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum DenseError {
    /// A value of the configuration is out of range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The patches of an earlier session have other cells.
    #[error(
        "the saved dense map has patches with cells of {found} px of a camera of {width} × {height}, this session has cells of {wanted} px: \
         use the same camera and dense.stride_px = {found}"
    )]
    Cells {
        /// Pixels along each side of the saved cells.
        found: usize,
        /// Pixels along each side of this session's cells.
        wanted: usize,
        /// Image width of the saved camera, px.
        width: usize,
        /// Image height of the saved camera, px.
        height: usize,
    },
    /// The patches belong to another map.
    #[error(
        "a patch belongs to keyframe {0}, which the map does not have: the patches are of another map; load them together with their map"
    )]
    Keyframe(u64),
    /// It would take more memory than the configuration allows.
    #[error(
        "at {resolution_m} m {what} would take about {needed_mb} MB, more than the {allowed_mb} MB that dense.max_memory_mb allows: choose \
         a resolution of {fits_m} m or coarser (dense.resolution_m), a shorter dense.max_range_m, or allow more"
    )]
    Memory {
        /// Side of a voxel, m.
        resolution_m: f32,
        /// The product that takes the memory.
        what: &'static str,
        /// Memory needed, MB.
        needed_mb: usize,
        /// Memory allowed, MB.
        allowed_mb: usize,
        /// Side of a voxel with which it needs no more than that, m.
        fits_m: f32,
    },
    /// The system was built without a dense map.
    #[error("the system was built without a dense map: give the builder a dense configuration (`SlamBuilder::dense`)")]
    Disabled,
    /// The thread of the dense map could not be started.
    #[error("the thread of the dense map could not be started: {0}; raise the user's limit of threads")]
    Thread(#[from] std::io::Error),
}

/// The dense map as keyframe patches with their poses, from which all products are made.
#[derive(Clone, Debug, PartialEq)]
pub struct DenseMap {
    /// The cells of the patches.
    pub grid: CellGrid,
    /// Patches of the submap that has most of them, in the order in which they were extracted.
    pub patches: Vec<PlacedPatch>,
    /// Patches of other submaps, each with its index among all patches and its pose in its own world. Products leave them out; they
    /// are included once their submap is merged in a later session.
    pub unmerged: Vec<(usize, PlacedPatch)>,
    /// Names of the classes of cells, from class 1 on; empty if no detector searched for static objects.
    pub class_names: Vec<String>,
    /// The map frame; `None` in files of programs that did not know it.
    pub frame: Option<MapFrame>,
}

/// A keyframe patch with its pose.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedPatch {
    /// Time of the frame, ns.
    pub timestamp_ns: i64,
    /// Sequence number of its keyframe.
    pub keyframe: u64,
    /// Pose of the camera, camera to world, m.
    pub t_world_cam: Pose,
    /// Depth, colour and class.
    pub patch: KeyframePatch,
}

impl DenseMap {
    /// Returns the map as bytes, for [`DenseMap::from_bytes`]; with the feature `persist`.
    ///
    /// # Errors
    /// If it cannot be encoded, which would be a fault of this program.
    #[cfg(feature = "persist")]
    pub fn to_bytes(&self) -> Result<Vec<u8>, MapError> {
        persist::encode(self)
    }

    /// Reads and checks the dense map in `bytes`: a file of its own, or the first part of a saved map; with the feature `persist`.
    ///
    /// # Errors
    /// If the bytes are not a dense map, are of another version, truncated, altered or inconsistent, or are a map without a dense
    /// map.
    #[cfg(feature = "persist")]
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, MapError> {
        persist::decode(bytes)
    }

    /// Returns a dense map of patches with given poses, camera to world; numbered in their order.
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
            unmerged: Vec::new(),
            grid,
            class_names: Vec::new(),
            frame: None,
        }
    }

    /// Returns the rotation after which the z-axis of the world points up.
    pub fn turn(&self, up: Up) -> UnitQuaternion<f64> {
        gravity::turn(self, up)
    }

    /// Returns the height of the floor in a world turned by `turn`, m; `None` if no floor was measured.
    pub fn floor_m(&self, turn: &UnitQuaternion<f64>) -> Option<f64> {
        gravity::floor_m(self, turn)
    }

    /// Returns the memory that its patches take, bytes.
    pub fn bytes(&self) -> usize {
        self.patches.iter().map(|placed| placed.patch.bytes()).sum()
    }

    /// Returns the volume of all patches in a world turned by `turn`, within the memory that the configuration allows. `progress`
    /// receives the number of finished patches.
    ///
    /// # Errors
    /// If it would take more memory.
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
                // The remaining patches are assumed to take as much on average.
                refused = check_memory(config, "the map", bytes / number.max(1) * self.patches.len()).err();
            }
            refused.is_none()
        });
        refused.map_or(Ok(volume), Err)
    }

    /// Integrates the patches for as long as `go_on`, which is called before each and at the end, returns true.
    fn fill(
        &self,
        config: &DenseConfig,
        turn: &UnitQuaternion<f64>,
        mut go_on: impl FnMut(usize, &Volume) -> bool,
    ) -> Volume {
        let mut volume = Volume::new(config);
        for (number, placed) in self.patches.iter().enumerate() {
            if !go_on(number, &volume) {
                return volume;
            }
            volume.integrate(number, &self.grid, &placed.patch, Some(&(turn * placed.t_world_cam)));
        }
        go_on(self.patches.len(), &volume);
        volume.update();
        volume
    }
}

/// Checks whether `what` may take so many bytes.
///
/// # Errors
/// If the configuration allows less.
pub(crate) fn check_memory(config: &DenseConfig, what: &'static str, bytes: usize) -> Result<(), DenseError> {
    let (needed_mb, allowed_mb) = (bytes.div_ceil(1_000_000), config.max_memory_mb);
    if needed_mb <= allowed_mb {
        return Ok(());
    }
    // Surfaces grow with the square of the resolution, space with its cube: the square is the safe side. The result is rounded up
    // to 5 mm.
    let finer = (needed_mb as f32 / allowed_mb as f32).sqrt();
    let fits_m = ((config.resolution_m * finer * 200.0).ceil() / 200.0).min(0.2);
    Err(DenseError::Memory { resolution_m: config.resolution_m, what, needed_mb, allowed_mb, fits_m })
}

/// Checks whether the cloud and the mesh of a volume fit into the allowed memory.
///
/// # Errors
/// If one of the requested products would take more memory than the configuration of the volume allows.
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
    fn a_map_that_needs_too_much_memory_is_refused_and_the_advised_resolution_fits() {
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

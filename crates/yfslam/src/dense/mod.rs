//! Maps that people use: occupancy, clouds, grids, meshes, and the view without people.
//!
//! ```text
//! frame ─► piece ──hangs on its keyframe──► mapper ─► volume      occupied, free, unknown; follows every correction
//!          depth and colour without          │
//!          edges; what moves is marked       └──► survey ─► cloud, grid, mesh, classes, background
//! ```
//!
//! Nothing that moves makes a surface: the dynamic filter's decision is cut into the piece. What it missed is taken back by the views
//! that come after and see through it.

pub mod background;
pub mod classes;
pub mod cloud;
pub mod grid;
mod mapper;
pub mod mesh;
pub mod persist;
pub mod piece;
#[cfg(test)]
mod scene;
mod trace;
pub mod up;
mod volume;
pub mod voxels;

pub use crate::config::DenseConfig;
pub use mapper::DenseMapper;
pub use piece::{CellGrid, Piece};
pub use volume::{KnownVoxel, Volume};

use nalgebra::UnitQuaternion;

use crate::config::ConfigError;
use crate::geometry::Pose;

/// Why no dense map can be made.
#[derive(Debug, thiserror::Error)]
pub enum DenseError {
    /// A value of the configuration with which nothing can work.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// Pieces of an earlier session on other cells.
    #[error(
        "its pieces have cells of {found} px of a camera of {width} × {height}, this session has cells of {wanted} px: take the same camera, \
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
    #[error("a piece hangs on keyframe {0}, which the map does not have: the pieces are of another map")]
    Keyframe(u64),
    /// A thread could not be started.
    #[error("the thread of the dense map could not be started: {0}; raise the limit of threads of this user")]
    Thread(#[from] std::io::Error),
}

/// Pieces in their places: what all products are made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Survey {
    /// The cells of the pieces.
    pub grid: CellGrid,
    /// In the order in which they were cut.
    pub pieces: Vec<SurveyPiece>,
    /// Those of submaps that are not joined with that of most pieces, each in its own world, with its place among all pieces. No product
    /// shows them; they come in when their submap is joined in a later session.
    pub apart: Vec<(usize, SurveyPiece)>,
    /// Names of the classes that cells may have, from class 1 on; none if no detector looked for things.
    pub class_names: Vec<String>,
}

/// A piece in its place.
#[derive(Clone, Debug, PartialEq)]
pub struct SurveyPiece {
    /// Time of the frame, ns.
    pub timestamp_ns: i64,
    /// Sequence number of the keyframe it hangs on.
    pub keyframe: u64,
    /// World from camera.
    pub t_world_cam: Pose,
    /// Depth and colour.
    pub piece: Piece,
}

impl Survey {
    /// A survey of pieces whose places, world from camera, no map has to say; numbered in the order given.
    pub fn of_poses(grid: CellGrid, pieces: impl IntoIterator<Item = (Pose, Piece)>) -> Self {
        let number = |(number, (t_world_cam, piece))| SurveyPiece {
            timestamp_ns: number as i64,
            keyframe: number as u64,
            t_world_cam,
            piece,
        };
        Self {
            pieces: pieces.into_iter().enumerate().map(number).collect(),
            apart: Vec::new(),
            grid,
            class_names: Vec::new(),
        }
    }

    /// Bytes of memory that its pieces take.
    pub fn bytes(&self) -> usize {
        self.pieces.iter().map(|one| one.piece.bytes()).sum()
    }

    /// The volume of all pieces in a world turned by `turn`. `told` hears how many pieces are done.
    pub fn volume(&self, config: &DenseConfig, turn: &UnitQuaternion<f64>, mut told: impl FnMut(usize)) -> Volume {
        let mut volume = Volume::new(config);
        for (number, one) in self.pieces.iter().enumerate() {
            told(number);
            volume.place(number, &self.grid, &one.piece, Some(&(turn * one.t_world_cam)));
        }
        volume.settle();
        volume
    }
}

//! The dense map beside the SLAM system: pieces that hang on keyframes, and the volume that follows them.
//!
//! In: pieces with the keyframe that each hangs on, and the map whenever it was corrected. Out: a volume that is consistent with the
//! trajectory at any time.

use nalgebra::UnitQuaternion;

use crate::camera::Camera;
use crate::config::ConfigError;
use crate::dense::piece::{CellGrid, Piece};
use crate::dense::volume::Volume;
use crate::dense::{DenseConfig, Survey, SurveyPiece};
use crate::dynamic::Tie;
use crate::geometry::Pose;
use crate::image::{DepthImage, RgbImage};
use crate::map::Map;

/// Keeps the pieces of keyframes where the map has them.
#[derive(Clone, Debug)]
pub struct DenseMapper {
    config: DenseConfig,
    grid: CellGrid,
    /// Turns the world so that the z-axis points up.
    up: UnitQuaternion<f64>,
    pieces: Vec<(i64, Tie, Piece)>,
    volume: Volume,
}

impl DenseMapper {
    /// A mapper for one camera. Its volume's z-axis points up in the first picture, as in ROS (REP 103).
    ///
    /// # Errors
    /// For a value of the configuration that cannot work.
    pub fn new(config: &DenseConfig, camera: &Camera) -> Result<Self, ConfigError> {
        config.validate()?;
        Ok(Self {
            grid: CellGrid::new(camera, config.stride_px),
            up: super::up::of_camera(),
            pieces: Vec::new(),
            volume: Volume::new(config),
            config: config.clone(),
        })
    }

    /// Cuts the piece of a frame: `moves(position, edge)` tells whether a position of the image, px, is within `edge` px of what moves.
    pub fn cut(&self, color: &RgbImage, depth: &DepthImage, moves: impl Fn([f32; 2], f32) -> bool) -> Piece {
        Piece::cut(&self.config, &self.grid, color, depth, moves)
    }

    /// Hangs a piece on a keyframe. It enters the volume with the next [`DenseMapper::follow`].
    pub fn hang(&mut self, timestamp_ns: i64, tie: Tie, piece: Piece) {
        self.pieces.push((timestamp_ns, tie, piece));
    }

    /// Number of pieces.
    pub fn len(&self) -> usize {
        self.pieces.len()
    }

    /// Whether there are no pieces.
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Where the map has the pieces now, world from camera: those of the submap that most of them are in; `None` for the others.
    pub fn poses(&self, map: &Map) -> Vec<Option<Pose>> {
        let roots: Vec<_> = self.pieces.iter().map(|(_, (keyframe, _), _)| map.root(*keyframe)).collect();
        let mut counts: Vec<(usize, _)> = Vec::new();
        for root in roots.iter().flatten() {
            match counts.iter_mut().find(|(_, other)| other == root) {
                Some((count, _)) => *count += 1,
                None => counts.push((1, *root)),
            }
        }
        // Of equals the one begun first.
        let largest = counts.iter().rev().max_by_key(|(count, _)| *count).map(|(_, root)| *root);
        let pose = |((_, (keyframe, t_cam_reference), _), root): (&(i64, Tie, Piece), &Option<_>)| {
            let t_reference_world = map.keyframe_pose(*keyframe).filter(|_| root.is_some() && *root == largest)?;
            Some((t_cam_reference * t_reference_world).inverse())
        };
        self.pieces.iter().zip(&roots).map(pose).collect()
    }

    /// Brings the volume to where the map has the pieces. Returns how many were entered anew.
    pub fn follow(&mut self, map: &Map) -> usize {
        let poses = self.poses(map);
        let mut moved = 0;
        for (number, ((.., piece), pose)) in self.pieces.iter().zip(&poses).enumerate() {
            let pose = pose.map(|t_world_cam| self.up * t_world_cam);
            moved += usize::from(self.volume.place(number, &self.grid, piece, pose.as_ref()));
        }
        moved
    }

    /// Occupancy as of the last [`DenseMapper::follow`].
    pub fn volume(&mut self) -> &Volume {
        self.volume.settle();
        &self.volume
    }

    /// Bytes of memory that pieces and volume take.
    pub fn bytes(&self) -> usize {
        let cells: usize = self.pieces.iter().map(|(.., piece)| piece.depth.len()).sum();
        cells * (size_of::<u16>() + size_of::<[u8; 3]>()) + self.volume.bytes()
    }

    /// Forgets all: the map was begun anew.
    pub fn clear(&mut self) {
        self.pieces.clear();
        self.volume = Volume::new(&self.config);
    }

    /// The pieces with their poses, for products and files.
    pub fn into_survey(self, map: &Map) -> Survey {
        let poses = self.poses(map);
        let pieces = self.pieces.into_iter().zip(poses).filter_map(|((timestamp_ns, _, piece), pose)| {
            Some(SurveyPiece { timestamp_ns, t_world_cam: pose?, piece })
        });
        Survey { pieces: pieces.collect(), grid: self.grid }
    }
}

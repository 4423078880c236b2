//! The products of a run as files: recordings, point clouds, meshes, octrees, occupancy grids, images.

mod coordinates;
mod jpeg;
mod nav2;
mod octomap;
mod pcd;
mod ply;
mod png;
mod recording;

pub use coordinates::Coordinates;
pub use jpeg::encode_jpeg;
pub use nav2::write_nav2;
pub use octomap::{OctreeFormat, OctreeSize, OctreeVoxel, write_octomap};
pub use pcd::write_pcd;
pub use ply::{Labels, PlyPoint, write_ply, write_ply_mesh};
pub use png::{write_color_png, write_depth_png, write_mask_png};
pub use recording::{ListedStamps, RecordingWriter};

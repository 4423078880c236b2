//! Segmentation of the moving instances of a frame in its depth image.
//!
//! In: bounding boxes with depth, masks of a segmentation network. Out: a mask on a grid of cells, with the instance of each cell.

pub(crate) mod depth_clusters;
pub(crate) mod mask;
pub(crate) mod segmenter;

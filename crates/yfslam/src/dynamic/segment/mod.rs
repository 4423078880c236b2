//! Segmentation of the movable instances of a frame in its depth image (after YF-SLAM, section 3.3).
//!
//! In: bounding boxes, the depth image, masks of a segmentation network. Out: a mask on a grid of cells, with the instance of each
//! cell.

pub(crate) mod depth_clusters;
pub(crate) mod mask;
pub(crate) mod segmenter;

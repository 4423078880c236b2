//! The images of one instant, with what is known about them.

use std::sync::Arc;

use crate::detect::Detection;
use crate::image::{DepthImage, Image, RgbImage};

/// One colour image with the image that gives its depth, if there is one. [`DepthSource`](crate::config::DepthSource) says which is used.
/// Images are shared, not copied.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Frame {
    /// Time of the colour image, ns.
    pub timestamp_ns: i64,
    /// Colour, as the camera delivers it (lens distortion not removed).
    pub color: Arc<RgbImage>,
    /// Depth, registered to the colour image: same size, same pixel grid.
    pub depth: Option<Arc<DepthImage>>,
    /// Time of the depth image, ns, where it has a time stamp of its own; else it is taken for that of the colour image.
    pub depth_timestamp_ns: Option<i64>,
    /// The right image of a rectified stereo pair, same size: a point at depth z lies `bf / z` px further left in it, in the same row.
    pub right: Option<Arc<RgbImage>>,
    /// Detections of movable objects that are known already, whatever their class. `Some` replaces the run of the system's own detector
    /// on this frame; the list may be empty.
    pub detections: Option<Vec<Detection>>,
    /// Pixels of movable objects: 0 where there is none, else the number of an instance.
    pub mask: Option<Arc<Image<u8>>>,
}

impl Frame {
    /// Makes the frame of an RGB-D camera; `timestamp_ns` is the time of the colour image.
    pub fn rgbd(timestamp_ns: i64, color: impl Into<Arc<RgbImage>>, depth: impl Into<Arc<DepthImage>>) -> Self {
        Self { depth: Some(depth.into()), ..Self::mono(timestamp_ns, color) }
    }

    /// Makes the frame of a rectified stereo pair.
    pub fn stereo(timestamp_ns: i64, left: impl Into<Arc<RgbImage>>, right: impl Into<Arc<RgbImage>>) -> Self {
        Self { right: Some(right.into()), ..Self::mono(timestamp_ns, left) }
    }

    /// Makes the frame of a single camera.
    pub fn mono(timestamp_ns: i64, color: impl Into<Arc<RgbImage>>) -> Self {
        let color = color.into();
        Self { timestamp_ns, color, depth: None, depth_timestamp_ns: None, right: None, detections: None, mask: None }
    }

    /// Adds detections of movable objects from another source.
    #[must_use]
    pub fn with_detections(mut self, detections: Vec<Detection>) -> Self {
        self.detections = Some(detections);
        self
    }

    /// Adds the mask of movable objects from a segmentation.
    #[must_use]
    pub fn with_mask(mut self, mask: impl Into<Arc<Image<u8>>>) -> Self {
        self.mask = Some(mask.into());
        self
    }
}

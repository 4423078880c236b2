//! What a camera delivers: one colour image and the depth image that belongs to it.

use std::sync::Arc;

use crate::detection::Detection;
use crate::image::{DepthImage, Image, RgbImage};

/// One colour image with its registered depth image: same size, same pixel grid.
#[derive(Clone, Debug)]
pub struct RgbdFrame {
    /// Time of the colour image in nanoseconds.
    pub timestamp_ns: i64,
    /// Colour, as the camera saw it (lens distortion not removed).
    pub color: Arc<RgbImage>,
    /// Depth, registered to the colour image.
    pub depth: Arc<DepthImage>,
    /// Boxes of movable objects that are known already, from an outside detector or a renderer, whatever their class. `Some` replaces
    /// the run of the system's own detector on this frame; the list may be empty.
    pub detections: Option<Vec<Detection>>,
    /// Which pixels show movable objects, from a segmentation outside or a renderer: 0 where there is none, else the number of one.
    pub mask: Option<Arc<Image<u8>>>,
}

//! What a camera delivers: one colour image and what tells its depth, a depth image or the right picture of a stereo pair.

use std::sync::Arc;

use crate::detection::Detection;
use crate::image::{DepthImage, Image, RgbImage};

/// One colour image with what belongs to it: a registered depth image (same size, same pixel grid), or the right picture of a rectified
/// stereo pair, or nothing, from a monocular camera. [`DepthSource`](crate::config::DepthSource) says which is used.
#[derive(Clone, Debug)]
pub struct RgbdFrame {
    /// Time of the colour image in nanoseconds.
    pub timestamp_ns: i64,
    /// Colour, as the camera saw it (lens distortion not removed).
    pub color: Arc<RgbImage>,
    /// Depth, registered to the colour image; zero in all pixels from a camera that measures none.
    pub depth: Arc<DepthImage>,
    /// What the right camera of a rectified stereo pair saw at that time, same size: a point at depth z lies `bf / z` px further left in
    /// it, in the same row. `None` from other cameras.
    pub right: Option<Arc<RgbImage>>,
    /// Boxes of movable objects that are known already, from an outside detector or a renderer, whatever their class. `Some` replaces
    /// the run of the system's own detector on this frame; the list may be empty.
    pub detections: Option<Vec<Detection>>,
    /// Which pixels show movable objects, from a segmentation outside or a renderer: 0 where there is none, else the number of one.
    pub mask: Option<Arc<Image<u8>>>,
}

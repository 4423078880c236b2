//! What the networks of this crate have in common beyond the core's `Detector`.

use yfslam::{Detector, Image};

/// A detection network, which may also segment the objects.
pub trait Network: Detector {
    /// Returns the object that each pixel of the last image shows: 0 for none, else 1 + its index in the output of
    /// [`Detector::detect`]; where objects overlap, the one with the highest score. `None` from networks without masks.
    fn objects(&self) -> Option<&Image<u16>> {
        None
    }
}

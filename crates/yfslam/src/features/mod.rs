//! ORB features of one image, and depth from a stereo pair.
//!
//! In: a grey image. Out: keypoints with 256-bit binary descriptors (ORB-SLAM2, IEEE T-RO 2017, section III).

mod brief;
mod cells;
mod distribute;
mod fast;
mod frame;
pub(crate) mod matching;
mod orb;
mod orientation;
mod pattern;
pub(crate) mod rolling_shutter;
pub(crate) mod stereo;
pub(crate) mod stereo_worker;

pub(crate) use frame::ImageBounds;
pub use frame::{Feature, FrameFeatures};
pub use orb::{Features, OrbExtractor};

/// Radius of the patch from which the orientation is computed, px of the level (Rublee et al., ICCV 2011: patch of 31 px).
pub(crate) const PATCH_RADIUS: usize = 15;

/// A keypoint: a corner of a pyramid level, in pixels of the full image.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct KeyPoint {
    /// Column in the full, distorted image, px (pixel centres at integers).
    pub x: f32,
    /// Row in the full, distorted image, px.
    pub y: f32,
    /// Pyramid level of the corner, 0 is the finest.
    pub octave: u8,
    /// Orientation by intensity centroid, rad in [0, 2π), clockwise in the image (x right, y down).
    pub angle_rad: f32,
    /// Corner score, comparable within one level.
    pub response: f32,
}

/// A 256-bit rotated BRIEF descriptor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Descriptor(pub [u64; 4]);

impl Descriptor {
    /// Returns the Hamming distance, 0–256.
    #[inline(always)]
    pub fn distance(&self, other: &Self) -> u32 {
        let (a, b) = (&self.0, &other.0);
        (a[0] ^ b[0]).count_ones()
            + (a[1] ^ b[1]).count_ones()
            + (a[2] ^ b[2]).count_ones()
            + (a[3] ^ b[3]).count_ones()
    }
}

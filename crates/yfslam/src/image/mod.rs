//! Image buffers (row-major, without padding, top row first) and the operations on them.
//!
//! In: raw buffers. Out: grey images, pyramids, blurred images, optical flow.

mod blur;
mod flow;
mod from_raw;
mod gray;
pub(crate) mod kernels;
pub(crate) mod plane;
mod pyramid;

pub(crate) use blur::{BLUR_RADIUS, blur};
pub(crate) use flow::Flow;
pub use from_raw::ImageError;
pub use gray::gray_from_rgb;
pub(crate) use plane::{LANES, Plane};
pub(crate) use pyramid::Pyramid;

/// A `width` × `height` image of pixels `T`, row-major without padding.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Image<T> {
    width: usize,
    height: usize,
    data: Vec<T>,
}

/// 8-bit grey image.
pub type GrayImage = Image<u8>;

/// 8-bit colour image, channels in the order red, green, blue.
pub type RgbImage = Image<[u8; 3]>;

impl<T: Copy + Default> Image<T> {
    /// Makes an image filled with `T::default()`.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, data: vec![T::default(); width * height] }
    }

    /// Makes an image of `data` (row-major); `None` unless it holds exactly `width * height` pixels.
    pub fn from_vec(width: usize, height: usize, data: Vec<T>) -> Option<Self> {
        (data.len() == width.checked_mul(height)?).then_some(Self { width, height, data })
    }

    /// Changes the size and keeps the allocation if it is large enough; pixel values are unspecified afterwards.
    pub fn resize(&mut self, width: usize, height: usize) {
        self.width = width;
        self.height = height;
        self.data.resize(width * height, T::default());
    }
}

impl<T> Image<T> {
    /// Returns the number of pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Returns the number of rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Returns all pixels, row-major.
    pub fn data(&self) -> &[T] {
        &self.data
    }

    /// Returns all pixels, row-major, for writing.
    pub fn data_mut(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// Returns row `y`.
    pub fn row(&self, y: usize) -> &[T] {
        &self.data[y * self.width..(y + 1) * self.width]
    }

    /// Returns row `y` for writing.
    pub fn row_mut(&mut self, y: usize) -> &mut [T] {
        &mut self.data[y * self.width..(y + 1) * self.width]
    }

    /// Returns the pixel at column `x` and row `y`; `None` outside the image.
    pub fn get(&self, x: usize, y: usize) -> Option<&T> {
        (x < self.width && y < self.height).then(|| &self.data[y * self.width + x])
    }
}

/// A depth image in the units of the sensor.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DepthImage {
    /// Depth along the optical axis, in units of `metres_per_unit`; 0 where nothing was measured.
    pub raw: Image<u16>,
    /// Metres per unit, such as 1/5000 for TUM recordings.
    pub metres_per_unit: f32,
}

impl DepthImage {
    /// Returns the depth in metres at column `x` and row `y`; `None` outside the image or where nothing was measured.
    pub fn metres(&self, x: usize, y: usize) -> Option<f32> {
        match self.raw.get(x, y) {
            Some(&raw) if raw > 0 => Some(f32::from(raw) * self.metres_per_unit),
            _ => None,
        }
    }
}

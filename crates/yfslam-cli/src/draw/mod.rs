//! Drawing on images.

pub mod dense_image;
pub mod shapes;

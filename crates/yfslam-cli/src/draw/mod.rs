//! Drawing on images, and encoding them.

pub mod animated_png;
pub mod colors;
pub mod dense_image;
pub mod grid_image;
pub mod shapes;
pub mod shrink;
pub mod text;

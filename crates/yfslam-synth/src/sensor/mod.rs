//! The sensor: what exposure, noise, quantisation and holes make of an exact picture. Every draw is a hash of seed, frame and
//! pixel, so that any frame can be made at any time.

pub mod blur;
pub mod color;
pub mod depth;
pub mod exposure;

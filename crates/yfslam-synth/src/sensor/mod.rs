//! The sensor: adds the effects of exposure, noise, quantisation and holes to an exact rendering. Every random draw is a hash of
//! seed, frame and pixel, so that frames can be rendered in any order.

pub mod blur;
pub mod color;
pub mod depth;
pub mod exposure;
pub mod shutter;

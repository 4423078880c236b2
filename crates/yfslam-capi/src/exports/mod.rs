//! The exported functions, in the order of the header.

pub mod library;
pub mod recording;
pub mod results;
pub mod slam;

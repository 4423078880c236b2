//! The targets, by what they read.

pub mod bags;
pub mod evaluation;
pub mod frames;
pub mod images;
pub mod maps;
pub mod network;
pub mod pipe;
pub mod sequences;
pub mod texts;

/// Most pixels of an image or a camera with which a target does more than read it. The readers allow far more, which would only take
/// time here.
const MOST_PIXELS: usize = 1 << 20;

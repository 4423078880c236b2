//! The frames of the coordinates in files, as their headers state them.

use std::fmt;

/// The frame in which a file has its coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinates {
    /// The world of the keyframes.
    World,
    /// The map frame.
    Map,
}

impl fmt::Display for Coordinates {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::World => "frame world: the first camera (x right, y down, z forward), m",
            Self::Map => "frame map: z up, x to the front of the first image, y to its left (REP 103), m",
        })
    }
}

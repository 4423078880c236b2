//! The span of a relative pose error.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Span between the two poses of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Delta {
    /// Matched poses.
    Frames(usize),
    /// Time, s.
    Seconds(f64),
    /// Path travelled, m.
    Metres(f64),
}

impl fmt::Display for Delta {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frames(1) => f.write_str("1 frame"),
            Self::Frames(n) => write!(f, "{n} frames"),
            Self::Seconds(s) => write!(f, "{s} s"),
            Self::Metres(m) => write!(f, "{m} m"),
        }
    }
}

//! The readout time of a rolling shutter, as reports and summaries show it.

use std::fmt;

use serde::Serialize;
use yfslam::Readout;

/// How the readout time of the rows of an image is known.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ReadoutReport {
    /// Time from the first to the last row, as it was used at the end of the run, ms; 0 is a global shutter.
    pub in_use_ms: f64,
    pub origin: ReadoutOrigin,
    /// The estimate of the run, ms; `null` without one.
    pub estimate_ms: Option<f64>,
    /// Its standard deviation, ms; `null` without an estimate.
    pub sigma_ms: Option<f64>,
    /// Whether the estimate was certain; one that is not is used for the time being.
    pub is_certain: bool,
}

/// Where the readout time in use comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum ReadoutOrigin {
    #[serde(rename = "camera")]
    Camera,
    #[serde(rename = "estimated")]
    Estimated,
    /// The camera file does not mention it, and there is no certain estimate: the shutter is taken for global.
    #[serde(rename = "assumed global")]
    AssumedGlobal,
}

impl From<Readout> for ReadoutReport {
    fn from(readout: Readout) -> Self {
        let origin = match readout {
            Readout { from_camera: true, .. } => ReadoutOrigin::Camera,
            // A certain estimate that is not in use was one of a global shutter.
            Readout { in_use_ms, is_certain, .. } if in_use_ms != 0.0 || is_certain => ReadoutOrigin::Estimated,
            _ => ReadoutOrigin::AssumedGlobal,
        };
        let Readout { in_use_ms, estimate_ms, sigma_ms, is_certain, .. } = readout;
        Self { in_use_ms, origin, estimate_ms, sigma_ms, is_certain }
    }
}

impl ReadoutReport {
    /// Returns whether images are corrected for a rolling shutter, or were searched for one although the camera file tells the shutter.
    pub fn is_noteworthy(&self) -> bool {
        self.in_use_ms != 0.0 || (self.origin == ReadoutOrigin::Camera && self.estimate_ms.is_some())
    }
}

impl fmt::Display for ReadoutReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { in_use_ms, origin, .. } = *self;
        let estimate = self.estimate_ms.zip(self.sigma_ms);
        match (origin, estimate) {
            (ReadoutOrigin::Camera, None) => write!(f, "{in_use_ms:.1} ms (from the camera file)"),
            (ReadoutOrigin::Camera, Some((estimate, sigma))) => {
                write!(f, "{in_use_ms:.1} ms (from the camera file; estimated: {estimate:.1} ± {sigma:.1})")
            }
            (ReadoutOrigin::Estimated, Some((_, sigma))) => write!(f, "{in_use_ms:.1} ms (estimated, ± {sigma:.1})"),
            (ReadoutOrigin::Estimated, None) => write!(f, "{in_use_ms:.1} ms (estimated)"),
            (ReadoutOrigin::AssumedGlobal, None) => f.write_str("0 ms (a global shutter is assumed)"),
            (ReadoutOrigin::AssumedGlobal, Some((estimate, sigma))) => {
                write!(f, "0 ms (a global shutter is assumed; the estimate of {estimate:.1} ± {sigma:.1} is uncertain)")
            }
        }
    }
}

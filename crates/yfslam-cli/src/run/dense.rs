//! The dense map of a run and its cost.

use std::time::Duration;

use anyhow::Result;
use serde::Serialize;
use yfslam::Statistics;
use yfslam::dense::DenseMap;

/// The dense map at the end of a run.
pub struct DenseResult {
    pub map: DenseMap,
    /// The map as the bytes of its file.
    pub encoded: Vec<u8>,
}

impl DenseResult {
    /// Encodes the map.
    ///
    /// # Errors
    /// It cannot be encoded, which would be a fault of this program.
    pub fn new(map: DenseMap) -> Result<Self> {
        Ok(Self { encoded: map.to_bytes()?, map })
    }
}

/// The cost of a dense map.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct DenseCost {
    /// Keyframes that have a patch.
    pub keyframes: usize,
    /// Processor time of the tracking thread for each of them, ms: extracting the patch and, unless mapping has threads of its own,
    /// following the map.
    pub cpu_ms_per_keyframe: f64,
    /// Memory of the patches, MB (10⁶ bytes).
    pub patches_mb: f64,
    /// Patches that were dropped because the thread of the dense map was busy.
    pub patches_dropped: usize,
}

impl DenseCost {
    /// Returns the cost of `patches` patches, which took `cpu` together.
    pub fn new(statistics: &Statistics, patches: usize, cpu: Duration) -> Self {
        Self {
            keyframes: patches,
            cpu_ms_per_keyframe: (cpu.as_secs_f64() * 1e6 / patches.max(1) as f64).round() / 1e3,
            patches_mb: (statistics.dense_bytes as f64 / 1e5).round() / 10.0,
            patches_dropped: statistics.dense_patches_skipped,
        }
    }
}

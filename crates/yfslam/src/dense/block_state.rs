//! The occupancy of one block of voxels: log-odds summed over the observations of patches (OctoMap, section 4).
//!
//! In: the voxels that each patch observes as occupied and as free. Out: the log-odds of each voxel.

use crate::dense::DenseConfig;
use crate::dense::voxels::{Bits, VOXELS};

/// Log-odds are stored in thousandths.
pub(super) const PER_UNIT: f32 = 1000.0;

/// The probabilities of the configuration as log-odds, in thousandths.
#[derive(Clone, Copy, Debug)]
pub(super) struct Steps {
    hit: i16,
    miss: i16,
    min: i16,
    max: i16,
    pub occupied: i16,
}

impl Steps {
    /// Converts the probabilities of a configuration.
    pub(super) fn new(config: &DenseConfig) -> Self {
        let log_odds = |p: f32| (libm::logf(p / (1.0 - p)) * PER_UNIT).round() as i16;
        Self {
            hit: log_odds(config.p_hit),
            miss: log_odds(config.p_miss),
            min: log_odds(config.clamp_min),
            max: log_odds(config.clamp_max),
            occupied: log_odds(config.occupied),
        }
    }
}

/// The observations of a block by patches, in the order of their numbers, and their sum.
#[derive(Clone, Debug, Default)]
pub(super) struct BlockState {
    /// For each patch its number, the occupied and the free voxels.
    pub observations: Vec<(u32, Bits, Bits)>,
    /// Number of observations that have been added up.
    pub summed: usize,
    /// Voxels that are known to be occupied or free.
    pub known: Bits,
    /// Log-odds of each voxel, in thousandths; empty before the first sum.
    pub log_odds: Vec<i16>,
}

impl BlockState {
    /// Adds up the observations that are not in the sum yet.
    pub(super) fn sum_up(&mut self, steps: &Steps) {
        if self.summed == self.observations.len() {
            return;
        }
        if self.summed == 0 {
            self.known = Bits::default();
            self.log_odds.clear();
            self.log_odds.resize(VOXELS, 0);
        }
        let (known, log_odds) = (&mut self.known, &mut self.log_odds);
        for (_, hit, free) in &self.observations[self.summed..] {
            known.insert_all(hit);
            known.insert_all(free);
            hit.for_each(|index| log_odds[index] = (log_odds[index] + steps.hit).min(steps.max));
            free.for_each(|index| log_odds[index] = (log_odds[index] + steps.miss).max(steps.min));
        }
        self.summed = self.observations.len();
    }
}

//! Nearest descriptors, and rotation consistency: correct matches between two images turn by the same angle (ORB-SLAM, IEEE T-RO 2015,
//! section V-B).
//!
//! In: descriptors, or the change of orientation of each match. Out: the two nearest descriptors, or the matches that are outliers.

use fearless_simd::{Level, Simd, dispatch};

use super::Descriptor;

/// A descriptor near a query.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Neighbor {
    /// Index among all descriptors.
    pub index: u32,
    /// Hamming distance, 0–256.
    pub distance: u32,
}

/// Returns the nearest and the second nearest to `query` among `descriptors[i]` for all `i` in `candidates`.
///
/// Of equally near ones the earlier candidate comes first; indices out of range are skipped.
pub(crate) fn two_nearest(query: &Descriptor, descriptors: &[Descriptor], candidates: &[u32]) -> [Option<Neighbor>; 2] {
    // Baseline x86-64 has no population count instruction, hence the compilation for each instruction set.
    dispatch!(Level::new(), simd => search(simd, query, descriptors, candidates))
}

#[inline(always)]
fn search<S: Simd>(_: S, query: &Descriptor, descriptors: &[Descriptor], candidates: &[u32]) -> [Option<Neighbor>; 2] {
    let none = Neighbor { index: 0, distance: u32::MAX };
    let (mut first, mut second) = (none, none);
    for &index in candidates {
        let Some(descriptor) = descriptors.get(index as usize) else { continue };
        let distance = query.distance(descriptor);
        if distance < first.distance {
            (first, second) = (Neighbor { index, distance }, first);
        } else if distance < second.distance {
            second = Neighbor { index, distance };
        }
    }
    [first, second].map(|neighbor| (neighbor.distance < u32::MAX).then_some(neighbor))
}

/// Number of bins of the rotation histogram. Source: ORB-SLAM2.
const BINS: usize = 30;

/// Histogram of the change of orientation of each match; matches outside its three highest bins are outliers.
#[derive(Clone, Debug, Default)]
pub(crate) struct RotationHistogram {
    entries: Vec<(u8, u32)>,
}

impl RotationHistogram {
    /// Removes all matches.
    pub(crate) fn clear(&mut self) {
        self.entries.clear();
    }

    /// Adds match `payload`, whose orientation changed by `turn_rad` (any angle).
    pub(crate) fn add(&mut self, turn_rad: f32, payload: u32) {
        let turns = turn_rad / std::f32::consts::TAU;
        // The fraction may round up to 1.
        let bin = ((turns - turns.floor()) * BINS as f32) as usize % BINS;
        self.entries.push((bin as u8, payload));
    }

    /// Calls `visit` for each match outside the dominant bins. The second and third highest bins are dominant only if they hold at least
    /// a tenth of the highest.
    pub(crate) fn for_each_outlier(&self, mut visit: impl FnMut(u32)) {
        let mut counts = [0usize; BINS];
        for (bin, _) in &self.entries {
            counts[usize::from(*bin)] += 1;
        }
        let mut order: [usize; BINS] = std::array::from_fn(|i| i);
        order.sort_by_key(|&bin| std::cmp::Reverse(counts[bin]));
        let dominant =
            order[..3].iter().filter(|&&bin| counts[bin] * 10 >= counts[order[0]]).fold(0u32, |m, &b| m | 1 << b);
        for &(bin, payload) in &self.entries {
            if dominant & (1 << bin) == 0 {
                visit(payload);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn descriptors() -> impl Strategy<Value = Vec<Descriptor>> {
        // Only few bits are set, so that equal distances occur.
        proptest::collection::vec([0u64..4, 0u64..2, 0u64..2, 0u64..2].prop_map(Descriptor), 1..20)
    }

    proptest! {
        #[test]
        fn the_two_nearest_are_the_first_two_of_all_sorted(descriptors in descriptors(), candidates in proptest::collection::vec(0u32..25, 0..20)) {
            let query = descriptors[0];
            let mut all: Vec<Neighbor> = candidates
                .iter()
                .filter_map(|&index| Some(Neighbor { index, distance: query.distance(descriptors.get(index as usize)?) }))
                .collect();
            all.sort_by_key(|neighbor| neighbor.distance);
            let expected = [all.first().copied(), all.get(1).copied()];
            prop_assert_eq!(two_nearest(&query, &descriptors, &candidates), expected);
        }
    }

    #[test]
    fn matches_outside_the_dominant_bins_are_outliers() {
        let mut histogram = RotationHistogram::default();
        for i in 0..40 {
            histogram.add(0.3 + 0.001 * i as f32 - std::f32::consts::TAU, i);
        }
        for i in 40..43 {
            histogram.add(1.0 + i as f32, i);
        }
        let mut outliers = Vec::new();
        histogram.for_each_outlier(|i| outliers.push(i));
        assert_eq!(outliers, [40, 41, 42]);
    }
}

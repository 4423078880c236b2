//! Comparing descriptors.
//!
//! In: descriptors and the indices worth comparing. Out: nearest neighbours in Hamming distance, and which matches agree on a
//! rotation (ORB-SLAM, IEEE T-RO 2015, sections IV and V; constants as in ORB-SLAM2).

use std::f32::consts::TAU;

use fearless_simd::{Level, Simd, dispatch};

use super::Descriptor;

/// One of the descriptors compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Neighbor {
    /// Its index among all descriptors.
    pub index: u32,
    /// Number of differing bits, 0–256.
    pub distance: u32,
}

/// The nearest and the second nearest to `query` among `descriptors[i]` for all `i` in `candidates`.
///
/// Of equally near ones the earlier candidate comes first; indices out of range are passed over.
pub fn two_nearest(query: &Descriptor, descriptors: &[Descriptor], candidates: &[u32]) -> [Option<Neighbor>; 2] {
    // The baseline of x86-64 has no instruction that counts bits.
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

/// Bins of the rotation histogram. Source: ORB-SLAM2.
const ROTATION_BINS: usize = 30;

/// Bins that may count as consistent. Source: ORB-SLAM2.
const ROTATION_MAXIMA: usize = 3;

/// A lesser maximum counts only from this fraction of the greatest on. Source: ORB-SLAM2.
const ROTATION_MIN_FRACTION: f32 = 0.1;

/// Tells for each match whether its rotation (angle of one key point minus that of the other, radians) agrees with the bulk:
/// whether it falls into one of the three fullest of 30 bins, the second and third not below a tenth of the first.
///
/// `consistent` takes the length of `rotations_rad`. Of equally full bins the one with the smaller angle comes first.
pub fn consistent_rotations(rotations_rad: &[f32], consistent: &mut Vec<bool>) {
    let bin =
        |rotation: f32| (rotation.rem_euclid(TAU) * (ROTATION_BINS as f32 / TAU)).round() as usize % ROTATION_BINS;
    let mut counts = [0u32; ROTATION_BINS];
    for &rotation in rotations_rad {
        counts[bin(rotation)] += 1;
    }
    let mut fullest: [usize; ROTATION_BINS] = std::array::from_fn(|bin| bin);
    fullest.sort_unstable_by_key(|&bin| (std::cmp::Reverse(counts[bin]), bin));
    let least = counts[fullest[0]] as f32 * ROTATION_MIN_FRACTION;
    let mut kept = [false; ROTATION_BINS];
    for &bin in &fullest[..ROTATION_MAXIMA] {
        kept[bin] = counts[bin] as f32 >= least;
    }
    consistent.clear();
    consistent.extend(rotations_rad.iter().map(|&rotation| kept[bin(rotation)]));
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn descriptors() -> impl Strategy<Value = Vec<Descriptor>> {
        // Few bits set, so that equal distances occur.
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
    fn matches_off_the_common_rotation_are_told_apart() {
        let mut rotations = vec![0.1; 50];
        rotations.extend([0.1 + TAU, 0.1 - TAU]);
        rotations.extend([2.0; 6]); // a second maximum above a tenth
        rotations.extend([4.0; 5]); // a third maximum below a tenth
        let mut consistent = Vec::new();
        consistent_rotations(&rotations, &mut consistent);
        assert_eq!(consistent[..58], [true; 58]);
        assert_eq!(consistent[58..], [false; 5]);
    }

    #[test]
    fn no_more_than_three_rotations_are_kept() {
        let rotations: Vec<f32> = (0..20).map(|i| (i % 5) as f32).collect();
        let mut consistent = Vec::new();
        consistent_rotations(&rotations, &mut consistent);
        let expected: Vec<bool> = (0..20).map(|i| i % 5 < 3).collect();
        assert_eq!(consistent, expected);
    }

    #[test]
    fn no_matches_and_angles_that_are_not_numbers_do_no_harm() {
        let mut consistent = vec![true];
        consistent_rotations(&[], &mut consistent);
        assert!(consistent.is_empty());
        consistent_rotations(&[f32::NAN, f32::INFINITY, 1.0], &mut consistent);
        assert_eq!(consistent.len(), 3);
    }
}

//! The largest group of similar depths (YF-SLAM, section 3.3; for details that it leaves open, YOLO-SLAM, Neural Computing &
//! Applications 2022).
//!
//! In: sorted depths. Out: the interval of a given width that holds most of them, found by random pairs (Geometric Depth RANSAC) or
//! exactly.

use rand_pcg::Pcg32;
use rand_pcg::rand_core::Rng;

/// A group of similar depths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DepthGroup {
    /// Least depth, m.
    pub near_m: f32,
    /// Greatest depth, m.
    pub far_m: f32,
    /// Number of members.
    pub members: usize,
}

/// Probability with which RANSAC should have drawn from the largest group. Source: YOLO-SLAM's k = log(1 − P) / log(1 − ω²).
const RANSAC_CONFIDENCE: f64 = 0.99;
/// Upper limit of the number of draws.
const RANSAC_MAX_DRAWS: f64 = 200.0;

/// Returns the interval of width `width_m` that holds most of `sorted` (ascending); of equally large ones the nearest. `None` for
/// no depths.
pub(crate) fn largest_exact(sorted: &[f32], width_m: f32) -> Option<DepthGroup> {
    let mut best: Option<DepthGroup> = None;
    let mut end = 0;
    for (start, &near) in sorted.iter().enumerate() {
        while end < sorted.len() && sorted[end] <= near + width_m {
            end += 1;
        }
        if best.is_none_or(|b| end - start > b.members) {
            best = Some(DepthGroup { near_m: near, far_m: sorted[end - 1], members: end - start });
        }
    }
    best
}

/// Returns the group found by Geometric Depth RANSAC: random pairs of similar depth propose their mean; depths within half of
/// `width_m` of it are members.
///
/// YOLO-SLAM tests the variance of the pair and a third depth; for a pair at distance 2e and a depth δ from its mean that is (2e² +
/// 2δ²/3)/3, so a bound on the variance is a bound on δ. Here it is given as the width, in metres.
pub(crate) fn largest_ransac(sorted: &[f32], width_m: f32, rng: &mut Pcg32) -> Option<DepthGroup> {
    let n = sorted.len();
    if n < 3 {
        return largest_exact(sorted, width_m);
    }
    let half = 0.5 * width_m;
    let mut best: Option<DepthGroup> = None;
    let (mut draws, mut needed) = (0.0, RANSAC_MAX_DRAWS);
    while draws < needed {
        draws += 1.0;
        let mut pick = || sorted[((u64::from(rng.next_u32()) * n as u64) >> 32) as usize];
        let (a, b) = (pick(), pick());
        if (a - b).abs() > half {
            continue;
        }
        let mean = 0.5 * (a + b);
        let start = sorted.partition_point(|z| *z < mean - half);
        let end = sorted.partition_point(|z| *z <= mean + half);
        let members = end - start;
        if best.is_none_or(|b| members > b.members) {
            best = Some(DepthGroup { near_m: sorted[start], far_m: sorted[end - 1], members });
            let ratio = members as f64 / n as f64;
            needed = (libm::log(1.0 - RANSAC_CONFIDENCE) / libm::log((1.0 - ratio * ratio).max(1e-12)))
                .clamp(1.0, RANSAC_MAX_DRAWS);
        }
    }
    best.or_else(|| largest_exact(sorted, width_m))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_exact_group_is_at_least_as_large_as_any_window(mut depths in prop::collection::vec(0.3f32..8.0, 1..80), width in 0.05f32..2.0) {
            depths.sort_by(f32::total_cmp);
            let best = largest_exact(&depths, width).map_or(0, |g| g.members);
            for &near in &depths {
                prop_assert!(depths.iter().filter(|z| **z >= near && **z <= near + width).count() <= best);
            }
        }

        #[test]
        fn ransac_never_exceeds_the_exact_group_and_repeats_with_its_seed(mut depths in prop::collection::vec(0.3f32..8.0, 1..80), seed: u64) {
            depths.sort_by(f32::total_cmp);
            let run = || largest_ransac(&depths, 0.6, &mut Pcg32::new(seed, 1));
            prop_assert_eq!(run(), run());
            prop_assert!(run().map(|g| g.members) <= largest_exact(&depths, 0.6).map(|g| g.members));
        }
    }

    #[test]
    fn both_find_a_person_in_front_of_a_wall() {
        let mut depths: Vec<f32> = (0..60).map(|i| 1.4 + 0.004 * i as f32).collect();
        depths.extend((0..25).map(|i| 3.0 + 0.01 * i as f32));
        for group in [largest_exact(&depths, 0.6), largest_ransac(&depths, 0.6, &mut Pcg32::new(7, 1))] {
            assert!(group.is_some_and(|g| g.members >= 58 && g.far_m < 2.0), "{group:?}");
        }
    }

    #[test]
    fn no_depths_make_no_group() {
        assert_eq!(largest_exact(&[], 0.6), None);
        assert_eq!(largest_ransac(&[], 0.6, &mut Pcg32::new(7, 1)), None);
    }
}

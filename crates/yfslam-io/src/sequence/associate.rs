//! Pairs colour and depth images by time stamp, as the TUM RGB-D benchmark's association does: closest pairs first, each image once.

/// How many neighbours in time, on each side, compete for an image. At 30 Hz that is ±0.27 s; it bounds the work for any tolerance.
const NEIGHBOURS: usize = 8;

/// Index pairs (colour, depth) whose stamps differ by at most `tolerance_ns`, in the order of the colour stamps.
///
/// Both lists ascend strictly. Ties go to the earlier colour, then the earlier depth image.
pub fn associate(color_ns: &[i64], depth_ns: &[i64], tolerance_ns: i64) -> Vec<(usize, usize)> {
    let mut candidates = Vec::new();
    for (c, &stamp) in color_ns.iter().enumerate() {
        let after = depth_ns.partition_point(|&d| d < stamp);
        let from = after.saturating_sub(NEIGHBOURS);
        for (d, &depth) in depth_ns.iter().enumerate().skip(from).take(after - from + NEIGHBOURS) {
            let offset = stamp.abs_diff(depth);
            if offset <= tolerance_ns.unsigned_abs() {
                candidates.push((offset, c, d));
            }
        }
    }
    candidates.sort_unstable();

    let (mut color_used, mut depth_used) = (vec![false; color_ns.len()], vec![false; depth_ns.len()]);
    candidates.retain(|&(_, c, d)| {
        let free = !color_used[c] && !depth_used[d];
        if free {
            (color_used[c], depth_used[d]) = (true, true);
        }
        free
    });
    let mut pairs: Vec<_> = candidates.into_iter().map(|(_, c, d)| (c, d)).collect();
    pairs.sort_unstable();
    pairs
}

/// Which entries of a list of stamps to keep so that the stamps ascend strictly and the fewest entries are lost.
#[derive(Debug, PartialEq, Eq)]
pub struct Ascending {
    /// Indices kept, ascending.
    pub kept: Vec<usize>,
    /// Entries dropped because their stamp is there already.
    pub duplicates: usize,
    /// Entries dropped because their stamp runs backward against its neighbours.
    pub backward: usize,
}

/// Finds the longest strictly ascending subsequence (patience sorting).
///
/// One stamp far in the future thus costs one entry, not all that follow it.
pub fn ascending(stamps_ns: &[i64]) -> Ascending {
    // From the end, so that where two entries contradict each other the earlier one stays.
    // heads[k]: index of the largest stamp that begins an ascending run of k + 1 entries.
    let mut heads: Vec<usize> = Vec::new();
    let mut next = vec![None; stamps_ns.len()];
    for (i, &stamp) in stamps_ns.iter().enumerate().rev() {
        let length = heads.partition_point(|&h| stamps_ns[h] > stamp);
        next[i] = length.checked_sub(1).map(|k| heads[k]);
        match heads.get_mut(length) {
            Some(head) => *head = i,
            None => heads.push(i),
        }
    }
    let kept: Vec<usize> = std::iter::successors(heads.last().copied(), |&i| next[i]).collect();

    let lost = stamps_ns.len() - kept.len();
    let is_kept = |stamp: i64| kept.binary_search_by_key(&stamp, |&k| stamps_ns[k]).is_ok();
    let duplicates = stamps_ns.iter().filter(|&&stamp| is_kept(stamp)).count() - kept.len();
    Ascending { kept, duplicates, backward: lost - duplicates }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_closest_pairs_win_and_no_image_is_used_twice() {
        assert_eq!(associate(&[0, 100, 200], &[20, 99, 201], 30), [(0, 0), (1, 1), (2, 2)]);
        // Both colours are near depth 10; the closer gets it, the other goes without.
        assert_eq!(associate(&[5, 11], &[10], 30), [(1, 0)]);
        assert_eq!(associate(&[0, 100], &[21, 79], 20), []);
        assert_eq!(associate(&[0], &[20], 20), [(0, 0)]);
        // A tie goes to the earlier one.
        assert_eq!(associate(&[10], &[5, 15], 20), [(0, 0)]);
    }

    #[test]
    fn the_fewest_entries_are_dropped_to_make_stamps_ascend() {
        let found = ascending(&[1, 2, 900, 3, 3, 4, 0]);
        assert_eq!(found, Ascending { kept: vec![0, 1, 3, 5], duplicates: 1, backward: 2 });
        assert_eq!(ascending(&[0, 2, 1, 5]).kept, [0, 1, 3]);
        assert_eq!(ascending(&[]).kept, Vec::<usize>::new());
        assert_eq!(ascending(&[7, 7, 7]), Ascending { kept: vec![0], duplicates: 2, backward: 0 });
    }

    proptest! {
        #[test]
        fn association_uses_each_image_once_within_the_tolerance(
            color in prop::collection::btree_set(0i64..1000, 0..60),
            depth in prop::collection::btree_set(0i64..1000, 0..60),
            tolerance in 0i64..100,
        ) {
            let (color, depth): (Vec<_>, Vec<_>) = (color.into_iter().collect(), depth.into_iter().collect());
            let pairs = associate(&color, &depth, tolerance);
            let depths: std::collections::BTreeSet<_> = pairs.iter().map(|p| p.1).collect();
            prop_assert_eq!(depths.len(), pairs.len());
            prop_assert!(pairs.windows(2).all(|w| w[0].0 < w[1].0));
            prop_assert!(pairs.iter().all(|&(c, d)| color[c].abs_diff(depth[d]) <= tolerance as u64));
        }

        #[test]
        fn what_is_kept_ascends_and_everything_is_accounted_for(stamps in prop::collection::vec(-20i64..20, 0..60)) {
            let found = ascending(&stamps);
            prop_assert!(found.kept.windows(2).all(|w| w[0] < w[1] && stamps[w[0]] < stamps[w[1]]));
            prop_assert_eq!(found.kept.len() + found.duplicates + found.backward, stamps.len());
            // No longer ascending run exists: the quadratic reference agrees.
            let mut longest = vec![0; stamps.len()];
            for i in 0..stamps.len() {
                longest[i] = 1 + (0..i).filter(|&j| stamps[j] < stamps[i]).map(|j| longest[j]).max().unwrap_or(0);
            }
            prop_assert_eq!(found.kept.len(), longest.into_iter().max().unwrap_or(0));
        }
    }
}

//! Association of colour and depth images by time stamp as in the TUM RGB-D benchmark: closest pairs first, each image once.

/// Neighbours in time, on each side, that are candidates for an image: ±0.27 s at 30 Hz. This bounds the work for any tolerance.
const NEIGHBOURS: usize = 8;

/// Returns index pairs (colour, depth) whose stamps differ by at most `tolerance_ns`, in the order of the colour stamps.
///
/// Both lists ascend strictly. In a tie the earlier colour image wins, then the earlier depth image.
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_closest_pairs_win_and_no_image_is_used_twice() {
        assert_eq!(associate(&[0, 100, 200], &[20, 99, 201], 30), [(0, 0), (1, 1), (2, 2)]);
        // Both colour images are close to depth 10; only the closer one is paired.
        assert_eq!(associate(&[5, 11], &[10], 30), [(1, 0)]);
        assert_eq!(associate(&[0, 100], &[21, 79], 20), []);
        assert_eq!(associate(&[0], &[20], 20), [(0, 0)]);
        // In a tie the earlier one wins.
        assert_eq!(associate(&[10], &[5, 15], 20), [(0, 0)]);
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
    }
}

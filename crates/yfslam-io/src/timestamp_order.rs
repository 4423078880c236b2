//! Removes repeated and backward time stamps from a recording and counts them.

use std::path::Path;

use crate::error::{Error, Result};

/// Items whose stamps ascend strictly, and how many were dropped.
#[derive(Debug)]
pub struct Kept<T> {
    /// The kept items in their order.
    pub items: Vec<T>,
    /// Items dropped because their stamp occurred before.
    pub duplicates: usize,
    /// Items dropped because their stamp runs backward against its neighbours.
    pub backward: usize,
}

/// Drops the fewest items that make the stamps ascend strictly.
///
/// # Errors
/// More than half of the stamps run backward: then `path` is an unsorted file.
pub fn keep_ascending<T>(items: Vec<T>, stamp_ns: impl Fn(&T) -> i64, path: &Path) -> Result<Kept<T>> {
    let found = ascending(&items.iter().map(stamp_ns).collect::<Vec<_>>());
    if found.backward > items.len() / 2 {
        let problem = format!("{} of its {} stamps run backward", found.backward, items.len());
        return Err(Error::content(path, problem, "sort the file by its first column"));
    }
    let mut kept = found.kept.into_iter().peekable();
    let items =
        items.into_iter().enumerate().filter(|(i, _)| kept.next_if_eq(i).is_some()).map(|(_, item)| item).collect();
    Ok(Kept { items, duplicates: found.duplicates, backward: found.backward })
}

/// The longest strictly ascending selection from a list of stamps.
#[derive(Debug, PartialEq, Eq)]
struct Ascending {
    /// Indices kept, ascending.
    kept: Vec<usize>,
    /// Entries dropped because their stamp occurred before.
    duplicates: usize,
    /// Entries dropped because their stamp runs backward against its neighbours.
    backward: usize,
}

/// Finds the longest strictly ascending subsequence by patience sorting.
///
/// A single stamp far in the future costs one entry and not all that follow.
fn ascending(stamps_ns: &[i64]) -> Ascending {
    // Backward, so that the earlier of two contradicting entries is kept.
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
    fn the_fewest_entries_are_dropped_to_make_stamps_ascend() {
        let found = ascending(&[1, 2, 900, 3, 3, 4, 0]);
        assert_eq!(found, Ascending { kept: vec![0, 1, 3, 5], duplicates: 1, backward: 2 });
        assert_eq!(ascending(&[0, 2, 1, 5]).kept, [0, 1, 3]);
        assert_eq!(ascending(&[]).kept, Vec::<usize>::new());
        assert_eq!(ascending(&[7, 7, 7]), Ascending { kept: vec![0], duplicates: 2, backward: 0 });
    }

    proptest! {
        #[test]
        fn kept_stamps_ascend_and_every_entry_is_counted(stamps in prop::collection::vec(-20i64..20, 0..60)) {
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

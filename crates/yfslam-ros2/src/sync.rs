//! Pairs the images of two topics by their time stamps.
//!
//! In: images of both topics, each topic in order. Out: pairs whose stamps differ by no more than the tolerance, each image in one pair
//! at most, in order; and how many images found no partner.
//!
//! A pair with equal stamps is made at once. Else the partner is the nearest one, which is known when the other topic has passed the
//! stamp, or when the next image of the own topic is there.

use std::collections::VecDeque;

/// Images of a topic that wait for their partner.
const DEPTH: usize = 8;

/// Pairs the images of two topics.
#[derive(Debug)]
pub struct PairSync<A, B> {
    tolerance_ns: i64,
    first: VecDeque<(i64, A)>,
    second: VecDeque<(i64, B)>,
    /// Images without a partner: of the first and the second topic.
    unpaired: [u64; 2],
}

impl<A, B> PairSync<A, B> {
    /// Pairs images whose stamps differ by no more than `tolerance_ns`; 0 asks for equal stamps.
    pub fn new(tolerance_ns: i64) -> Self {
        Self { tolerance_ns, first: VecDeque::new(), second: VecDeque::new(), unpaired: [0; 2] }
    }

    /// Adds an image of the first topic; returns the pairs that it completes.
    pub fn push_first(&mut self, stamp_ns: i64, image: A) -> Vec<(i64, A, i64, B)> {
        if self.first.back().is_some_and(|(last, _)| stamp_ns <= *last) {
            // The clock went back: what waits is of another time.
            self.clear();
        }
        self.first.push_back((stamp_ns, image));
        self.pairs()
    }

    /// Adds an image of the second topic; returns the pairs that it completes.
    pub fn push_second(&mut self, stamp_ns: i64, image: B) -> Vec<(i64, A, i64, B)> {
        if self.second.back().is_some_and(|(last, _)| stamp_ns <= *last) {
            self.clear();
        }
        self.second.push_back((stamp_ns, image));
        self.pairs()
    }

    /// Returns how many images of the first and of the second topic found no partner.
    pub fn unpaired(&self) -> [u64; 2] {
        self.unpaired
    }

    fn clear(&mut self) {
        self.unpaired[0] += self.first.len() as u64;
        self.unpaired[1] += self.second.len() as u64;
        self.first.clear();
        self.second.clear();
    }

    fn pairs(&mut self) -> Vec<(i64, A, i64, B)> {
        let mut pairs = Vec::new();
        while let Some(&(stamp, _)) = self.first.front() {
            let distance = |other: i64| stamp.saturating_sub(other).saturating_abs();
            let nearest = (0..self.second.len()).min_by_key(|&i| self.second.get(i).map(|(other, _)| distance(*other)));
            let gap = nearest.and_then(|i| self.second.get(i)).map(|(other, _)| distance(*other));
            let has_passed = self.second.back().is_some_and(|(last, _)| *last >= stamp);
            let is_known = gap == Some(0) || has_passed || self.first.len() > 1;
            match (nearest, gap) {
                (Some(index), Some(gap)) if gap <= self.tolerance_ns && is_known => {
                    self.unpaired[1] += index as u64;
                    self.second.drain(..index);
                    if let (Some((a_ns, a)), Some((b_ns, b))) = (self.first.pop_front(), self.second.pop_front()) {
                        pairs.push((a_ns, a, b_ns, b));
                    }
                }
                // The other topic is beyond the tolerance, or too many wait.
                _ if self.has_no_partner(stamp) || self.first.len() > DEPTH => {
                    self.first.pop_front();
                    self.unpaired[0] += 1;
                }
                _ => break,
            }
        }
        while self.second.len() > DEPTH {
            self.second.pop_front();
            self.unpaired[1] += 1;
        }
        pairs
    }

    /// Returns whether no image of the second topic can come any more that would fit this stamp.
    fn has_no_partner(&self, stamp: i64) -> bool {
        self.second.back().is_some_and(|(last, _)| last.saturating_sub(stamp) > self.tolerance_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Feeds (topic, stamp) and returns the pairs of stamps.
    fn feed(tolerance: i64, images: &[(u8, i64)]) -> (Vec<(i64, i64)>, [u64; 2]) {
        let mut sync = PairSync::new(tolerance);
        let mut pairs = Vec::new();
        for &(topic, stamp) in images {
            let new = if topic == 0 { sync.push_first(stamp, stamp) } else { sync.push_second(stamp, stamp) };
            pairs.extend(new.into_iter().map(|(a, _, b, _)| (a, b)));
        }
        (pairs, sync.unpaired())
    }

    #[test]
    fn equal_stamps_are_paired_at_once_whichever_comes_first() {
        let (pairs, unpaired) = feed(0, &[(0, 10), (1, 10), (1, 20), (0, 20)]);
        assert_eq!((pairs, unpaired), (vec![(10, 10), (20, 20)], [0, 0]));
    }

    #[test]
    fn the_nearest_partner_within_the_tolerance_is_taken() {
        let (pairs, unpaired) = feed(20, &[(1, 95), (0, 110), (1, 112), (0, 140), (1, 145), (0, 170)]);
        assert_eq!((pairs, unpaired), (vec![(110, 112), (140, 145)], [0, 1]));
    }

    #[test]
    fn a_partner_that_is_older_is_taken_when_the_next_image_is_there() {
        let (pairs, _) = feed(20, &[(1, 100), (0, 105), (0, 138)]);
        assert_eq!(pairs, [(105, 100)]);
    }

    #[test]
    fn an_image_without_depth_is_counted_and_does_not_hold_up_the_others() {
        let (pairs, unpaired) = feed(5, &[(0, 100), (1, 100), (0, 133), (0, 166), (1, 166)]);
        assert_eq!((pairs, unpaired), (vec![(100, 100), (166, 166)], [1, 0]));
        let only_color: Vec<_> = (0..100).map(|i| (0, 33 * i)).collect();
        let (pairs, unpaired) = feed(5, &only_color);
        assert!(pairs.is_empty() && unpaired[0] >= 90, "{unpaired:?}");
    }

    #[test]
    fn after_a_jump_of_the_clock_pairs_are_made_again() {
        let (pairs, _) = feed(5, &[(0, 9000), (1, 9000), (0, 9033), (0, 100), (1, 100), (1, 133), (0, 133)]);
        assert_eq!(pairs, [(9000, 9000), (100, 100), (133, 133)]);
    }

    #[test]
    fn extreme_stamps_do_not_overflow() {
        let (pairs, _) = feed(i64::MAX, &[(0, i64::MIN), (1, i64::MAX), (0, i64::MAX), (1, i64::MIN)]);
        assert!(pairs.len() <= 2);
    }
}

//! Even distribution of corners over the image.
//!
//! In: the corners of a level and a quota. Out: at most that many of them, the strongest of each node of a quadtree (ORB-SLAM2,
//! IEEE T-RO 2017, section III: features evenly distributed on all levels).
//!
//! The quadtree is the list of corners sorted along the Z-order curve: each node is a range of that list.

use std::cmp::Reverse;

use super::fast::Corner;

/// A node of the quadtree: the corners `start..end` of the sorted list.
#[derive(Clone, Copy, Debug)]
struct Node {
    start: usize,
    end: usize,
    /// log2 of the side of its square, px.
    depth: u32,
}

impl Node {
    fn len(&self) -> usize {
        self.end - self.start
    }
}

/// Buffers of the selection of corners, reused from level to level.
#[derive(Clone, Debug, Default)]
pub(crate) struct Distributor {
    /// Corners as integers: the position on the Z-order curve in the upper bits, the score in the lowest byte.
    sorted: Vec<u64>,
    swap: Vec<u64>,
    counts: Vec<u32>,
    nodes: Vec<Node>,
    next: Vec<Node>,
}

impl Distributor {
    /// Reduces `corners` to at most `quota` corners that are distributed evenly.
    pub(super) fn select(&mut self, corners: &mut Vec<Corner>, quota: usize) {
        if corners.len() <= quota {
            return;
        }
        if quota == 0 {
            return corners.clear();
        }
        let largest = corners.iter().fold(0, |largest, corner| largest | corner.x | corner.y);
        let depth = u16::BITS - largest.leading_zeros();
        self.sorted.clear();
        self.sorted.extend(corners.iter().map(|c| u64::from(z_order(c.x, c.y)) << 8 | u64::from(c.score)));
        self.sort_by_digit(8, depth);
        self.sort_by_digit(8 + depth, depth);
        self.nodes.clear();
        self.nodes.push(Node { start: 0, end: self.sorted.len(), depth });
        while self.split(quota) {}
        corners.clear();
        for node in &self.nodes {
            // Of equally strong corners the first along the curve is taken.
            if let Some(best) = self.sorted[node.start..node.end].iter().min_by_key(|&&corner| Reverse(corner & 0xff)) {
                let position = (best >> 8) as u32;
                corners.push(Corner { x: even_bits(position), y: even_bits(position >> 1), score: *best as u8 });
            }
        }
    }

    /// Runs one stable pass of radix sort by the `bits` bits that begin at bit `shift`.
    fn sort_by_digit(&mut self, shift: u32, bits: u32) {
        let digit = |corner: u64| (corner >> shift) as usize & ((1 << bits) - 1);
        self.counts.clear();
        self.counts.resize(1 << bits, 0);
        for &corner in &self.sorted {
            self.counts[digit(corner)] += 1;
        }
        let mut sum = 0;
        for count in &mut self.counts {
            sum += std::mem::replace(count, sum);
        }
        self.swap.resize(self.sorted.len(), 0);
        for &corner in &self.sorted {
            let position = &mut self.counts[digit(corner)];
            self.swap[*position as usize] = corner;
            *position += 1;
        }
        std::mem::swap(&mut self.sorted, &mut self.swap);
    }

    /// Splits the nodes with more than one corner while there are fewer than `quota` nodes. Returns whether another round can split more.
    fn split(&mut self, quota: usize) -> bool {
        let splittable = self.nodes.iter().filter(|node| node.len() > 1).count();
        if self.nodes.len() + 3 * splittable > quota {
            // Not all nodes can be split: those with most corners come first.
            self.nodes.sort_unstable_by_key(|node| (Reverse(node.len()), node.start));
        }
        self.next.clear();
        for (i, &node) in self.nodes.iter().enumerate() {
            let room = quota.saturating_sub(self.next.len() + self.nodes.len() - i - 1);
            if node.len() < 2 || room < 2 {
                self.next.push(node);
                continue;
            }
            let depth = node.depth - 1;
            let last = self.next.len() + room;
            let mut start = node.start;
            for quarter in 0..4 {
                let quarter_of = |corner: u64| corner >> (8 + 2 * depth) & 3;
                let mut end =
                    start + self.sorted[start..node.end].partition_point(|&corner| quarter_of(corner) <= quarter);
                if self.next.len() + 1 == last {
                    end = node.end;
                }
                if end > start {
                    self.next.push(Node { start, end, depth });
                }
                start = end;
            }
        }
        std::mem::swap(&mut self.nodes, &mut self.next);
        splittable > 0 && self.nodes.len() < quota
    }
}

/// Returns the position on the Z-order curve: the bits of `x` and `y` interleaved.
fn z_order(x: u16, y: u16) -> u32 {
    let spread = |v: u16| {
        let v = u32::from(v);
        let v = (v | v << 8) & 0x00ff_00ff;
        let v = (v | v << 4) & 0x0f0f_0f0f;
        let v = (v | v << 2) & 0x3333_3333;
        (v | v << 1) & 0x5555_5555
    };
    spread(x) | spread(y) << 1
}

/// Returns the bits at even positions of `z`, which are those of x in [`z_order`].
fn even_bits(z: u32) -> u16 {
    let z = z & 0x5555_5555;
    let z = (z | z >> 1) & 0x3333_3333;
    let z = (z | z >> 2) & 0x0f0f_0f0f;
    let z = (z | z >> 4) & 0x00ff_00ff;
    (z | z >> 8) as u16
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Generates corners at distinct positions below `side`.
    fn corners(side: u16) -> impl Strategy<Value = Vec<Corner>> {
        proptest::collection::btree_map((0..side, 0..side), 1u8.., 0..400)
            .prop_map(|corners| corners.into_iter().map(|((x, y), score)| Corner { x, y, score }).collect())
    }

    proptest! {
        #[test]
        fn the_quota_is_filled_with_input_corners(corners in corners(u16::MAX), quota in 0usize..400) {
            let mut selected = corners.clone();
            Distributor::default().select(&mut selected, quota);
            prop_assert_eq!(selected.len(), corners.len().min(quota));
            prop_assert!(selected.iter().all(|corner| corners.contains(corner)));
            let distinct: std::collections::BTreeSet<_> = selected.iter().map(|corner| (corner.x, corner.y)).collect();
            prop_assert_eq!(distinct.len(), selected.len());
        }

        #[test]
        fn the_order_of_the_corners_does_not_matter(corners in corners(64), quota in 0usize..100) {
            let (mut forward, mut backward) = (corners.clone(), corners.clone());
            backward.reverse();
            let mut distributor = Distributor::default();
            distributor.select(&mut forward, quota);
            distributor.select(&mut backward, quota);
            if corners.len() > quota {
                prop_assert_eq!(forward, backward);
            }
        }

        #[test]
        fn z_order_is_invertible(x: u16, y: u16) {
            let z = z_order(x, y);
            prop_assert_eq!((even_bits(z), even_bits(z >> 1)), (x, y));
        }
    }

    #[test]
    fn a_dense_cluster_does_not_displace_isolated_corners() {
        let cluster = (0..1000).map(|i| Corner { x: i % 40, y: i / 40, score: 200 });
        let isolated = (0..48).map(|i| Corner { x: 64 + 64 * (i % 7), y: 64 * (i / 7), score: 10 });
        let mut selected: Vec<Corner> = cluster.chain(isolated).collect();
        Distributor::default().select(&mut selected, 64);
        assert_eq!(selected.iter().filter(|corner| corner.score == 10).count(), 48);
    }

    #[test]
    fn the_strongest_corner_of_a_node_is_selected() {
        let mut selected: Vec<Corner> =
            (0..16).map(|i| Corner { x: i % 4, y: i / 4, score: (7 * i % 16) as u8 }).collect();
        Distributor::default().select(&mut selected, 1);
        assert_eq!(selected, [Corner { x: 1, y: 2, score: 15 }]);
    }
}

//! Even distribution of corners over the image.
//!
//! In: the corners of a level. Out: at most so many of them as asked for, the strongest of each quadtree node (ORB-SLAM2,
//! IEEE T-RO 2017, section III: features evenly distributed on all levels).

use super::fast::Corner;

/// A square of the quadtree: a range of the corners sorted along the Z-order curve.
#[derive(Clone, Copy, Debug)]
struct Node {
    start: u32,
    end: u32,
    /// log2 of the side, px.
    depth: u32,
}

/// Buffers of [`Distributor::select`].
#[derive(Clone, Debug, Default)]
pub(crate) struct Distributor {
    sorted: Vec<(u32, u32)>,
    nodes: Vec<Node>,
    next: Vec<Node>,
}

impl Distributor {
    /// Reduces `corners` to at most `quota`, evenly spread; the order afterwards follows the quadtree.
    pub fn select(&mut self, corners: &mut Vec<Corner>, quota: usize) {
        if corners.len() <= quota {
            return;
        }
        self.sorted.clear();
        self.sorted.extend(corners.iter().enumerate().map(|(i, c)| (z_order(c.x, c.y), i as u32)));
        self.sorted.sort_unstable();
        self.nodes.clear();
        self.nodes.push(Node { start: 0, end: self.sorted.len() as u32, depth: 16 });
        while self.split_all(quota) {}
        let sorted = &self.sorted;
        self.next.clear();
        let best = |node: &Node| {
            let members = &sorted[node.start as usize..node.end as usize];
            members.iter().map(|&(_, i)| corners[i as usize]).reduce(|a, b| if b.score > a.score { b } else { a })
        };
        let mut kept: Vec<Corner> = self.nodes.iter().filter_map(best).collect();
        kept.truncate(quota);
        std::mem::swap(corners, &mut kept);
    }

    /// Splits every node with more than one corner, the fullest first, until there are `quota`; false if that was the last round.
    fn split_all(&mut self, quota: usize) -> bool {
        self.nodes.sort_by_key(|node| std::cmp::Reverse(node.end - node.start));
        self.next.clear();
        let mut split = false;
        for (i, node) in self.nodes.iter().enumerate() {
            if node.end - node.start < 2 || node.depth == 0 || self.next.len() + self.nodes.len() - i >= quota {
                self.next.push(*node);
                continue;
            }
            split = true;
            let depth = node.depth - 1;
            let members = &self.sorted[node.start as usize..node.end as usize];
            let mut start = 0;
            for quarter in 0..4 {
                let end = members.partition_point(|&(z, _)| (z >> (2 * depth)) & 3 <= quarter);
                if end > start {
                    self.next.push(Node { start: node.start + start as u32, end: node.start + end as u32, depth });
                }
                start = end;
            }
        }
        std::mem::swap(&mut self.nodes, &mut self.next);
        split && self.nodes.len() < quota
    }
}

/// Position on the Z-order curve: the bits of `x` and `y` interleaved.
fn z_order(x: u16, y: u16) -> u32 {
    let spread = |v: u16| {
        let mut v = u32::from(v);
        v = (v | v << 8) & 0x00ff_00ff;
        v = (v | v << 4) & 0x0f0f_0f0f;
        v = (v | v << 2) & 0x3333_3333;
        (v | v << 1) & 0x5555_5555
    };
    spread(x) | spread(y) << 1
}

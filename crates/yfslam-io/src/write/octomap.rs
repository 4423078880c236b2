//! Occupancy octrees for OctoMap (Hornung et al., Autonomous Robots 2013; the formats follow its documentation).
//!
//! In: blocks of voxels with log-odds. Out: `.ot` with log-odds and, optionally, colours, or `.bt` with free or occupied. Eight equal
//! leaves become one. Only the part of the tree above the blocks is kept in memory: a map of a building with voxels of a centimetre has
//! hundreds of millions of nodes.

use std::io::{self, Write};
use std::path::Path;

use yfslam::dense::{BLOCK_SIDE as SIDE, Block, Voxel};

use super::Coordinates;
use crate::atomic_file::write_atomically;
use crate::error::Result;

/// Levels of the tree below its root; keys have as many bits.
const DEPTH: u32 = 16;

/// A voxel for an octree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OctreeVoxel {
    /// Lower corner, voxels from the origin.
    pub voxel: [i32; 3],
    /// Log-odds of occupancy.
    pub log_odds: f32,
    /// Red, green, blue; for [`OctreeFormat::Colors`] only.
    pub color: [u8; 3],
}

/// Format of an octree file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OctreeFormat {
    /// `.bt`: free or occupied, two bits per node.
    Binary,
    /// `.ot`: log-odds.
    LogOdds,
    /// `.ot` as a `ColorOcTree`: log-odds and colours.
    Colors,
}

/// Number of nodes of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OctreeSize {
    /// All nodes.
    pub nodes: usize,
    /// Nodes without children.
    pub leaves: usize,
}

/// Content of a node: log-odds, and colour if the format has colours.
type Content = (f32, [u8; 3]);

/// A node with its descendants.
enum Node {
    Leaf(Content),
    /// Greatest log-odds and mean colour of the descendants, and the children: x is bit 0 of their number, y bit 1, z bit 2.
    Inner(Content, Box<[Option<Node>; 8]>),
    /// The content of a whole block and its number of nodes; its voxels are requested again when it is written.
    Block(Content, Block, OctreeSize),
}

/// Voxels by block, in a format.
struct Blocks<F> {
    voxels: F,
    format: OctreeFormat,
}

/// Writes voxels as an octree. `voxels(block)` returns those in one of `blocks`; it is called twice for each block, so that the tree is
/// never in memory as a whole.
///
/// # Errors
/// The file cannot be written, or a voxel is outside the 16 levels of the tree: more than 32768 voxels from the origin.
pub fn write_octomap<I: Iterator<Item = OctreeVoxel>>(
    path: &Path,
    resolution_m: f64,
    blocks: impl IntoIterator<Item = Block>,
    voxels: impl Fn(Block) -> I,
    format: OctreeFormat,
) -> Result<OctreeSize> {
    let mut size = OctreeSize::default();
    write_atomically(path, |writer| {
        let below = Blocks { voxels, format };
        let mut summaries = Vec::new();
        for block in blocks {
            if let Some(node) = below.node(block)? {
                summaries.push((code_of(block.map(|v| v.saturating_mul(SIDE)))?, Some(node.summary(block))));
            }
        }
        summaries.sort_unstable_by_key(|(code, _)| *code);
        let root = Node::above(&mut summaries, DEPTH);
        if let Some(root) = &root {
            root.count(&mut size);
        }
        let (title, id) = match format {
            OctreeFormat::Binary => ("# Octomap OcTree binary file", "OcTree"),
            OctreeFormat::LogOdds => ("# Octomap OcTree file", "OcTree"),
            OctreeFormat::Colors => ("# Octomap OcTree file", "ColorOcTree"),
        };
        write!(writer, "{title}\n# {}\nid {id}\nsize {}\nres {resolution_m}\ndata\n", Coordinates::Map, size.nodes)?;
        root.map_or(Ok(()), |root| below.write(&root, writer))
    })?;
    Ok(size)
}

/// Returns the Morton code of a voxel: the bits of x, y and z interleaved.
fn code_of(voxel: Voxel) -> io::Result<u64> {
    let mut code = 0;
    for (axis, v) in voxel.into_iter().enumerate() {
        let key = v.checked_add(1 << (DEPTH - 1)).and_then(|key| u16::try_from(key).ok());
        let key = key.ok_or_else(|| {
            io::Error::new(io::ErrorKind::InvalidData, format!("voxel {voxel:?} is too far from the origin"))
        })?;
        for bit in 0..DEPTH {
            code |= u64::from(key >> bit & 1) << (3 * bit + axis as u32);
        }
    }
    Ok(code)
}

impl<I: Iterator<Item = OctreeVoxel>, F: Fn(Block) -> I> Blocks<F> {
    /// Builds the node of a block; `None` if it has no voxels.
    fn node(&self, block: Block) -> io::Result<Option<Node>> {
        let mut coded = Vec::with_capacity((SIDE * SIDE * SIDE) as usize);
        for OctreeVoxel { voxel, log_odds, color } in (self.voxels)(block) {
            // A binary tree distinguishes free and occupied only and is pruned accordingly.
            let known = match self.format {
                OctreeFormat::Binary if log_odds > 0.0 => (1.0, [0; 3]),
                OctreeFormat::Binary => (-1.0, [0; 3]),
                OctreeFormat::LogOdds => (log_odds, [0; 3]),
                OctreeFormat::Colors => (log_odds, color),
            };
            coded.push((code_of(voxel)?, known));
        }
        coded.sort_unstable_by_key(|(code, _)| *code);
        coded.dedup_by_key(|(code, _)| *code);
        Ok((!coded.is_empty()).then(|| Node::of(&coded, SIDE.ilog2())))
    }

    fn write(&self, node: &Node, writer: &mut dyn Write) -> io::Result<()> {
        match (node, self.format) {
            (Node::Block(_, block, _), _) => self.node(*block)?.map_or(Ok(()), |node| self.write(&node, writer)),
            // In a binary tree a leaf is described by its parent; a root that is a leaf cannot be described.
            (Node::Leaf(_), OctreeFormat::Binary) => Ok(()),
            (Node::Inner(_, children), OctreeFormat::Binary) => {
                writer.write_all(&children_word(children).to_le_bytes())?;
                children.iter().flatten().try_for_each(|child| self.write(child, writer))
            }
            (Node::Leaf(known), _) => self.write_known(*known, 0, writer),
            (Node::Inner(known, children), _) => {
                let bit = |number: usize| u8::from(children[number].is_some()) << number;
                self.write_known(*known, (0..8).map(bit).sum(), writer)?;
                children.iter().flatten().try_for_each(|child| self.write(child, writer))
            }
        }
    }

    /// Writes the log-odds, the colour if the format has colours, and one bit for each child.
    fn write_known(&self, (log_odds, color): Content, children: u8, writer: &mut dyn Write) -> io::Result<()> {
        writer.write_all(&log_odds.to_le_bytes())?;
        if self.format == OctreeFormat::Colors {
            writer.write_all(&color)?;
        }
        writer.write_all(&[children])
    }
}

/// Returns two bits for each child: 0 unknown, 1 free, 2 occupied, 3 inner node.
fn children_word(children: &[Option<Node>; 8]) -> u16 {
    children.iter().enumerate().fold(0, |word, (number, child)| {
        let bits = match child {
            None => 0,
            Some(Node::Leaf((log_odds, _))) if *log_odds > 0.0 => 2,
            Some(Node::Leaf(_)) => 1,
            Some(Node::Inner(..) | Node::Block(..)) => 3,
        };
        word | bits << (2 * number)
    })
}

impl Node {
    /// Builds the node `level` levels above voxels of a block, which are in the order of their codes.
    fn of(voxels: &[(u64, Content)], level: u32) -> Self {
        if level == 0 {
            return Self::Leaf(voxels.first().map_or_else(Content::default, |(_, known)| *known));
        }
        let mut rest = voxels;
        Self::over(std::array::from_fn(|number| {
            let (own, others) = rest.split_at(count_below(rest, level, number));
            rest = others;
            (!own.is_empty()).then(|| Self::of(own, level - 1))
        }))
    }

    /// Builds the node above blocks, which are in the order of their codes, and takes them; `None` without blocks.
    fn above(mut rest: &mut [(u64, Option<Self>)], level: u32) -> Option<Self> {
        if level == SIDE.ilog2() || rest.is_empty() {
            return rest.first_mut().and_then(|(_, node)| node.take());
        }
        Some(Self::over(std::array::from_fn(|number| {
            let count = count_below(rest, level, number);
            let (own, others) = std::mem::take(&mut rest).split_at_mut(count);
            rest = others;
            Self::above(own, level - 1)
        })))
    }

    /// Builds the node above `children`: eight equal leaves become one.
    fn over(children: [Option<Self>; 8]) -> Self {
        let first = match &children[0] {
            Some(Self::Leaf(known)) => Some(*known),
            _ => None,
        };
        let is_equal = |child: &Option<Self>| matches!((child, first), (Some(Self::Leaf(a)), Some(b)) if *a == b);
        if let Some(known) = first.filter(|_| children.iter().all(is_equal)) {
            return Self::Leaf(known);
        }
        let known = || children.iter().flatten().map(Self::known);
        let most = known().map(|(log_odds, _)| log_odds).fold(f32::NEG_INFINITY, f32::max);
        let mean = |axis: usize| known().map(|(_, rgb)| usize::from(rgb[axis])).sum::<usize>() / known().count().max(1);
        Self::Inner((most, [0, 1, 2].map(|axis| mean(axis) as u8)), Box::new(children))
    }

    /// Replaces an inner node of a block by its summary without descendants.
    fn summary(self, block: Block) -> Self {
        let mut size = OctreeSize::default();
        self.count(&mut size);
        if let Self::Inner(known, _) = self { Self::Block(known, block, size) } else { self }
    }

    fn known(&self) -> Content {
        match self {
            Self::Leaf(known) | Self::Inner(known, _) | Self::Block(known, ..) => *known,
        }
    }

    fn count(&self, size: &mut OctreeSize) {
        match self {
            Self::Leaf(_) => {
                size.nodes += 1;
                size.leaves += 1;
            }
            Self::Inner(_, children) => {
                size.nodes += 1;
                children.iter().flatten().for_each(|child| child.count(size));
            }
            Self::Block(_, _, own) => {
                size.nodes += own.nodes;
                size.leaves += own.leaves;
            }
        }
    }
}

/// Counts the codes, which are sorted, that belong to the children up to `number` of a node at `level`.
fn count_below<T>(sorted: &[(u64, T)], level: u32, number: usize) -> usize {
    sorted.partition_point(|(code, _)| (code >> (3 * (level - 1)) & 7) as usize <= number)
}

#[cfg(test)]
mod tests;

//! Occupancy octrees as OctoMap reads them (Hornung et al., Autonomous Robots 2013; formats as its documentation has them).
//!
//! In: voxels with log-odds. Out: `.ot`, which keeps the log-odds, with colours or without, or `.bt`, which keeps free or occupied. Eight
//! leaves that say the same become one.

use std::io::{self, Write};
use std::path::Path;

use crate::error::Result;
use crate::write::write_atomically;

/// Levels of the tree below its root; keys have as many bits.
const DEPTH: u32 = 16;

/// A voxel for an octree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OctreeVoxel {
    /// Lower corner, in voxels from the origin.
    pub voxel: [i32; 3],
    /// Log-odds of its being occupied.
    pub log_odds: f32,
    /// Red, green, blue; for [`OctreeFormat::Colors`] alone.
    pub color: [u8; 3],
}

/// What a file keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OctreeFormat {
    /// `.bt`: free or occupied, two bits a node.
    Binary,
    /// `.ot`: log-odds.
    LogOdds,
    /// `.ot` as a `ColorOcTree`: log-odds and colours.
    Colors,
}

/// How many nodes a file has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OctreeSize {
    /// All nodes.
    pub nodes: usize,
    /// Those without children.
    pub leaves: usize,
}

/// What is known of a node: its log-odds, and its colour where the format has any.
type Known = (f32, [u8; 3]);

/// A node with what hangs below it.
enum Node {
    Leaf(Known),
    /// Greatest log-odds and mean colour below, and the children: x is bit 0 of their number, y bit 1, z bit 2.
    Inner(Known, Box<[Option<Node>; 8]>),
}

/// Writes voxels as an octree.
///
/// # Errors
/// The file cannot be written, or a voxel is outside what 16 levels hold: 32768 voxels around the origin.
pub fn write_octomap(
    path: &Path,
    resolution_m: f64,
    voxels: impl IntoIterator<Item = OctreeVoxel>,
    format: OctreeFormat,
) -> Result<OctreeSize> {
    let mut size = OctreeSize::default();
    write_atomically(path, |writer| {
        let mut coded = Vec::new();
        for OctreeVoxel { voxel, log_odds, color } in voxels {
            let code = code_of(voxel).ok_or_else(|| {
                io::Error::new(io::ErrorKind::InvalidData, format!("voxel {voxel:?} is too far from the origin"))
            })?;
            // A binary tree keeps which side of even odds, and is pruned accordingly.
            let known = match format {
                OctreeFormat::Binary if log_odds > 0.0 => (1.0, [0; 3]),
                OctreeFormat::Binary => (-1.0, [0; 3]),
                OctreeFormat::LogOdds => (log_odds, [0; 3]),
                OctreeFormat::Colors => (log_odds, color),
            };
            coded.push((code, known));
        }
        coded.sort_unstable_by_key(|(code, _)| *code);
        coded.dedup_by_key(|(code, _)| *code);
        let root = (!coded.is_empty()).then(|| Node::of(&coded, DEPTH));
        if let Some(root) = &root {
            root.count(&mut size);
        }
        let (title, id) = match format {
            OctreeFormat::Binary => ("# Octomap OcTree binary file", "OcTree"),
            OctreeFormat::LogOdds => ("# Octomap OcTree file", "OcTree"),
            OctreeFormat::Colors => ("# Octomap OcTree file", "ColorOcTree"),
        };
        write!(writer, "{title}\n#\nid {id}\nsize {}\nres {resolution_m}\ndata\n", size.nodes)?;
        match (&root, format) {
            (None, _) => Ok(()),
            (Some(root), OctreeFormat::LogOdds) => root.write(false, writer),
            (Some(root), OctreeFormat::Colors) => root.write(true, writer),
            (Some(Node::Inner(_, children)), OctreeFormat::Binary) => write_binary(children, writer),
            // The format has no way to say that the whole world is alike.
            (Some(Node::Leaf(_)), OctreeFormat::Binary) => Ok(()),
        }
    })?;
    Ok(size)
}

/// Place on the curve that visits children before going on: bits of x, y and z interleaved.
fn code_of(voxel: [i32; 3]) -> Option<u64> {
    let mut code = 0;
    for (axis, v) in voxel.into_iter().enumerate() {
        let key = u16::try_from(v.checked_add(1 << (DEPTH - 1))?).ok()?;
        for bit in 0..DEPTH {
            code |= u64::from(key >> bit & 1) << (3 * bit + axis as u32);
        }
    }
    Some(code)
}

impl Node {
    /// The node over voxels in the order of their codes, `level` levels above them.
    fn of(voxels: &[(u64, Known)], level: u32) -> Self {
        if level == 0 {
            return Self::Leaf(voxels.first().map_or_else(Known::default, |(_, known)| *known));
        }
        let shift = 3 * (level - 1);
        let mut rest = voxels;
        let mut children: [Option<Self>; 8] = Default::default();
        for (number, child) in children.iter_mut().enumerate() {
            let count = rest.partition_point(|(code, _)| (code >> shift & 7) as usize <= number);
            let (own, others) = rest.split_at(count);
            *child = (!own.is_empty()).then(|| Self::of(own, level - 1));
            rest = others;
        }
        let first = match &children[0] {
            Some(Self::Leaf(known)) => Some(*known),
            _ => None,
        };
        let alike = |child: &Option<Self>| matches!((child, first), (Some(Self::Leaf(a)), Some(b)) if *a == b);
        match first {
            Some(known) if children.iter().all(alike) => Self::Leaf(known),
            _ => {
                let known = || children.iter().flatten().map(Self::known);
                let most = known().map(|(log_odds, _)| log_odds).fold(f32::NEG_INFINITY, f32::max);
                let mean =
                    |axis: usize| known().map(|(_, rgb)| usize::from(rgb[axis])).sum::<usize>() / known().count();
                Self::Inner((most, [0, 1, 2].map(|axis| mean(axis) as u8)), Box::new(children))
            }
        }
    }

    fn known(&self) -> Known {
        match self {
            Self::Leaf(known) | Self::Inner(known, _) => *known,
        }
    }

    fn count(&self, size: &mut OctreeSize) {
        size.nodes += 1;
        match self {
            Self::Leaf(_) => size.leaves += 1,
            Self::Inner(_, children) => children.iter().flatten().for_each(|child| child.count(size)),
        }
    }

    /// Log-odds, perhaps the colour, then a bit for each child, then the children.
    fn write(&self, with_color: bool, writer: &mut dyn Write) -> io::Result<()> {
        let (log_odds, color) = self.known();
        writer.write_all(&log_odds.to_le_bytes())?;
        if with_color {
            writer.write_all(&color)?;
        }
        let Self::Inner(_, children) = self else { return writer.write_all(&[0]) };
        let bits = (0..8).filter(|&number| children[number].is_some()).fold(0u8, |bits, number| bits | 1 << number);
        writer.write_all(&[bits])?;
        children.iter().flatten().try_for_each(|child| child.write(with_color, writer))
    }
}

/// Two bits for each child, then the children that have children: 0 unknown, 1 free, 2 occupied, 3 more below.
fn write_binary(children: &[Option<Node>; 8], writer: &mut dyn Write) -> io::Result<()> {
    let word = children.iter().enumerate().fold(0u16, |word, (number, child)| {
        let says = match child {
            None => 0,
            Some(Node::Leaf((log_odds, _))) if *log_odds > 0.0 => 2,
            Some(Node::Leaf(_)) => 1,
            Some(Node::Inner(..)) => 3,
        };
        word | says << (2 * number)
    });
    writer.write_all(&word.to_le_bytes())?;
    for child in children.iter().flatten() {
        if let Node::Inner(_, below) = child {
            write_binary(below, writer)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;

//! Voxels in blocks of 8 × 8 × 8, and sets of voxels as bits.
//!
//! In: positions. Out: block and index in the block. The number of blocks is small enough for ordered maps, so that no result
//! depends on hashing.

use nalgebra::Point3;

/// Voxels along a side of a block.
pub const SIDE: i32 = 8;
/// Voxels in a block.
pub(crate) const VOXELS: usize = (SIDE * SIDE * SIDE) as usize;

/// A voxel: its lower corner, in voxels.
pub type Voxel = [i32; 3];

/// A block: its lower corner, in blocks. Ordered by x, then y, then z.
pub type Block = [i32; 3];

/// Returns the voxel that contains a point, m, for `per_m` voxels a metre.
#[inline]
pub fn voxel_at(p: &Point3<f32>, per_m: f32) -> Voxel {
    [p.x, p.y, p.z].map(|v| (v * per_m).floor() as i32)
}

/// Returns the block that contains a voxel.
#[inline]
pub(crate) fn block_of(voxel: Voxel) -> Block {
    voxel.map(|v| v.div_euclid(SIDE))
}

/// Returns the index of a voxel in its block: x fastest, then y, then z.
#[inline]
pub(crate) fn index_in_block(voxel: Voxel) -> usize {
    let [x, y, z] = voxel.map(|v| v.rem_euclid(SIDE) as usize);
    x + SIDE as usize * (y + SIDE as usize * z)
}

/// Returns the voxel with an index in a block.
#[inline]
pub(crate) fn voxel_in(block: Block, index: usize) -> Voxel {
    let side = SIDE as usize;
    let offset = [index % side, index / side % side, index / (side * side)];
    [0, 1, 2].map(|axis| block[axis] * SIDE + offset[axis] as i32)
}

/// Returns the centre of a voxel, m.
pub fn center_m(voxel: Voxel, resolution_m: f32) -> Point3<f32> {
    Point3::from(voxel.map(|v| (v as f32 + 0.5) * resolution_m))
}

/// A set of voxels of a block, by their index.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Bits([u64; SIDE as usize]);

impl Bits {
    /// Adds a voxel.
    #[inline]
    pub(crate) fn insert(&mut self, index: usize) {
        self.0[index / 64] |= 1 << (index % 64);
    }

    /// Returns whether a voxel is in the set.
    #[inline]
    pub(crate) fn contains(&self, index: usize) -> bool {
        self.0[index / 64] >> (index % 64) & 1 == 1
    }

    /// Removes the voxels of another set.
    #[inline]
    pub(crate) fn remove_all(&mut self, other: &Self) {
        self.0.iter_mut().zip(other.0).for_each(|(word, other)| *word &= !other);
    }

    /// Adds the voxels of another set.
    #[inline]
    pub(crate) fn insert_all(&mut self, other: &Self) {
        self.0.iter_mut().zip(other.0).for_each(|(word, other)| *word |= other);
    }

    /// Returns whether the set is empty.
    pub(crate) fn is_empty(&self) -> bool {
        self.0 == [0; SIDE as usize]
    }

    /// Calls `f` with the index of each voxel, ascending.
    #[inline]
    pub(crate) fn for_each(&self, mut f: impl FnMut(usize)) {
        for (i, &word) in self.0.iter().enumerate() {
            let mut rest = word;
            while rest != 0 {
                f(64 * i + rest.trailing_zeros() as usize);
                rest &= rest - 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn block_and_index_give_the_voxel_back(voxel in prop::array::uniform3(-5000i32..5000)) {
            prop_assert_eq!(voxel_in(block_of(voxel), index_in_block(voxel)), voxel);
            prop_assert_eq!(voxel_at(&center_m(voxel, 0.05), 20.0), voxel);
        }

        #[test]
        fn a_set_lists_the_voxels_that_were_added(indices in prop::collection::btree_set(0..VOXELS, 0..40)) {
            let mut bits = Bits::default();
            indices.iter().for_each(|&index| bits.insert(index));
            let mut listed = Vec::new();
            bits.for_each(|index| listed.push(index));
            prop_assert_eq!(listed, indices.into_iter().collect::<Vec<_>>());
        }
    }
}

//! Voxels in blocks of 8 × 8 × 8, and sets of them as bits.
//!
//! In: positions in voxels. Out: which block and which bit. Blocks are few enough to be kept in ordered maps, so that nothing depends on
//! hashing.

use nalgebra::Point3;

/// Voxels along a side of a block.
pub const SIDE: i32 = 8;
/// Voxels in a block.
pub(crate) const VOXELS: usize = (SIDE * SIDE * SIDE) as usize;

/// A voxel: its lower corner, in voxels.
pub type Voxel = [i32; 3];

/// A block: its lower corner, in blocks. Ordered by x, then y, then z.
pub type Block = [i32; 3];

/// The voxel that holds a point.
#[inline]
pub fn voxel_at(p: &Point3<f32>, per_m: f32) -> Voxel {
    [p.x, p.y, p.z].map(|v| (v * per_m).floor() as i32)
}

/// The block that holds a voxel.
#[inline]
pub fn block_of(voxel: Voxel) -> Block {
    voxel.map(|v| v.div_euclid(SIDE))
}

/// Place of a voxel in its block: x fastest, then y, then z.
#[inline]
pub(crate) fn place_of(voxel: Voxel) -> usize {
    let [x, y, z] = voxel.map(|v| v.rem_euclid(SIDE) as usize);
    x + SIDE as usize * (y + SIDE as usize * z)
}

/// The voxel at a place in a block.
#[inline]
pub(crate) fn voxel_in(block: Block, place: usize) -> Voxel {
    let side = SIDE as usize;
    let offset = [place % side, place / side % side, place / (side * side)];
    [0, 1, 2].map(|axis| block[axis] * SIDE + offset[axis] as i32)
}

/// Middle of a voxel, m.
pub fn center_m(voxel: Voxel, resolution_m: f32) -> Point3<f32> {
    Point3::from(voxel.map(|v| (v as f32 + 0.5) * resolution_m))
}

/// A set of voxels of a block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Bits([u64; SIDE as usize]);

impl Bits {
    /// Adds a place.
    #[inline]
    pub(crate) fn insert(&mut self, place: usize) {
        self.0[place / 64] |= 1 << (place % 64);
    }

    /// Whether a place is in the set.
    #[inline]
    pub(crate) fn contains(&self, place: usize) -> bool {
        self.0[place / 64] >> (place % 64) & 1 == 1
    }

    /// Takes the places of another set out.
    #[inline]
    pub(crate) fn remove_all(&mut self, other: &Self) {
        self.0.iter_mut().zip(other.0).for_each(|(word, other)| *word &= !other);
    }

    /// Adds the places of another set.
    #[inline]
    pub(crate) fn insert_all(&mut self, other: &Self) {
        self.0.iter_mut().zip(other.0).for_each(|(word, other)| *word |= other);
    }

    /// Whether the set is empty.
    pub(crate) fn is_empty(&self) -> bool {
        self.0 == [0; SIDE as usize]
    }

    /// Calls `f` for each place, ascending.
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
        fn a_voxel_is_found_again_from_its_block_and_place(voxel in prop::array::uniform3(-5000i32..5000)) {
            prop_assert_eq!(voxel_in(block_of(voxel), place_of(voxel)), voxel);
            prop_assert_eq!(voxel_at(&center_m(voxel, 0.05), 20.0), voxel);
        }

        #[test]
        fn a_set_lists_what_was_put_in(places in prop::collection::btree_set(0..VOXELS, 0..40)) {
            let mut bits = Bits::default();
            places.iter().for_each(|&place| bits.insert(place));
            let mut listed = Vec::new();
            bits.for_each(|place| listed.push(place));
            prop_assert_eq!(listed, places.into_iter().collect::<Vec<_>>());
        }
    }
}

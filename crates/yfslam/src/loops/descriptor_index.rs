//! An index of landmarks by descriptor, without a vocabulary: multi-index hashing (Norouzi, Punjani and Fleet, Fast Search in
//! Hamming Space with Multi-Index Hashing, CVPR 2012).
//!
//! In: landmarks of the map. Out: those whose descriptor is near a given one. Each of several tables holds all descriptors under
//! another 16 of their 256 bits. A query is looked up in each table under those bits and under all that differ in one of them: two
//! descriptors that differ in 30 bits miss each other in all tables once in 40 times. Nothing is trained, and an empty index costs
//! nothing.

use slotmap::SecondaryMap;

use crate::features::Descriptor;
use crate::map::{LandmarkId, Map};

/// Number of tables; a descriptor of 256 bits has room for 16.
const TABLES: usize = 8;
/// Bits of a key.
const KEY_BITS: usize = 16;
/// End of a chain.
const NONE: u32 = u32::MAX;

/// An index of landmarks by descriptor.
#[derive(Clone, Debug, Default)]
pub(super) struct LandmarkIndex {
    items: Vec<Item>,
    /// First item of the chain of each table and key; empty until the first landmark is added.
    heads: Vec<u32>,
    indexed: SecondaryMap<LandmarkId, ()>,
    /// Number of the last query that reached each item.
    last_query: Vec<u32>,
    queries: u32,
}

#[derive(Clone, Debug)]
struct Item {
    landmark: LandmarkId,
    descriptor: Descriptor,
    /// Next item with the same key, in each table.
    next: [u32; TABLES],
}

impl LandmarkIndex {
    /// Adds a landmark with its present descriptor; one that is indexed already stays as it is.
    pub(super) fn insert(&mut self, landmark: LandmarkId, descriptor: &Descriptor) {
        if self.indexed.insert(landmark, ()).is_some() {
            return;
        }
        if self.heads.is_empty() {
            self.heads.resize(TABLES << KEY_BITS, NONE);
        }
        let item = self.items.len() as u32;
        let next = std::array::from_fn(|table| {
            std::mem::replace(&mut self.heads[table << KEY_BITS | usize::from(key(descriptor, table))], item)
        });
        self.items.push(Item { landmark, descriptor: *descriptor, next });
        self.last_query.push(self.queries);
    }

    /// Removes landmarks that the map no longer has, once they outnumber those it has.
    pub(super) fn remove_stale(&mut self, map: &Map) {
        if self.items.len() > 2 * map.landmark_count() + 1000 {
            let items = std::mem::take(&mut self.items);
            *self = Self::default();
            for landmark in items.into_iter().map(|item| item.landmark) {
                if let Some(l) = map.landmark(landmark) {
                    self.insert(landmark, &l.descriptor);
                }
            }
        }
    }

    /// Calls `visit` with landmarks whose descriptor differs from `query` in at most `max_distance` bits, and that number of bits.
    /// The search is approximate: the more bits differ, the more landmarks are missed.
    #[inline(always)]
    pub(super) fn for_each_near(
        &mut self,
        query: &Descriptor,
        max_distance: u32,
        mut visit: impl FnMut(LandmarkId, u32),
    ) {
        if self.items.is_empty() {
            return;
        }
        self.queries += 1;
        for table in 0..TABLES {
            let key = key(query, table);
            for flip in std::iter::once(0).chain((0..KEY_BITS).map(|bit| 1u16 << bit)) {
                let mut at = self.heads[table << KEY_BITS | usize::from(key ^ flip)];
                while let Some(item) = self.items.get(at as usize) {
                    let last_query = &mut self.last_query[at as usize];
                    if *last_query != self.queries {
                        *last_query = self.queries;
                        let distance = query.distance(&item.descriptor);
                        if distance <= max_distance {
                            visit(item.landmark, distance);
                        }
                    }
                    at = item.next[table];
                }
            }
        }
    }
}

/// Returns the bits of a descriptor that are the key in a table.
#[inline(always)]
fn key(descriptor: &Descriptor, table: usize) -> u16 {
    (descriptor.0[table * KEY_BITS / 64] >> (table * KEY_BITS % 64)) as u16
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::Pcg64Mcg;
    use rand_pcg::rand_core::{Rng, SeedableRng};
    use slotmap::SlotMap;

    /// Returns an index with `count` random descriptors under new ids.
    fn filled(rng: &mut Pcg64Mcg, count: usize) -> (LandmarkIndex, Vec<(LandmarkId, Descriptor)>) {
        let mut ids: SlotMap<LandmarkId, ()> = SlotMap::with_key();
        let mut index = LandmarkIndex::default();
        let inserted: Vec<_> =
            (0..count).map(|_| (ids.insert(()), Descriptor(std::array::from_fn(|_| rng.next_u64())))).collect();
        for (id, descriptor) in &inserted {
            index.insert(*id, descriptor);
        }
        (index, inserted)
    }

    fn with_flips(rng: &mut Pcg64Mcg, descriptor: &Descriptor, flips: usize) -> Descriptor {
        let mut changed = *descriptor;
        while changed.distance(descriptor) < flips as u32 {
            let bit = rng.next_u64() as usize % 256;
            changed.0[bit / 64] |= !descriptor.0[bit / 64] & (1 << (bit % 64));
            changed.0[bit / 64] &= !(descriptor.0[bit / 64] & (1 << (bit % 64)));
        }
        changed
    }

    #[test]
    fn near_descriptors_are_found_and_far_ones_are_not() {
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        let (mut index, inserted) = filled(&mut rng, 5000);
        for (flips, least_share) in [(0, 1.0), (15, 0.995), (30, 0.95), (45, 0.7)] {
            let mut found = 0;
            for (id, descriptor) in inserted.iter().step_by(10) {
                let query = with_flips(&mut rng, descriptor, flips);
                index.for_each_near(&query, 50, |hit, distance| {
                    assert_eq!((hit, distance), (*id, flips as u32), "random descriptors differ in about 128 bits");
                    found += 1;
                });
            }
            assert!(f64::from(found) >= least_share * 500.0, "{found} of 500 found at {flips} bits");
        }
    }

    #[test]
    fn a_landmark_added_twice_is_found_once() {
        let mut rng = Pcg64Mcg::seed_from_u64(2);
        let (mut index, inserted) = filled(&mut rng, 3);
        let (id, descriptor) = inserted[1];
        index.insert(id, &descriptor);
        let mut hits = Vec::new();
        index.for_each_near(&descriptor, 10, |hit, _| hits.push(hit));
        assert_eq!(hits, [id]);
    }
}

//! Occupancy with log-odds, as a function of what the patches have seen, whatever way it came about.
//!
//! In: patches and where they hang, now and after each correction. Out: for each voxel whether it is occupied, free or unknown. Each block
//! keeps what each patch said of it, and adds it up in the order of time, clamped at every step (OctoMap, section 4). So a patch that
//! moves is taken out and entered anew without a trace, only the blocks concerned are added up again, and the result is to the bit that
//! of a map made anew. The clamps let late views prevail: what has left is free after a few of them.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Translation3};

use crate::dense::keyframe_patch::{CellGrid, KeyframePatch};
use crate::dense::trace::{Seen, trace};
use crate::dense::voxels::{Bits, Block, SIDE, VOXELS, Voxel, block_of, place_of, voxel_in};
use crate::dense::{DenseConfig, DenseMap};

/// Log-odds are kept in thousandths.
const PER_UNIT: f32 = 1000.0;

/// What is known of a space.
#[derive(Clone, Debug)]
pub struct Volume {
    config: DenseConfig,
    steps: Steps,
    blocks: BTreeMap<Block, BlockState>,
    /// Where each patch hangs and what it touches, by number; `None` for those that are not in the volume.
    patches: Vec<Option<Entered>>,
}

#[derive(Clone, Debug)]
struct Entered {
    t_map_cam: Isometry3<f64>,
    blocks: Vec<Block>,
}

/// What the configuration's probabilities are in log-odds.
#[derive(Clone, Copy, Debug)]
struct Steps {
    hit: i16,
    miss: i16,
    least: i16,
    most: i16,
    occupied: i16,
}

/// What patches say of a block, by their number, and what it adds up to.
#[derive(Clone, Debug, Default)]
struct BlockState {
    said: Vec<(u32, Bits, Bits)>,
    /// How many of them have been added up.
    added: usize,
    known: Bits,
    log_odds: Vec<i16>,
}

/// A voxel of which something is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownVoxel {
    /// Which one.
    pub voxel: Voxel,
    /// Log-odds of its being occupied.
    pub log_odds: f32,
    /// Whether that is enough.
    pub occupied: bool,
}

impl Volume {
    /// An empty volume.
    pub(crate) fn new(config: &DenseConfig) -> Self {
        let log_odds = |p: f32| ((p / (1.0 - p)).ln() * PER_UNIT).round() as i16;
        let steps = Steps {
            hit: log_odds(config.p_hit),
            miss: log_odds(config.p_miss),
            least: log_odds(config.clamp_min),
            most: log_odds(config.clamp_max),
            occupied: log_odds(config.occupied),
        };
        Self { config: config.clone(), steps, blocks: BTreeMap::new(), patches: Vec::new() }
    }

    /// The configuration it was made with.
    pub fn config(&self) -> &DenseConfig {
        &self.config
    }

    /// Enters patch number `number`, or moves it if it hangs elsewhere by now: if its surfaces may be off by more than
    /// `refit_threshold_voxels`. `None` takes it out. Returns whether anything changed.
    pub(crate) fn place(
        &mut self,
        number: usize,
        grid: &CellGrid,
        patch: &KeyframePatch,
        t_map_cam: Option<&Isometry3<f64>>,
    ) -> bool {
        let entered = self.patches.get(number).and_then(Option::as_ref);
        match (entered, t_map_cam) {
            (None, None) => return false,
            (Some(entered), Some(pose)) if !self.has_moved(&entered.t_map_cam, pose) => return false,
            _ => {}
        }
        self.take_out(number);
        if let Some(pose) = t_map_cam {
            self.enter(number, pose, trace(&self.config, grid, patch, pose));
        }
        true
    }

    /// Whether something within range has moved by more than `refit_threshold_voxels`.
    fn has_moved(&self, before: &Isometry3<f64>, now: &Isometry3<f64>) -> bool {
        let moved = before.inverse() * now;
        let turned = moved.rotation.angle() * f64::from(self.config.max_range_m);
        let Translation3 { vector, .. } = moved.translation;
        vector.norm() + turned > f64::from(self.config.refit_threshold_voxels * self.config.resolution_m)
    }

    fn enter(&mut self, number: usize, t_map_cam: &Isometry3<f64>, seen: Vec<Seen>) {
        if self.patches.len() <= number {
            self.patches.resize_with(number + 1, || None);
        }
        let mut blocks = Vec::with_capacity(seen.len());
        for Seen { block, hit, free } in seen {
            let state = self.blocks.entry(block).or_default();
            let at = state.said.partition_point(|(earlier, ..)| (*earlier as usize) < number);
            state.said.insert(at, (number as u32, hit, free));
            if at < state.added {
                state.added = 0;
            }
            blocks.push(block);
        }
        self.patches[number] = Some(Entered { t_map_cam: *t_map_cam, blocks });
    }

    fn take_out(&mut self, number: usize) {
        let Some(entered) = self.patches.get_mut(number).and_then(Option::take) else { return };
        for block in entered.blocks {
            let Some(state) = self.blocks.get_mut(&block) else { continue };
            let at = state.said.partition_point(|(earlier, ..)| (*earlier as usize) < number);
            if state.said.get(at).is_some_and(|(found, ..)| *found as usize == number) {
                state.said.remove(at);
            }
            if at < state.added {
                state.added = 0;
            }
            if state.said.is_empty() {
                self.blocks.remove(&block);
            }
        }
    }

    /// Adds up what is new. Questions are answered as of the last time.
    pub(crate) fn settle(&mut self) {
        for state in self.blocks.values_mut() {
            state.add_up(&self.steps);
        }
    }

    /// What is known of a voxel.
    pub fn get(&self, voxel: Voxel) -> Option<KnownVoxel> {
        let state = self.blocks.get(&block_of(voxel))?;
        let place = place_of(voxel);
        state.known.contains(place).then(|| self.known(voxel, state.log_odds[place]))
    }

    fn known(&self, voxel: Voxel, log_odds: i16) -> KnownVoxel {
        KnownVoxel { voxel, log_odds: f32::from(log_odds) / PER_UNIT, occupied: log_odds > self.steps.occupied }
    }

    /// Whether a voxel is known to be occupied.
    pub fn is_occupied(&self, voxel: Voxel) -> bool {
        self.get(voxel).is_some_and(|known| known.occupied)
    }

    /// All voxels of which something is known, ordered by block, then by place in it.
    pub fn voxels(&self) -> impl Iterator<Item = KnownVoxel> {
        self.blocks.iter().flat_map(move |(&block, state)| self.known_of(block, state))
    }

    /// Those in a block.
    pub fn voxels_in(&self, block: Block) -> impl Iterator<Item = KnownVoxel> {
        self.blocks.get(&block).into_iter().flat_map(move |state| self.known_of(block, state))
    }

    fn known_of(&self, block: Block, state: &BlockState) -> impl Iterator<Item = KnownVoxel> {
        (0..VOXELS)
            .filter(|&place| state.known.contains(place))
            .map(move |place| self.known(voxel_in(block, place), state.log_odds[place]))
    }

    /// Blocks of which something is known, in order.
    pub fn blocks(&self) -> impl Iterator<Item = Block> {
        self.blocks.keys().copied()
    }

    /// Numbers of the patches that have something to say of a block, ascending.
    pub(crate) fn seen_by(&self, block: Block) -> impl Iterator<Item = usize> {
        self.blocks.get(&block).into_iter().flat_map(|state| state.said.iter().map(|(number, ..)| *number as usize))
    }

    /// Where a patch hangs in the volume.
    pub(crate) fn pose(&self, number: usize) -> Option<&Isometry3<f64>> {
        Some(&self.patches.get(number)?.as_ref()?.t_map_cam)
    }

    /// Bytes that the volume of a dense_map takes at most: what its box holds, and what each patch can say of what is in its range.
    pub fn bytes_at_most(config: &DenseConfig, dense_map: &DenseMap) -> usize {
        let side_m = f64::from(config.resolution_m) * f64::from(SIDE);
        let range_m = f64::from(config.max_range_m);
        let blocks = |extent_m: [f64; 3]| extent_m.iter().map(|m| (m / side_m).ceil() + 1.0).product::<f64>();
        let centers = dense_map.patches.iter().map(|patch| patch.t_world_cam.translation.vector);
        let (low, high) = centers.clone().fold(([f64::MAX; 3], [f64::MIN; 3]), |(low, high), c| {
            ([0, 1, 2].map(|i| low[i].min(c[i])), [0, 1, 2].map(|i| high[i].max(c[i])))
        });
        let extent = [0, 1, 2].map(|i| (high[i] - low[i]).max(0.0) + 2.0 * range_m);
        // A pyramid with the picture as its base holds a third of a box.
        let camera = dense_map.grid.camera();
        let [width, height] = [camera.width as f64 / camera.fx, camera.height as f64 / camera.fy].map(|w| w * range_m);
        let each = blocks([range_m, width, height]).min(blocks(extent)) / 2.0;
        let state = size_of::<BlockState>() + size_of::<Block>() + 2 * VOXELS;
        let said = size_of::<(u32, Bits, Bits)>() + size_of::<Block>();
        (blocks(extent).min(each * dense_map.patches.len() as f64) * state as f64
            + each * (dense_map.patches.len() * said) as f64) as usize
    }

    /// Bytes of memory that the volume takes, patches not counted.
    pub fn bytes(&self) -> usize {
        let said = size_of::<(u32, Bits, Bits)>();
        let states: usize = self.blocks.values().map(|s| s.said.capacity() * said + 2 * VOXELS).sum();
        let entered: usize = self.patches.iter().flatten().map(|p| p.blocks.capacity() * size_of::<Block>()).sum();
        states + entered + self.blocks.len() * (size_of::<BlockState>() + size_of::<Block>())
    }
}

impl BlockState {
    fn add_up(&mut self, steps: &Steps) {
        if self.added == self.said.len() {
            return;
        }
        if self.added == 0 {
            self.known = Bits::default();
            self.log_odds.clear();
            self.log_odds.resize(VOXELS, 0);
        }
        let (known, log_odds) = (&mut self.known, &mut self.log_odds);
        for (_, hit, free) in &self.said[self.added..] {
            known.insert_all(hit);
            known.insert_all(free);
            hit.for_each(|place| log_odds[place] = (log_odds[place] + steps.hit).min(steps.most));
            free.for_each(|place| log_odds[place] = (log_odds[place] + steps.miss).max(steps.least));
        }
        self.added = self.said.len();
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::*;
    use crate::dense::scene;
    use crate::dense::voxels::voxel_at;

    struct Bench {
        config: DenseConfig,
        grid: CellGrid,
    }

    impl Bench {
        fn new() -> Self {
            let config = DenseConfig::default();
            let grid = CellGrid::new(&scene::camera(), config.stride_px);
            Self { config, grid }
        }

        fn thing(&self, depth_m: f32, views: usize, gone: usize) -> Volume {
            let mut volume = Volume::new(&self.config);
            let (with, without) = (scene::wall(&self.grid, 3.01, Some(depth_m)), scene::wall(&self.grid, 3.01, None));
            for number in 0..views + gone {
                let patch = if number < views { &with } else { &without };
                volume.place(number, &self.grid, patch, Some(&Isometry3::identity()));
            }
            volume.settle();
            volume
        }
    }

    fn middle(z: f32) -> Voxel {
        voxel_at(&Point3::new(0.01, 0.01, z), 20.0)
    }

    #[test]
    fn what_was_seen_many_times_and_left_is_free_after_a_few_views() {
        let bench = Bench::new();
        assert!(bench.thing(1.52, 40, 0).is_occupied(middle(1.52)));
        assert!(bench.thing(1.52, 40, 4).is_occupied(middle(1.52)), "a few misses are no proof yet");
        let left = bench.thing(1.52, 40, 10);
        assert!(!left.is_occupied(middle(1.52)) && left.get(middle(1.52)).is_some(), "free, not unknown");
        assert!(left.is_occupied(middle(3.01)), "the wall stays");
        assert_eq!(left.get(middle(3.2)), None, "nothing is known behind the wall");
    }

    #[test]
    fn a_piece_that_moves_leaves_no_trace_where_it_was() {
        let bench = Bench::new();
        let patch = scene::wall(&bench.grid, 2.01, Some(1.22));
        let poses: Vec<_> =
            (0..6).map(|i| Isometry3::new(Vector3::new(0.1 * i as f64, 0.0, 0.0), Vector3::y() * 0.05)).collect();
        let corrected: Vec<_> =
            poses.iter().map(|pose| Isometry3::new(Vector3::new(0.0, 0.3, 0.1), Vector3::x() * 0.1) * pose).collect();
        let mut moved = Volume::new(&bench.config);
        for (number, pose) in poses.iter().enumerate() {
            moved.place(number, &bench.grid, &patch, Some(pose));
            moved.settle();
        }
        // The last one is of another world by now.
        for (number, pose) in corrected.iter().enumerate() {
            assert!(moved.place(number, &bench.grid, &patch, Some(pose).filter(|_| number < 5)));
        }
        moved.settle();
        let mut anew = Volume::new(&bench.config);
        corrected.iter().take(5).enumerate().for_each(|(number, pose)| {
            anew.place(number, &bench.grid, &patch, Some(pose));
        });
        anew.settle();
        assert!(moved.voxels().eq(anew.voxels()) && anew.voxels().count() > 1000);
    }

    #[test]
    fn a_correction_too_small_to_matter_costs_nothing() {
        let bench = Bench::new();
        let mut volume = bench.thing(1.5, 1, 0);
        let patch = scene::wall(&bench.grid, 3.01, Some(1.5));
        let pose = Isometry3::translation(0.01, 0.0, 0.0);
        assert!(!volume.place(0, &bench.grid, &patch, Some(&pose)));
        assert!(volume.place(0, &bench.grid, &patch, Some(&Isometry3::translation(0.05, 0.0, 0.0))));
    }
}

//! Method `dms`: motion statistics over a sliding window, as DMS-SLAM (Liu et al., Sensors 19(17), 2019) has them from GMS (Bian et al.,
//! CVPR 2017). No detector.
//!
//! In: the features of frames some time apart. Out: trust for those whose match is shared by their neighbours. Only the abstract of
//! DMS-SLAM was at hand: window and search radius are ours.

use std::collections::VecDeque;

use crate::config::DynamicConfig;
use crate::context::SensorModel;
use crate::dynamic::{DynamicFilter, FilterInput};
use crate::features::{Descriptor, FrameFeatures};

/// Frames between the two that are compared.
const WINDOW: usize = 5;
/// Distance within which a match is sought, px.
const RADIUS_PX: f32 = 80.0;
/// Bits in which two descriptors of one point may differ.
const MAX_BITS: u32 = 60;
/// Cells on a side of the grid. Source: GMS.
const GRID: usize = 20;
/// Factor of the root of the number of features in a cell above which its support is not by chance. Source: GMS.
const ALPHA: f32 = 6.0;

/// The features of an earlier frame: where they are, undistorted px, their level and what they look like.
#[derive(Clone, Debug, Default)]
struct Earlier {
    at: Vec<([f32; 2], u8)>,
    descriptors: Vec<Descriptor>,
}

/// Trusts what moves like its neighbours. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub(crate) struct DmsSlam {
    window: VecDeque<Earlier>,
    /// The feature of each match, where it was and where it is.
    matches: Vec<(u32, [f32; 2], [f32; 2])>,
    /// Matches between each cell of the earlier picture and each of this one.
    counts: Vec<u16>,
    /// Matches in each cell of the earlier picture.
    inside: Vec<u16>,
    /// For each cell of the earlier picture, the one that most of its matches lead to.
    target: Vec<Option<usize>>,
}

impl DmsSlam {
    /// Matches an earlier frame's features with those near by in this one.
    fn match_with(&mut self, features: &FrameFeatures) {
        self.matches.clear();
        let Some(earlier) = self.window.front() else { return };
        for (&([u, v], octave), descriptor) in earlier.at.iter().zip(&earlier.descriptors) {
            let mut best: Option<(u32, usize)> = None;
            features.for_each_near(u, v, RADIUS_PX, octave.saturating_sub(1)..=octave + 1, |i| {
                let bits = descriptor.distance(&features.descriptors[i]);
                if bits <= MAX_BITS && best.is_none_or(|(least, _)| bits < least) {
                    best = Some((bits, i));
                }
            });
            if let Some((_, i)) = best {
                let f = &features.features[i];
                self.matches.push((i as u32, [u, v], [f.u, f.v]));
            }
        }
    }

    /// Trusts the features of matches that enough neighbours share, on a grid shifted by a share of a cell.
    fn support(&mut self, sensor: &SensorModel, shift: [f32; 2], features: &mut FrameFeatures) {
        let (b, cells) = (&sensor.bounds, GRID * GRID);
        let cell = |[u, v]: [f32; 2], [dx, dy]: [f32; 2]| {
            let column = (u - b.u_min) / (b.u_max - b.u_min) * GRID as f32 + dx;
            let row = (v - b.v_min) / (b.v_max - b.v_min) * GRID as f32 + dy;
            let inside = column >= 0.0 && row >= 0.0 && column < GRID as f32 && row < GRID as f32;
            inside.then(|| row as usize * GRID + column as usize)
        };
        self.counts.clear();
        self.counts.resize(cells * cells, 0);
        self.inside.clear();
        self.inside.resize(cells, 0);
        for &(_, from, to) in &self.matches {
            if let (Some(a), Some(b)) = (cell(from, shift), cell(to, [0.0; 2])) {
                self.counts[a * cells + b] += 1;
                self.inside[a] += 1;
            }
        }
        self.target.clear();
        for a in 0..cells {
            let row = &self.counts[a * cells..(a + 1) * cells];
            let best = (0..cells).filter(|&b| row[b] > 0).max_by_key(|&b| (row[b], std::cmp::Reverse(b)));
            self.target.push(best.filter(|&b| self.is_supported(a, b)));
        }
        for &(i, from, to) in &self.matches {
            if let (Some(a), Some(b)) = (cell(from, shift), cell(to, [0.0; 2]))
                && self.target[a] == Some(b)
            {
                features.features[i as usize].trust = 1.0;
            }
        }
    }

    /// Whether the cells around two cells share matches more often than by chance.
    fn is_supported(&self, a: usize, b: usize) -> bool {
        let at = |cell: usize, dx: isize, dy: isize| {
            let (column, row) = ((cell % GRID).checked_add_signed(dx)?, (cell / GRID).checked_add_signed(dy)?);
            (column < GRID && row < GRID).then_some(row * GRID + column)
        };
        let (mut shared, mut features, mut pairs) = (0.0, 0.0, 0.0);
        for dy in -1..=1 {
            for dx in -1..=1 {
                if let (Some(a), Some(b)) = (at(a, dx, dy), at(b, dx, dy)) {
                    shared += f32::from(self.counts[a * GRID * GRID + b]);
                    features += f32::from(self.inside[a]);
                    pairs += 1.0;
                }
            }
        }
        shared > ALPHA * (features / f32::max(pairs, 1.0)).sqrt()
    }
}

impl DynamicFilter for DmsSlam {
    fn before_pose(&mut self, config: &DynamicConfig, input: &FilterInput<'_>, features: &mut FrameFeatures) {
        if self.window.len() >= WINDOW {
            self.match_with(features);
            features.features.iter_mut().for_each(|f| f.trust = 0.0);
            for shift in [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5], [0.5, 0.5]] {
                self.support(input.sensor, shift, features);
            }
            let trusted = features.features.iter().filter(|f| f.trust > 0.0).count();
            if trusted < config.min_trusted {
                features.features.iter_mut().for_each(|f| f.trust = 1.0);
            }
        }
        let mut earlier = if self.window.len() >= WINDOW { self.window.pop_front() } else { None }.unwrap_or_default();
        earlier.at.clear();
        earlier.at.extend(features.features.iter().map(|f| ([f.u, f.v], f.octave)));
        earlier.descriptors.clone_from(&features.descriptors);
        self.window.push_back(earlier);
    }

    fn needs_boxes(&self) -> bool {
        false
    }
}

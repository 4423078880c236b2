//! Method `dms`: motion statistics over a sliding window (DMS-SLAM, Liu et al., Sensors 19(17), 2019), after GMS (Bian et al., CVPR
//! 2017). It uses no detector.
//!
//! In: the features of this frame and of an earlier one. Out: trust for features whose match is supported by those of their
//! neighbours. Only the abstract of DMS-SLAM was available: window and search radius are our choice.

use std::collections::VecDeque;

use crate::config::DynamicConfig;
use crate::context::SensorModel;
use crate::dynamic::{DynamicFilter, FilterInput};
use crate::features::{Descriptor, FrameFeatures};

/// Number of frames between the two that are compared.
const WINDOW: usize = 5;
/// Search radius of a match, px.
const RADIUS_PX: f32 = 80.0;
/// Largest Hamming distance of a match.
const MAX_BITS: u32 = 60;
/// Number of grid cells along each side. Source: GMS.
const GRID: usize = 20;
/// Factor of the square root of the number of features in a cell; above that, the support of a match is not by chance. Source: GMS.
const ALPHA: f32 = 6.0;

/// The features of an earlier frame: position, undistorted px, with pyramid level, and descriptor.
#[derive(Clone, Debug, Default)]
struct PastFrame {
    positions: Vec<([f32; 2], u8)>,
    descriptors: Vec<Descriptor>,
}

/// The filter that trusts features which move like their neighbours. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub(crate) struct DmsSlam {
    window: VecDeque<PastFrame>,
    /// For each match the feature, its earlier position and its position now, px.
    matches: Vec<(u32, [f32; 2], [f32; 2])>,
    /// Number of matches between each cell of the earlier frame and each cell of this one.
    counts: Vec<u16>,
    /// Number of matches in each cell of the earlier frame.
    matches_in_cell: Vec<u16>,
    /// For each cell of the earlier frame, the cell to which most of its matches lead, if they are supported.
    target: Vec<Option<usize>>,
}

impl DmsSlam {
    /// Matches the features of the earlier frame with those within the search radius in this one.
    fn match_earlier_frame(&mut self, features: &FrameFeatures) {
        self.matches.clear();
        let Some(earlier) = self.window.front() else { return };
        for (&([u, v], octave), descriptor) in earlier.positions.iter().zip(&earlier.descriptors) {
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

    /// Trusts the features whose match is supported by enough neighbours, on a grid shifted by `shift` cells.
    fn trust_supported(&mut self, sensor: &SensorModel, shift: [f32; 2], features: &mut FrameFeatures) {
        let (b, cells) = (&sensor.bounds, GRID * GRID);
        let cell = |[u, v]: [f32; 2], [dx, dy]: [f32; 2]| {
            let column = (u - b.u_min) / (b.u_max - b.u_min) * GRID as f32 + dx;
            let row = (v - b.v_min) / (b.v_max - b.v_min) * GRID as f32 + dy;
            let inside = column >= 0.0 && row >= 0.0 && column < GRID as f32 && row < GRID as f32;
            inside.then(|| row as usize * GRID + column as usize)
        };
        self.counts.clear();
        self.counts.resize(cells * cells, 0);
        self.matches_in_cell.clear();
        self.matches_in_cell.resize(cells, 0);
        for &(_, from, to) in &self.matches {
            if let (Some(a), Some(b)) = (cell(from, shift), cell(to, [0.0; 2])) {
                self.counts[a * cells + b] += 1;
                self.matches_in_cell[a] += 1;
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

    /// Returns whether the cells around two cells share more matches than would occur by chance.
    fn is_supported(&self, a: usize, b: usize) -> bool {
        let neighbour = |cell: usize, dx: isize, dy: isize| {
            let (column, row) = ((cell % GRID).checked_add_signed(dx)?, (cell / GRID).checked_add_signed(dy)?);
            (column < GRID && row < GRID).then_some(row * GRID + column)
        };
        let (mut shared, mut features, mut pairs) = (0.0, 0.0, 0.0);
        for dy in -1..=1 {
            for dx in -1..=1 {
                if let (Some(a), Some(b)) = (neighbour(a, dx, dy), neighbour(b, dx, dy)) {
                    shared += f32::from(self.counts[a * GRID * GRID + b]);
                    features += f32::from(self.matches_in_cell[a]);
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
            self.match_earlier_frame(features);
            features.features.iter_mut().for_each(|f| f.trust = 0.0);
            for shift in [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5], [0.5, 0.5]] {
                self.trust_supported(input.sensor, shift, features);
            }
            let trusted = features.features.iter().filter(|f| f.trust > 0.0).count();
            if trusted < config.min_trusted {
                features.features.iter_mut().for_each(|f| f.trust = 1.0);
            }
        }
        let mut earlier = if self.window.len() >= WINDOW { self.window.pop_front() } else { None }.unwrap_or_default();
        earlier.positions.clear();
        earlier.positions.extend(features.features.iter().map(|f| ([f.u, f.v], f.octave)));
        earlier.descriptors.clone_from(&features.descriptors);
        self.window.push_back(earlier);
    }

    fn needs_boxes(&self) -> bool {
        false
    }
}

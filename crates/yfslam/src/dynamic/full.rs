//! Method `full`: outlines of bodies in depth, and whatever has moved since earlier views, person or not.
//!
//! In: boxes, masks, depth, then a first pose. Out: the trust of each feature. Past YF-SLAM: a body is followed through the depth image
//! instead of being cut out by box and depth; whoever is hidden behind somebody is outlined too; what no detector knows is found by
//! comparison with earlier views.

use crate::config::DynamicConfig;
use crate::dynamic::body_mask::BodyMask;
use crate::dynamic::tracks::Tracks;
use crate::dynamic::views::Views;
use crate::dynamic::yf::DepthGroups;
use crate::dynamic::{Evidence, FirstPose, Region, Tie};
use crate::features::FrameFeatures;
use crate::image::DepthImage;

/// Outlines bodies and what has moved. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub struct Full {
    bodies: BodyMask,
    views: Views,
    /// Depth of the cells that views compare, m.
    coarse_m: Vec<f32>,
    /// Tracks that have no outline yet.
    waiting: Vec<usize>,
    /// Tracks that show no body any more.
    gone: Vec<bool>,
}

impl Full {
    /// Sets the trust of features from bodies in the boxes of tracks and from the frame's mask.
    pub fn before_pose(
        &mut self,
        config: &DynamicConfig,
        groups: &mut DepthGroups,
        tracks: &mut Tracks,
        evidence: &Evidence<'_>,
        features: &mut FrameFeatures,
        regions: &mut Vec<Region>,
    ) {
        self.begin(evidence);
        self.outline(config, groups, tracks, 0.0);
        regions.extend(tracks.list.iter().map(|track| Region {
            bbox: track.bbox,
            score: track.score,
            misses: track.misses,
            depth_m: track.depth_m.map(|z| [z - config.group_half_width_m, z + config.group_half_width_m]),
        }));
        // The least suspicious return where too few are left: first those beside a body, then the bodies of least confidence.
        let wanted = config.min_trusted.min(features.len());
        if self.distrust(config.full.edge_px, evidence.scale_factors, features) >= wanted {
            return;
        }
        regions.sort_by(|a, b| b.score.total_cmp(&a.score));
        while self.distrust(0.0, evidence.scale_factors, features) < wanted {
            let Some(dropped) = regions.pop() else { return };
            // Those of like confidence go together.
            regions.retain(|region| region.score > dropped.score);
            self.begin(evidence);
            self.outline(config, groups, tracks, dropped.score.next_up());
        }
    }

    /// Begins a frame with what its mask says.
    fn begin(&mut self, evidence: &Evidence<'_>) {
        self.bodies.begin(evidence.depth);
        if let Some(mask) = evidence.mask {
            self.bodies.mark_mask(mask);
        }
    }

    /// Distrusts features on what has moved since earlier views, of which a first pose tells. Returns whether there is any.
    pub fn after_pose(&mut self, config: &DynamicConfig, first: &FirstPose<'_>, features: &mut FrameFeatures) -> bool {
        self.bodies.coarse(&mut self.coarse_m);
        let (bodies, mut found) = (&mut self.bodies, false);
        self.views.changed(&config.full, first, &self.coarse_m, |column, row| {
            bodies.mark_coarse(column, row);
            found = true;
        });
        if !found {
            return false;
        }
        let mut trusted: usize = features.features.iter().filter(|f| f.trust > 0.0).count();
        for f in &mut features.features {
            let edge_px = config.full.edge_px * first.sensor.scale(f.octave);
            if f.trust > 0.0 && trusted > config.min_trusted && self.bodies.covers(f.raw, edge_px) {
                f.trust = 0.0;
                trusted -= 1;
            }
        }
        true
    }

    /// Keeps a frame whose pose is known as a view, if it is time for one.
    pub fn keep_view(&mut self, config: &DynamicConfig, timestamp_ns: i64, tie: Tie) {
        if self.views.is_due(&config.full, timestamp_ns) {
            self.bodies.coarse(&mut self.coarse_m);
            self.views.keep(&config.full, timestamp_ns, tie, &self.coarse_m);
        }
    }

    /// The outlines of what moves in the last frame.
    pub fn bodies(&self) -> &BodyMask {
        &self.bodies
    }

    /// The outlines of the bodies of tracks, whatever method made them.
    pub fn outlines(
        config: &DynamicConfig,
        groups: &mut DepthGroups,
        tracks: &mut Tracks,
        depth: &DepthImage,
    ) -> BodyMask {
        let mut full = Self::default();
        full.bodies.begin(depth);
        full.outline(config, groups, tracks, 0.0);
        full.bodies
    }

    /// Forgets all views.
    pub fn forget_views(&mut self) {
        self.views.clear();
    }

    /// Distrusts what lies on a body or within `edge_px`, at the finest level, of one; the rest is trusted. Returns how many are.
    fn distrust(&self, edge_px: f32, scale_factors: &[f32], features: &mut FrameFeatures) -> usize {
        let mut trusted = 0;
        for f in &mut features.features {
            let scale = scale_factors.get(usize::from(f.octave)).copied().unwrap_or(1.0);
            f.trust = if self.bodies.covers(f.raw, edge_px * scale) { 0.0 } else { 1.0 };
            trusted += usize::from(f.trust > 0.0);
        }
        trusted
    }

    /// Outlines the bodies of all tracks of at least this score, the nearest first: who is hidden behind somebody is sought in what that
    /// one leaves free. A track that was missed and shows no body is dropped.
    fn outline(&mut self, config: &DynamicConfig, groups: &mut DepthGroups, tracks: &mut Tracks, min_score: f32) {
        self.gone.clear();
        self.gone.resize(tracks.list.len(), false);
        self.waiting.clear();
        self.waiting.extend((0..tracks.list.len()).filter(|&t| tracks.list[t].score >= min_score));
        while !self.waiting.is_empty() {
            let mut next: Option<(f32, f32, usize)> = None;
            let (bodies, gone) = (&mut self.bodies, &mut self.gone);
            self.waiting.retain(|&t| {
                let track = &tracks.list[t];
                let Some((center_m, share)) = groups.body_in(config, track, bodies) else {
                    gone[t] = track.misses > 0;
                    if track.misses == 0 && !bodies.holds_body(&track.bbox) {
                        // No valid depth: whatever is in a box that was just detected moves.
                        bodies.fill(&track.bbox);
                    }
                    return false;
                };
                // Of two at like depth the one who fills more of the box.
                let nearer = next.is_none_or(|(z, s, _)| {
                    center_m < z - config.group_half_width_m || (center_m < z + config.group_half_width_m && share > s)
                });
                if nearer {
                    next = Some((center_m, share, t));
                }
                true
            });
            let Some((center_m, _, t)) = next else { break };
            self.waiting.retain(|&w| w != t);
            let track = &mut tracks.list[t];
            track.depth_m = Some(center_m);
            self.bodies.grow(config, &track.bbox, center_m);
        }
        let mut gone = self.gone.iter();
        tracks.list.retain(|_| gone.next().is_none_or(|gone| !gone));
    }
}

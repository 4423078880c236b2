//! Outlines of bodies in the depth image, from boxes and masks, and the features on them.

use crate::config::DynamicConfig;
use crate::dynamic::Evidence;
use crate::dynamic::body_depth::DepthGroups;
use crate::dynamic::body_mask::BodyMask;
use crate::dynamic::tracks::Tracks;
use crate::features::FrameFeatures;
use crate::sensor::SensorModel;

/// Outlines the bodies of a frame. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub struct Outlines {
    /// What was outlined.
    pub bodies: BodyMask,
    /// Tracks that have no outline yet.
    waiting: Vec<usize>,
}

impl Outlines {
    /// Begins a frame with what its mask says.
    pub fn begin(&mut self, evidence: &Evidence<'_>) {
        self.bodies.begin(evidence.depth);
        if let Some(mask) = evidence.mask {
            self.bodies.mark_mask(mask);
        }
    }

    /// Outlines the bodies of all tracks of at least this score, the nearest first: who is hidden behind somebody is sought in what that
    /// one leaves free. A track that was missed and shows no body is dropped.
    pub fn outline(&mut self, config: &DynamicConfig, groups: &mut DepthGroups, tracks: &mut Tracks, min_score: f32) {
        self.waiting.clear();
        self.waiting
            .extend((0..tracks.list.len()).filter(|&t| !tracks.list[t].ended && tracks.list[t].score >= min_score));
        while !self.waiting.is_empty() {
            let mut next: Option<(f32, f32, usize)> = None;
            let bodies = &mut self.bodies;
            self.waiting.retain(|&t| {
                let track = &mut tracks.list[t];
                let Some((center_m, share)) = groups.body_in(config, track, bodies) else {
                    track.ended = track.misses > 0;
                    if track.misses == 0 && !bodies.holds_body(&track.bbox) {
                        // No valid depth: whatever is in a box that was just detected moves.
                        bodies.fill(t, &track.bbox);
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
            self.bodies.grow(config, t, &track.bbox, center_m);
        }
    }

    /// Distrusts what lies on a body or within `edge_px`, at the finest level, of one; the rest is trusted. Returns how many are.
    pub fn distrust(&self, edge_px: f32, sensor: &SensorModel, features: &mut FrameFeatures) -> usize {
        let mut trusted = 0;
        for f in &mut features.features {
            f.trust = if self.bodies.covers(f.raw, edge_px * sensor.scale(f.octave)) { 0.0 } else { 1.0 };
            trusted += usize::from(f.trust > 0.0);
        }
        trusted
    }
}

//! Segmenter of bodies in the depth image, from boxes and masks, and the features on them.

use crate::config::DynamicConfig;
use crate::context::SensorModel;
use crate::dynamic::FilterInput;
use crate::dynamic::segment::depth_clusters::DepthClusters;
use crate::dynamic::segment::mask::InstanceMask;
use crate::dynamic::tracks::Tracks;
use crate::features::FrameFeatures;

/// Segmenter the bodies of a frame. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub(crate) struct Segmenter {
    /// What was outlined.
    pub bodies: InstanceMask,
    /// Tracks that have no outline yet.
    waiting: Vec<usize>,
    /// Tracks of this frame's boxes that have one, and the depths of their bodies, m.
    outlined: Vec<(usize, f32)>,
}

impl Segmenter {
    /// Begins a frame with what its mask says.
    pub(crate) fn begin(&mut self, input: &FilterInput<'_>) {
        self.bodies.begin(input.depth);
        if let Some(mask) = input.mask {
            self.bodies.mark_mask(mask);
        }
    }

    /// Segmenter the bodies of all tracks of at least this score, the nearest first: who is hidden behind somebody is sought in what that
    /// one leaves free.
    pub(crate) fn outline(
        &mut self,
        config: &DynamicConfig,
        groups: &mut DepthClusters,
        tracks: &mut Tracks,
        min_score: f32,
    ) {
        self.waiting.clear();
        self.waiting
            .extend((0..tracks.list.len()).filter(|&t| tracks.list[t].is_body() && tracks.list[t].score >= min_score));
        self.outlined.clear();
        self.adopt(config, tracks);
        while let Some((t, center_m)) = self.nearest(config, groups, tracks) {
            self.waiting.retain(|&w| w != t);
            if tracks.give_box_back(config, t, center_m) {
                continue;
            }
            let track = &mut tracks.list[t];
            track.depth_m = Some(center_m);
            let body = self.bodies.grow(config, t, &track.bbox, center_m);
            track.note_body(config, &body);
            if track.misses == 0 {
                self.outlined.push((t, center_m));
            }
        }
        // Last, for they might be somebody else's trunk.
        for &(t, center_m) in &self.outlined {
            self.bodies.add_islands(config, t, &tracks.list[t].bbox, center_m);
        }
    }

    /// What a mask shows in the box of a track is its body, and nothing else there: the nearest first, whose boxes reach into those of
    /// others.
    fn adopt(&mut self, config: &DynamicConfig, tracks: &mut Tracks) {
        loop {
            let bodies = &mut self.bodies;
            let masked = |t: &usize| bodies.masked_depth(config, &tracks.list[*t].bbox).map(|z| (z, *t));
            let nearest = self.waiting.iter().filter_map(masked).min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let Some((center_m, t)) = nearest else { return };
            self.waiting.retain(|&w| w != t);
            let track = &mut tracks.list[t];
            if center_m.is_finite() {
                track.depth_m = Some(center_m);
            }
            track.note_body(config, &self.bodies.claim(t, &track.bbox));
        }
    }

    /// The nearest body of the tracks that wait, and its depth, m. Tracks that show none cease to wait.
    fn nearest(
        &mut self,
        config: &DynamicConfig,
        groups: &mut DepthClusters,
        tracks: &mut Tracks,
    ) -> Option<(usize, f32)> {
        let (mut nearest, mut i): (Option<(f32, usize, usize)>, usize) = (None, 0);
        while let Some(&t) = self.waiting.get(i) {
            let track = &tracks.list[t];
            let body = groups.body_in(config, track, &self.bodies);
            let Some((center_m, cells)) = body.filter(|(center_m, _)| track.can_be_at(config, *center_m)) else {
                self.waiting.remove(i);
                self.miss(config, tracks, t, body.map(|(center_m, _)| center_m));
                continue;
            };
            // Of two boxes in which somebody is seen, his own shows more of him.
            let is_nearer = nearest.is_none_or(|(z, most, _)| {
                center_m < z - config.group_half_width_m || (center_m < z + config.group_half_width_m && cells > most)
            });
            if is_nearer {
                nearest = Some((center_m, cells, t));
            }
            i += 1;
        }
        nearest.map(|(center_m, _, t)| (t, center_m))
    }

    /// What becomes of a track whose body is not where it should be; `instead_m` is the depth of what is there, m.
    fn miss(&mut self, config: &DynamicConfig, tracks: &mut Tracks, t: usize, instead_m: Option<f32>) {
        let track = &mut tracks.list[t];
        if track.misses == 0 {
            if !self.bodies.holds_body(&track.bbox) {
                // No valid depth: whatever is in a box that was just detected moves.
                self.bodies.fill(t, &track.bbox);
            }
            return;
        }
        let in_front_m = track.depth_m.unwrap_or(0.0) - config.group_half_width_m;
        track.ended = self.bodies.share_nearer(&track.bbox, in_front_m) < config.full.occlusion_share;
        if let Some(in_front) = track.hide(instead_m) {
            self.waiting.push(tracks.list.len());
            tracks.list.push(in_front);
        }
    }

    /// Distrusts what lies on a body or within `edge_px`, at the finest level, of one; the rest is trusted. Returns how many are.
    pub(crate) fn distrust(&self, edge_px: f32, sensor: &SensorModel, features: &mut FrameFeatures) -> usize {
        let mut trusted = 0;
        for f in &mut features.features {
            f.trust = if self.bodies.covers(f.raw, edge_px * sensor.scale(f.octave)) { 0.0 } else { 1.0 };
            trusted += usize::from(f.trust > 0.0);
        }
        trusted
    }
}

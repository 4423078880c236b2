//! Segmentation of all tracked instances of a frame, nearest first, and the trust of the features on them.
//!
//! In: tracks with bounding boxes, the depth image, a mask. Out: the instance mask; tracks with depth and extent.

use crate::config::DynamicConfig;
use crate::context::SensorModel;
use crate::dynamic::FilterInput;
use crate::dynamic::segment::depth_clusters::DepthClusters;
use crate::dynamic::segment::mask::InstanceMask;
use crate::dynamic::tracks::Tracks;
use crate::features::FrameFeatures;

/// Segments the instances of a frame. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub(crate) struct Segmenter {
    /// The mask of the segmented instances.
    pub instances: InstanceMask,
    /// Indices of tracks that are not segmented yet.
    pending: Vec<usize>,
    /// Segmented tracks that were detected in this frame, and the depths of their instances, m.
    segmented: Vec<(usize, f32)>,
}

impl Segmenter {
    /// Begins a frame: clears the mask and marks the movable objects of the network's mask.
    pub(crate) fn begin_frame(&mut self, input: &FilterInput<'_>) {
        self.instances.begin_frame(input.depth);
        if let Some(mask) = input.mask {
            self.instances.mark_mask(mask);
        }
    }

    /// Segments the instances of all tracks with a score of at least `min_score`, the nearest first: an instance behind another one
    /// is searched in the cells that the nearer one leaves.
    pub(crate) fn segment(
        &mut self,
        config: &DynamicConfig,
        clusters: &mut DepthClusters,
        tracks: &mut Tracks,
        min_score: f32,
    ) {
        self.pending.clear();
        self.pending.extend(
            (0..tracks.list.len()).filter(|&t| tracks.list[t].is_active() && tracks.list[t].score >= min_score),
        );
        self.segmented.clear();
        self.assign_masks(config, tracks);
        while let Some((t, center_m)) = self.nearest_instance(config, clusters, tracks) {
            self.pending.retain(|&other| other != t);
            if tracks.reassign_box(config, t, center_m) {
                continue;
            }
            let track = &mut tracks.list[t];
            track.depth_m = Some(center_m);
            let extent = self.instances.segment(config, t, &track.bbox, center_m);
            track.update_extent(config, &extent);
            if track.misses == 0 {
                self.segmented.push((t, center_m));
            }
        }
        // Isolated parts come last, because they may be the main part of another instance.
        for &(t, center_m) in &self.segmented {
            self.instances.add_isolated_parts(config, t, &tracks.list[t].bbox, center_m);
        }
    }

    /// Assigns the cells of the network's mask inside the box of a track to it; nothing else in the box is then segmented. The
    /// nearest track comes first, because its box reaches into those of others.
    fn assign_masks(&mut self, config: &DynamicConfig, tracks: &mut Tracks) {
        loop {
            let instances = &mut self.instances;
            let masked_depth_of = |t: &usize| instances.masked_depth(config, &tracks.list[*t].bbox).map(|z| (z, *t));
            let nearest =
                self.pending.iter().filter_map(masked_depth_of).min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let Some((center_m, t)) = nearest else { return };
            self.pending.retain(|&other| other != t);
            let track = &mut tracks.list[t];
            if center_m.is_finite() {
                track.depth_m = Some(center_m);
            }
            track.update_extent(config, &self.instances.assign_masked(t, &track.bbox));
        }
    }

    /// Returns the pending track whose instance is nearest, and the depth of the instance, m. Tracks without an instance are
    /// removed from the pending ones.
    fn nearest_instance(
        &mut self,
        config: &DynamicConfig,
        clusters: &mut DepthClusters,
        tracks: &mut Tracks,
    ) -> Option<(usize, f32)> {
        let (mut nearest, mut i): (Option<(f32, usize, usize)>, usize) = (None, 0);
        while let Some(&t) = self.pending.get(i) {
            let track = &tracks.list[t];
            let found = clusters.unlabelled_track_depth(config, track, &self.instances);
            let Some((center_m, cells)) = found.filter(|(center_m, _)| track.is_depth_plausible(config, *center_m))
            else {
                self.pending.remove(i);
                self.handle_missing(config, tracks, t, found.map(|(center_m, _)| center_m));
                continue;
            };
            // If two boxes show the same instance, the box of its own track shows more of it.
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

    /// Handles a track without an instance at its depth; `instead_m` is the depth of what its box shows instead, m.
    fn handle_missing(&mut self, config: &DynamicConfig, tracks: &mut Tracks, t: usize, instead_m: Option<f32>) {
        let track = &mut tracks.list[t];
        if track.misses == 0 {
            if !self.instances.contains_instance(&track.bbox) {
                // Without valid depth everything in a box that was just detected is taken to move.
                self.instances.mark_box(t, &track.bbox);
            }
            return;
        }
        let in_front_m = track.depth_m.unwrap_or(0.0) - config.group_half_width_m;
        track.ended = self.instances.share_nearer(&track.bbox, in_front_m) < config.full.occlusion_share;
        if let Some(in_front) = track.occlude(instead_m) {
            self.pending.push(tracks.list.len());
            tracks.list.push(in_front);
        }
    }

    /// Sets the trust of each feature: 0 on an instance or within `edge_px`, at the finest level, of one, else 1. Returns the
    /// number of trusted features.
    pub(crate) fn set_trust(&self, edge_px: f32, sensor: &SensorModel, features: &mut FrameFeatures) -> usize {
        let mut trusted = 0;
        for f in &mut features.features {
            f.trust = if self.instances.covers(f.raw, edge_px * sensor.scale(f.octave)) { 0.0 } else { 1.0 };
            trusted += usize::from(f.trust > 0.0);
        }
        trusted
    }
}

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

/// Outlines bodies and what has moved. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub struct Full {
    bodies: BodyMask,
    views: Views,
    /// Depth of the cells that views compare, m.
    coarse_m: Vec<f32>,
    /// The same, 0 where something moves.
    static_m: Vec<f32>,
    /// Tracks that have no outline yet.
    waiting: Vec<usize>,
    /// Cells of each track's body that show what was there before, and those that show something else.
    verdicts: Vec<[u32; 2]>,
    /// Whether the last frame was compared with earlier views.
    compared: bool,
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
        self.compared = false;
        self.begin(evidence);
        self.outline(config, groups, tracks, 0.0);
        regions.extend(tracks.list.iter().filter(|track| !track.ended).map(|track| Region {
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

    /// Frames over which a track is carried without a box: few where no view can tell whether it shows anybody.
    pub fn max_misses(&self, config: &DynamicConfig) -> usize {
        if self.compared { config.full.max_misses } else { config.max_misses }
    }

    /// Begins a frame with what its mask says.
    fn begin(&mut self, evidence: &Evidence<'_>) {
        self.bodies.begin(evidence.depth);
        if let Some(mask) = evidence.mask {
            self.bodies.mark_mask(mask);
        }
    }

    /// Compares the frame with earlier views, now that a first pose stands: distrusts features on what has moved since, and trusts those
    /// in front of which a track was carried in vain. Returns whether there is anything to distrust.
    pub fn after_pose(
        &mut self,
        config: &DynamicConfig,
        tracks: &mut Tracks,
        first: &FirstPose<'_>,
        features: &mut FrameFeatures,
    ) -> bool {
        self.compared = true;
        self.sample();
        self.views.compare_all(&config.full, first, &self.coarse_m);
        self.return_unmoved(config, tracks);
        let (bodies, mut found) = (&mut self.bodies, false);
        self.views.clusters(&config.full, &self.static_m, |column, row| {
            bodies.mark_coarse(column, row);
            found = true;
        });
        let mut trusted: usize = features.features.iter().filter(|f| f.trust > 0.0).count();
        for f in &mut features.features {
            let edge_px = config.full.edge_px * first.sensor.scale(f.octave);
            let moves = self.bodies.covers(f.raw, edge_px);
            if f.trust == 0.0 && !moves {
                f.trust = 1.0;
                trusted += 1;
            } else if f.trust > 0.0 && moves && trusted > config.min_trusted {
                f.trust = 0.0;
                trusted -= 1;
            }
        }
        found
    }

    /// Takes back what was outlined but shows only what was there before, whatever a box says; a track without a box that is mostly such
    /// ends.
    fn return_unmoved(&mut self, config: &DynamicConfig, tracks: &mut Tracks) {
        self.verdicts.clear();
        self.verdicts.resize(tracks.list.len(), [0; 2]);
        for cell in 0..self.coarse_m.len() {
            let (track, Some(as_before)) = (self.bodies.track_at(cell), self.views.is_as_before(cell)) else {
                continue;
            };
            if let Some(verdict) = track.and_then(|t| self.verdicts.get_mut(t)) {
                verdict[usize::from(!as_before)] += 1;
            }
            if as_before {
                self.bodies.release_coarse(cell);
            }
        }
        for (t, (track, [same, other])) in tracks.list.iter_mut().zip(&self.verdicts).enumerate() {
            if track.misses > 0 && *same as usize >= config.full.view_min_cells && same > other {
                track.ended = true;
                self.bodies.release(t);
            }
        }
    }

    /// Samples the depth of the cells that views compare.
    fn sample(&mut self) {
        self.coarse_m.clear();
        self.static_m.clear();
        for (moves, z) in self.bodies.coarse() {
            self.coarse_m.push(z);
            self.static_m.push(if moves { 0.0 } else { z });
        }
    }

    /// Keeps a frame whose pose is known as a view, if it is time for one.
    pub fn keep_view(&mut self, config: &DynamicConfig, timestamp_ns: i64, tie: Tie) {
        if self.views.is_due(&config.full, timestamp_ns) {
            self.sample();
            self.views.keep(&config.full, timestamp_ns, tie, &self.static_m);
        }
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
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;
    use crate::camera::Camera;
    use crate::config::Config;
    use crate::detection::{BoundingBox, Detection};
    use crate::image::{DepthImage, Image};
    use crate::map::Map;
    use crate::sensor::SensorModel;

    const BOX: BoundingBox = BoundingBox { x_min: 200.0, y_min: 100.0, x_max: 300.0, y_max: 400.0 };

    /// A wall 2.4 m away, in front of which somebody may stand where the box is.
    fn room(somebody: bool) -> DepthImage {
        let mut raw = Image::new(640, 480);
        raw.data_mut().fill(12_000u16);
        if somebody {
            (100..400).for_each(|y| raw.row_mut(y)[200..300].fill(10_000));
        }
        DepthImage { raw, metres_per_unit: 1.0 / 5000.0 }
    }

    #[test]
    fn a_track_that_is_carried_on_to_the_wall_behind_ends_there() {
        let (fx, fy, cx, cy) = (520.0, 520.0, 320.0, 240.0);
        let distortion = [0.0; 5];
        let camera =
            Camera { width: 640, height: 480, fx, fy, cx, cy, distortion, depth_factor: 5000.0, fps: 30.0, bf: 40.0 };
        let settings = Config::default();
        let config = &settings.dynamic;
        let sensor = SensorModel::new(&camera, &settings, &[1.0]);
        let mut map = Map::default();
        let reference = map.insert_keyframe(0, Isometry3::identity(), FrameFeatures::default());
        let first = FirstPose { sensor: &sensor, map: &map, t_cam_world: &Isometry3::identity() };
        let (mut full, mut groups, mut tracks) = (Full::default(), DepthGroups::default(), Tracks::default());
        let mut features = FrameFeatures::default();
        let mut show = |time_ns: i64, somebody: bool, boxes: &[Detection]| {
            let depth = room(somebody);
            let misses = full.max_misses(config);
            tracks.update(config, misses, boxes, &[Some(2.0)], [640, 480]);
            let evidence = Evidence { movable: boxes, mask: None, depth: &depth, scale_factors: &[1.0] };
            full.before_pose(config, &mut groups, &mut tracks, &evidence, &mut features, &mut Vec::new());
            let before = tracks.list.iter().filter(|track| !track.ended).count();
            full.after_pose(config, &mut tracks, &first, &mut features);
            full.keep_view(config, time_ns, (reference, Isometry3::identity()));
            (before, tracks.list.iter().filter(|track| !track.ended).count(), full.bodies.covers([250.0, 250.0], 0.0))
        };
        let detection = Detection { class: 0, score: 0.9, bbox: BOX };
        for second in 0..3 {
            assert_eq!(show(second * 1_000_000_000, false, &[]), (0, 0, false));
        }
        assert_eq!(show(3_000_000_000, true, &[detection]), (1, 1, true));
        assert_eq!(show(3_033_000_000, true, &[]), (1, 1, true), "a body that was not detected is carried");
        assert_eq!(show(3_066_000_000, false, &[]), (1, 0, false), "the wall is not a body");
    }
}

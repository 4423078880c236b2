//! Method `full`: segmenter of bodies in depth, and whatever has moved since earlier views, person or not.
//!
//! In: boxes, masks, depth, then a first pose. Out: the trust of each feature. Past YF-SLAM: a body is followed through the depth image
//! instead of being cut out by box and depth; whoever is hidden behind somebody is outlined too; what no detector knows is found by
//! comparison with earlier views.

mod depth_history;

use crate::config::DynamicConfig;
use crate::dynamic::full::depth_history::DepthHistory;
use crate::dynamic::segment::depth_clusters::DepthClusters;
use crate::dynamic::segment::mask::InstanceMask;
use crate::dynamic::segment::segmenter::Segmenter;
use crate::dynamic::tracks::Tracks;
use crate::dynamic::{DynamicFilter, FilterInput, FirstPose, MovingMask, Region};
use crate::features::FrameFeatures;
use crate::image::DepthImage;
use crate::map::KeyframeRelativePose;

/// Segmenter bodies and what has moved. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub(super) struct Full {
    tracks: Tracks,
    groups: DepthClusters,
    segmenter: Segmenter,
    /// The bodies of a frame in which boxes are doubted.
    doubted: InstanceMask,
    /// What must stay out of maps: bodies count here even if features on them are trusted, since they stand still or nothing else is left.
    unmapped: InstanceMask,
    regions: Vec<Region>,
    views: DepthHistory,
    /// Depth of the cells that views compare, m.
    coarse_m: Vec<f32>,
    /// The same, 0 where something moves.
    static_m: Vec<f32>,
    /// Cells of each track's body that show what was there before, and those that show something else.
    verdicts: Vec<[u32; 2]>,
    /// Whether the last frame was compared with earlier views.
    compared: bool,
}

impl Full {
    /// Draws start from `seed`.
    pub(super) fn new(seed: u64) -> Self {
        Self { groups: DepthClusters::new(seed), ..Self::default() }
    }

    /// Frames over which a track is carried without a box: few where no view can tell whether it shows anybody.
    fn max_misses(&self, config: &DynamicConfig) -> usize {
        if self.compared { config.full.max_misses } else { config.max_misses }
    }

    /// Sets the trust of features from the segmenter. The least suspicious return where too few are left: first those beside a body, then
    /// the bodies of least confidence.
    fn distrust(&mut self, config: &DynamicConfig, input: &FilterInput<'_>, features: &mut FrameFeatures) {
        let wanted = config.min_trusted.min(features.len());
        if self.segmenter.distrust(config.full.edge_px, input.sensor, features) >= wanted {
            return;
        }
        self.regions.sort_by(|a, b| b.score.total_cmp(&a.score));
        while self.segmenter.distrust(0.0, input.sensor, features) < wanted {
            let Some(dropped) = self.regions.pop() else { return };
            // Those of like confidence go together.
            self.regions.retain(|region| region.score > dropped.score);
            self.segmenter.begin(input);
            self.segmenter.outline(config, &mut self.groups, &mut self.tracks, dropped.score.next_up());
        }
    }

    /// Takes back what was outlined but shows only what was there before, whatever a box says; a track without a box that is mostly such
    /// ends.
    fn return_unmoved(&mut self, config: &DynamicConfig) {
        self.verdicts.clear();
        self.verdicts.resize(self.tracks.list.len(), [0; 2]);
        for cell in 0..self.coarse_m.len() {
            let Some(track) = self.segmenter.bodies.track_at(cell) else { continue };
            let Some(as_before) = self.views.is_as_before(cell) else { continue };
            if let Some(verdict) = self.verdicts.get_mut(track) {
                verdict[usize::from(!as_before)] += 1;
            }
            if as_before {
                self.segmenter.bodies.release_coarse(cell);
                if self.tracks.list.get(track).is_none_or(|track| track.misses > 0) {
                    self.unmapped.release_coarse(cell);
                }
            }
        }
        for (t, (track, [same, other])) in self.tracks.list.iter_mut().zip(&self.verdicts).enumerate() {
            if track.misses > 0 && *same as usize >= config.full.history_min_cells && same > other {
                track.ended = true;
                self.segmenter.bodies.release(t);
                self.unmapped.release(t);
            }
        }
    }

    /// Samples the depth of the cells that views compare.
    fn sample(&mut self) {
        self.coarse_m.clear();
        self.static_m.clear();
        for (moves, z) in self.segmenter.bodies.coarse() {
            self.coarse_m.push(z);
            self.static_m.push(if moves { 0.0 } else { z });
        }
    }
}

impl DynamicFilter for Full {
    fn before_pose(&mut self, config: &DynamicConfig, input: &FilterInput<'_>, features: &mut FrameFeatures) {
        let &FilterInput { movable, depth, .. } = input;
        let max_misses = self.max_misses(config);
        self.compared = false;
        let depths = self.groups.depths_of(config, movable, depth, features);
        let size = [depth.raw.width(), depth.raw.height()];
        if input.detected {
            self.tracks.update(config, max_misses, movable, depths, size);
        } else {
            self.tracks.carry(size);
        }
        self.segmenter.begin(input);
        self.segmenter.outline(config, &mut self.groups, &mut self.tracks, 0.0);
        self.unmapped.copy(&self.segmenter.bodies);
        self.regions.clear();
        let alive = self.tracks.list.iter().filter(|track| track.is_body());
        self.regions.extend(alive.map(|track| track.region(config)));
        self.distrust(config, input, features);
    }

    /// Compares the frame with earlier views: distrusts features on what has moved since, and trusts those on what a box alone spoke
    /// against.
    fn after_pose(&mut self, config: &DynamicConfig, first: &FirstPose<'_>, features: &mut FrameFeatures) -> bool {
        self.compared = true;
        self.sample();
        self.views.compare_all(&config.full, first, &self.coarse_m);
        self.return_unmoved(config);
        let (bodies, unmapped, mut found) = (&mut self.segmenter.bodies, &mut self.unmapped, false);
        self.views.clusters(&config.full, &self.static_m, |column, row| {
            bodies.mark_coarse(column, row);
            unmapped.mark_coarse(column, row);
            found = true;
        });
        let mut trusted: usize = features.features.iter().filter(|f| f.trust > 0.0).count();
        for f in &mut features.features {
            let edge_px = config.full.edge_px * first.sensor.scale(f.octave);
            let moves = self.segmenter.bodies.covers(f.raw, edge_px);
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

    fn doubt_boxes(&mut self, config: &DynamicConfig, features: &mut FrameFeatures) -> bool {
        self.doubted.copy(&self.segmenter.bodies);
        (0..self.tracks.list.len()).for_each(|track| self.segmenter.bodies.release(track));
        let mut any = false;
        for f in features.features.iter_mut().filter(|f| f.trust == 0.0 && !self.segmenter.bodies.covers(f.raw, 0.0)) {
            f.trust = config.full.doubted_box_trust;
            any = true;
        }
        any
    }

    /// Boxes of bodies on which there are many landmarks are false.
    fn settle_doubts(&mut self, config: &DynamicConfig, features: &FrameFeatures) {
        self.verdicts.clear();
        self.verdicts.resize(self.tracks.list.len(), [0; 2]);
        let found = features.features.iter().filter(|f| f.trust > 0.0 && f.trust < 1.0);
        for track in found.filter_map(|f| self.doubted.body_at(f.raw)) {
            if let Some([known, _]) = self.verdicts.get_mut(track) {
                *known += 1;
            }
        }
        for (track, [known, _]) in self.tracks.list.iter_mut().zip(&self.verdicts) {
            track.refuted |= *known as usize >= config.full.refuting_landmarks;
        }
    }

    fn end_frame(&mut self, config: &DynamicConfig, timestamp_ns: i64, relative_pose: KeyframeRelativePose) {
        if self.views.is_due(&config.full, timestamp_ns) {
            self.sample();
            self.views.keep(&config.full, timestamp_ns, relative_pose, &self.static_m);
        }
    }

    fn regions(&self) -> &[Region] {
        &self.regions
    }

    fn moving_mask(&self, _config: &DynamicConfig, _depth: &DepthImage) -> MovingMask {
        MovingMask { bodies: self.unmapped.clone(), ..MovingMask::default() }
    }

    fn checks_visibility(&self) -> bool {
        true
    }

    fn reset_history(&mut self) {
        self.views.clear();
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;
    use crate::camera::Camera;
    use crate::config::Config;
    use crate::context::SensorModel;
    use crate::detect::{BoundingBox, Detection};
    use crate::image::{DepthImage, Image};
    use crate::map::Map;

    const BOX: BoundingBox = BoundingBox { x_min: 200.0, y_min: 100.0, x_max: 300.0, y_max: 400.0 };

    /// A wall 2.4 m away, with somebody close in front of it, perhaps, where the box is.
    fn room(somebody: bool) -> DepthImage {
        let mut raw = Image::new(640, 480);
        raw.data_mut().fill(12_000u16);
        if somebody {
            (100..400).for_each(|y| raw.row_mut(y)[200..300].fill(11_250));
        }
        DepthImage { raw, metres_per_unit: 1.0 / 5000.0 }
    }

    #[test]
    fn a_track_that_is_carried_on_to_the_wall_behind_ends_there() {
        let (fx, fy, cx, cy) = (520.0, 520.0, 320.0, 240.0);
        let distortion = [0.0; 5];
        let camera = Camera::pinhole(640, 480, fx, fy, cx, cy).with_distortion(distortion);
        let settings = Config::default();
        let config = &settings.dynamic;
        let sensor = SensorModel::new(&camera, &settings, &[1.0]);
        let mut map = Map::default();
        let reference = map.insert_keyframe(0, Isometry3::identity(), FrameFeatures::default());
        let first = FirstPose { sensor: &sensor, map: &map, t_cam_world: &Isometry3::identity() };
        let mut full = Full::default();
        let mut features = FrameFeatures::default();
        let mut show = |time_ns: i64, somebody: bool, boxes: &[Detection]| {
            let (depth, gray) = (room(somebody), Image::new(640, 480));
            let input =
                FilterInput { movable: boxes, detected: true, mask: None, gray: &gray, depth: &depth, sensor: &sensor };
            full.before_pose(config, &input, &mut features);
            let carried = |full: &Full| full.tracks.list.iter().filter(|track| !track.ended).count();
            let before = carried(&full);
            full.after_pose(config, &first, &mut features);
            full.end_frame(config, time_ns, (reference, Isometry3::identity()));
            (before, carried(&full), full.segmenter.bodies.covers([250.0, 250.0], 0.0))
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

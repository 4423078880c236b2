//! Method `full`: people are segmented in depth, and everything that has moved within the depth history is excluded too.
//!
//! In: detections, masks, the depth image; later a first pose. Out: the trust of each feature. It extends YF-SLAM: an instance is
//! segmented along its surface instead of as the intersection of a box and a depth interval; an instance behind another one is
//! segmented too; moving objects that no detector recognises are found by comparison with the depth history; the features of an instance
//! show whether it moves or stands still.

mod depth_history;
mod displacement;
mod second_motion;

use crate::config::{DynamicConfig, FullConfig};
use crate::dynamic::full::depth_history::DepthHistory;
use crate::dynamic::full::displacement::{EarlierFrames, Search};
use crate::dynamic::full::second_motion::{SecondMotion, extent};
use crate::dynamic::segment::depth_clusters::DepthClusters;
use crate::dynamic::segment::mask::InstanceMask;
use crate::dynamic::segment::segmenter::Segmenter;
use crate::dynamic::track::Track;
use crate::dynamic::tracks::Tracks;
use crate::dynamic::{DynamicFilter, FilterInput, FirstPose, MovingMask, Region};
use crate::features::FrameFeatures;
use crate::geometry::Pose;
use crate::image::DepthImage;
use crate::map::KeyframeRelativePose;

/// Successive frames in which the first pose must seem to follow an object. Source: chosen: by chance it does in one frame.
const MIN_DOUBTS: u32 = 2;
/// Share of the features of the world that may lie on the surface of the object. Source: chosen: edges are inexact.
const MAX_SHARE_INSIDE: f32 = 0.15;

/// The filter of method `full`. Buffers are reused.
#[derive(Clone, Debug)]
pub(super) struct Full {
    tracks: Tracks,
    clusters: DepthClusters,
    segmenter: Segmenter,
    /// What must stay out of dense maps. Instances stay here even where the features on them are trusted, because they stand still
    /// or because too few other features remain.
    unmapped: InstanceMask,
    /// The instances of all tracks, also of those that stand still, without cells that the depth history shows to be background.
    tracked: InstanceMask,
    regions: Vec<Region>,
    history: DepthHistory,
    earlier: EarlierFrames,
    second_motion: SecondMotion,
    /// The pose of the frame, if its first pose has followed an object.
    corrected_pose: Option<Pose>,
    /// Number of successive frames in which the first pose seemed to follow an object.
    doubts_of_pose: u32,
    /// Depths of the features of a moving object, m, and their positions, px.
    sorted: Vec<f32>,
    /// Depth of the cells that the depth history compares, m.
    coarse_m: Vec<f32>,
    /// The same, but 0 where something moves.
    static_m: Vec<f32>,
    /// Of each track, its cells that are unchanged and changed with respect to the depth history.
    counters: Vec<[u32; 2]>,
    /// Whether the last frame was compared with the depth history.
    compared: bool,
    /// Whether something moves in the last frame that no track covers.
    moves_elsewhere: bool,
}

impl Full {
    /// Returns a filter whose random draws start from `seed`.
    pub(super) fn new(seed: u64) -> Self {
        Self {
            clusters: DepthClusters::new(seed),
            second_motion: SecondMotion::new(seed),
            corrected_pose: None,
            doubts_of_pose: 0,
            tracks: Tracks::default(),
            segmenter: Segmenter::default(),
            unmapped: InstanceMask::default(),
            tracked: InstanceMask::default(),
            regions: Vec::new(),
            history: DepthHistory::default(),
            earlier: EarlierFrames::default(),
            sorted: Vec::new(),
            coarse_m: Vec::new(),
            static_m: Vec::new(),
            counters: Vec::new(),
            compared: false,
            moves_elsewhere: false,
        }
    }

    /// Returns the number of frames for which a track is kept without a detection: fewer where no comparison with the depth history
    /// could end it.
    fn max_misses(&self, config: &DynamicConfig) -> usize {
        if self.compared { config.full.max_misses } else { config.max_misses }
    }

    /// Sets the trust of features from the segmentation. If too few remain, features are trusted again: first those that are only
    /// near an instance, then the instances of the lowest score.
    fn set_trust(&mut self, config: &DynamicConfig, input: &FilterInput<'_>, features: &mut FrameFeatures) {
        let needed = config.min_trusted.min(features.len());
        self.release_still_instances();
        self.release_unproven_instances(config);
        if self.segmenter.set_trust(config.full.edge_px, input.sensor, features) < needed {
            self.regions.sort_by(|a, b| b.score.total_cmp(&a.score));
            while self.segmenter.set_trust(0.0, input.sensor, features) < needed {
                let Some(dropped) = self.regions.pop() else { break };
                // Instances of equal score are treated alike.
                self.regions.retain(|region| region.score > dropped.score);
                self.segmenter.begin_frame(input);
                self.segmenter.segment(config, &mut self.clusters, &mut self.tracks, dropped.score.next_up());
                self.release_still_instances();
            }
        }
        self.weigh(config, features);
    }

    /// Takes the instances that stand still out of what moves.
    fn release_still_instances(&mut self) {
        for (t, track) in self.tracks.list.iter().enumerate() {
            if track.stands_still() {
                self.segmenter.instances.clear_track(t);
            }
        }
    }

    /// Takes instances that have not shown any motion out of what moves if they cover most of the image.
    fn release_unproven_instances(&mut self, config: &DynamicConfig) {
        let instances = &mut self.segmenter.instances;
        for (t, _) in self.tracks.list.iter().enumerate().filter(|(_, track)| !track.is_proven()) {
            if instances.share_of_track(t) > config.full.max_unproven_share {
                instances.clear_track(t);
            }
        }
    }

    /// Gives trusted features on instances the trust of these.
    fn weigh(&mut self, config: &DynamicConfig, features: &mut FrameFeatures) {
        for f in features.features.iter_mut().filter(|f| f.trust > 0.0) {
            if let Some(track) = self.tracked.instance_at(f.raw).and_then(|t| self.tracks.list.get(t)) {
                f.trust = if track.stands_still() { track.static_probability() } else { config.full.doubted_box_trust };
            }
        }
    }

    /// Learns from the displacement of their features which instances move and which stand still.
    fn update_evidence(&mut self, config: &FullConfig, first: &FirstPose<'_>, features: &FrameFeatures) {
        let (unmapped, tracks) = (&self.unmapped, &mut self.tracks.list);
        self.earlier.compare(config, first, features, tracks.len(), |raw| unmapped.instance_at(raw));
        let [recent, oldest] = &self.earlier.comparisons;
        for (t, track) in tracks.iter_mut().enumerate() {
            let shares = [recent, oldest].map(|comparison| comparison.relative_share(config, t));
            // What moves slowly has left its place only after a while.
            let least = shares.into_iter().flatten().min_by(f32::total_cmp);
            if let (Some(_), Some(share)) = (shares[0], least) {
                track.add_evidence(config, share, recent.gap_s);
            }
        }
    }

    /// Searches an object that moves and that no detector has found, and segments it. If the first pose follows it, the trust of all features
    /// and the corrected pose are set.
    fn find_unknown_object(&mut self, config: &DynamicConfig, first: &FirstPose<'_>, features: &mut FrameFeatures) {
        let doubts = std::mem::take(&mut self.doubts_of_pose);
        let Some((earlier, t_earlier_cam)) = self.earlier.recent(&config.full, first) else { return };
        let search = Search { config: &config.full, sensor: first.sensor, earlier, t_earlier_cam };
        let (unmapped, tracked, tracks) = (&self.unmapped, &self.tracked, &self.tracks.list);
        let is_candidate = |i: usize| {
            let track = unmapped.instance_at(features.features[i].raw).and_then(|t| tracks.get(t));
            track.is_none_or(|track| track.is_unknown)
        };
        let is_on_object = |i: u32| tracked.instance_at(features.features[i as usize].raw).is_some();
        let Some(found) = self.second_motion.search(&config.full, &search, features, is_candidate, is_on_object) else {
            return;
        };
        let (object, _) = self.second_motion.groups(found);
        let Some((bbox, depth_m)) = extent(features, object, &mut self.sorted) else { return };
        let (t, before) = self.tracks.move_unknown(bbox, depth_m);
        self.segment_unknown(config, t);
        let (object, world) = self.second_motion.groups(found);
        // What moves together must fill its surface, and the world must lie beside it: single features that move alike by chance lie among those
        // of the other group.
        let inside = |group: &[u32]| {
            let on_it = |i: &&u32| self.tracked.instance_at(features.features[**i as usize].raw) == Some(t);
            group.iter().filter(on_it).count()
        };
        let is_filled = inside(object) >= config.full.second_motion_min_features.max(2 * inside(world) + 1);
        let is_beside = (inside(world) as f32) < MAX_SHARE_INSIDE * world.len() as f32;
        let is_object = if found.pose_follows_object {
            self.doubts_of_pose = if is_filled && is_beside { doubts + 1 } else { 0 };
            self.doubts_of_pose >= MIN_DOUBTS
        } else {
            is_filled
        };
        if !is_object {
            self.tracks.restore_unknown(t, before);
            self.segment_unknown(config, t);
        } else if found.pose_follows_object {
            if found.is_open && before.is_none() {
                let timestamp_ns = first.timestamp_ns;
                tracing::warn!(
                    timestamp_ns,
                    "most of the image moves together; the part that lies farther away is taken for the world"
                );
            }
            self.corrected_pose = Some(self.second_motion.motion.inverse() * t_earlier_cam * first.t_cam_world);
            self.segmenter.set_trust(config.full.edge_px, first.sensor, features);
        }
    }

    /// Segments the instance of an object that no detector has found anew; nothing if its track has ended.
    fn segment_unknown(&mut self, config: &DynamicConfig, t: usize) {
        let track = &mut self.tracks.list[t];
        for mask in [&mut self.segmenter.instances, &mut self.unmapped, &mut self.tracked] {
            mask.clear_track(t);
            if let Some(depth_m) = track.depth_m.filter(|_| track.is_active()) {
                mask.segment(config, t, &track.bbox, depth_m);
            }
        }
    }

    /// Returns whether a pixel of the raw image belongs to an instance that moves; also if it was released before the pose of this frame
    /// was known.
    fn is_on_moving_track(&self, raw: [f32; 2]) -> bool {
        let track = self.tracked.instance_at(raw).and_then(|t| self.tracks.list.get(t));
        track.is_some_and(|track| track.is_proven() && !track.stands_still())
    }

    /// Removes segmented cells that are unchanged with respect to the depth history, whatever the boxes say. A track without a
    /// detection ends if most of its cells are unchanged.
    fn clear_static(&mut self, config: &DynamicConfig) {
        self.counters.clear();
        self.counters.resize(self.tracks.list.len(), [0; 2]);
        for cell in 0..self.coarse_m.len() {
            let Some(track) = self.tracked.track_of_coarse_cell(cell) else { continue };
            // The depth of a surface that slides along itself does not change; its features have shown that it moves.
            if self.tracks.list.get(track).is_some_and(|track| track.is_unknown) {
                continue;
            }
            let Some(is_static) = self.history.is_static(cell) else { continue };
            if let Some(counter) = self.counters.get_mut(track) {
                counter[usize::from(!is_static)] += 1;
            }
            if is_static {
                self.segmenter.instances.clear_coarse_cell(cell);
                self.tracked.clear_coarse_cell(cell);
                if self.tracks.list.get(track).is_none_or(|track| track.misses > 0) {
                    self.unmapped.clear_coarse_cell(cell);
                }
            }
        }
        for (t, (track, [unchanged, changed])) in self.tracks.list.iter_mut().zip(&self.counters).enumerate() {
            if track.misses > 0 && *unchanged as usize >= config.full.history_min_cells && unchanged > changed {
                track.ended = true;
                self.segmenter.instances.clear_track(t);
                self.unmapped.clear_track(t);
            }
        }
    }

    /// Samples the depth of the cells that the depth history compares.
    fn sample_depth(&mut self) {
        self.coarse_m.clear();
        self.static_m.clear();
        for ((moves, z), (unmapped, _)) in self.segmenter.instances.coarse_cells().zip(self.unmapped.coarse_cells()) {
            self.coarse_m.push(z);
            self.static_m.push(if moves || unmapped { 0.0 } else { z });
        }
    }
}

impl DynamicFilter for Full {
    fn before_pose(&mut self, config: &DynamicConfig, input: &FilterInput<'_>, features: &mut FrameFeatures) {
        let &FilterInput { movable, depth, .. } = input;
        let max_misses = self.max_misses(config);
        self.compared = false;
        let depths = self.clusters.depths_in_boxes(config, movable, depth, features);
        let size = [depth.raw.width(), depth.raw.height()];
        if input.detected {
            self.tracks.update(config, max_misses, movable, depths, size);
        } else {
            self.tracks.predict(size);
        }
        self.segmenter.begin_frame(input);
        self.segmenter.segment(config, &mut self.clusters, &mut self.tracks, 0.0);
        self.unmapped.copy_from(&self.segmenter.instances);
        self.tracked.copy_from(&self.segmenter.instances);
        self.regions.clear();
        let active = self.tracks.list.iter().filter(|track| track.is_active() && !track.is_unknown);
        self.regions.extend(active.map(|track| track.region(config)));
        self.set_trust(config, input, features);
    }

    /// Compares the frame with the depth history: excludes features on what has moved, and trusts features that only a box
    /// excluded.
    fn after_pose(&mut self, config: &DynamicConfig, first: &FirstPose<'_>, features: &mut FrameFeatures) -> bool {
        self.compared = true;
        self.corrected_pose = None;
        self.find_unknown_object(config, first, features);
        if self.corrected_pose.is_some() {
            return true;
        }
        self.sample_depth();
        self.history.compare(&config.full, first, &self.coarse_m);
        self.clear_static(config);
        let (instances, unmapped, mut moving) = (&mut self.segmenter.instances, &mut self.unmapped, 0);
        self.history.for_each_moving_cell(&config.full, &self.static_m, |column, row| {
            instances.mark_coarse_cell(column, row);
            unmapped.mark_coarse_cell(column, row);
            moving += 1;
        });
        let mut found = moving > 0;
        self.moves_elsewhere = moving >= config.full.history_min_cells;
        self.update_evidence(&config.full, first, features);
        self.release_still_instances();
        let mut trusted: usize = features.features.iter().filter(|f| f.trust > 0.0).count();
        for f in &mut features.features {
            let edge_px = config.full.edge_px * first.sensor.scale(f.octave);
            let moves = self.segmenter.instances.covers(f.raw, edge_px) || self.is_on_moving_track(f.raw);
            if f.trust == 0.0 && !moves {
                f.trust = 1.0;
                trusted += 1;
            } else if f.trust > 0.0 && moves && trusted > config.min_trusted {
                f.trust = 0.0;
                trusted -= 1;
                found = true;
            }
        }
        self.weigh(config, features);
        self.earlier.keep(&config.full, first.timestamp_ns, features);
        found
    }

    fn corrected_pose(&self) -> Option<Pose> {
        self.corrected_pose
    }

    fn doubt_boxes(&mut self, config: &DynamicConfig, features: &mut FrameFeatures) -> bool {
        for track in 0..self.tracks.list.len() {
            self.segmenter.instances.clear_track(track);
            self.tracked.clear_track(track);
        }
        let mut any = false;
        for f in features.features.iter_mut().filter(|f| f.trust == 0.0 && !self.segmenter.instances.covers(f.raw, 0.0))
        {
            f.trust = config.full.doubted_box_trust;
            any = true;
        }
        any
    }

    fn end_frame(&mut self, config: &DynamicConfig, timestamp_ns: i64, relative_pose: KeyframeRelativePose) {
        if self.history.is_due(&config.full, timestamp_ns) {
            self.sample_depth();
            self.history.insert(&config.full, timestamp_ns, relative_pose, &self.static_m);
        }
        self.earlier.insert(&config.full, timestamp_ns, relative_pose);
    }

    fn regions(&self) -> &[Region] {
        &self.regions
    }

    fn moving_mask(&self, _config: &DynamicConfig, _depth: &DepthImage) -> MovingMask {
        MovingMask { instances: self.unmapped.clone(), ..MovingMask::default() }
    }

    fn wants_detections(&self) -> bool {
        // A track that was not segmented, or that the last search has missed, may have ended.
        let is_uncertain = |track: &Track| !track.is_unknown && (track.missed_searches > 0 || track.depth_age > 0);
        !self.compared || self.moves_elsewhere || self.tracks.list.iter().any(is_uncertain)
    }

    fn checks_visibility(&self) -> bool {
        true
    }

    fn reset_history(&mut self) {
        self.history.clear();
        self.earlier.clear();
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
    use crate::features::{Descriptor, Feature};
    use crate::image::{DepthImage, Image};
    use crate::map::Map;

    const BOX: BoundingBox = BoundingBox { x_min: 200.0, y_min: 100.0, x_max: 300.0, y_max: 400.0 };

    /// Returns the depth image of a wall 2.4 m away, with or without a person close in front of it at the box.
    fn room(person: bool) -> DepthImage {
        let mut raw = Image::new(640, 480);
        raw.data_mut().fill(12_000u16);
        if person {
            (100..400).for_each(|y| raw.row_mut(y)[200..300].fill(11_250));
        }
        DepthImage { raw, metres_per_unit: 1.0 / 5000.0 }
    }

    #[test]
    fn a_still_instance_that_starts_to_move_is_dropped_in_the_same_frame() {
        let (camera, settings) = (Camera::pinhole(640, 480, 520.0, 520.0, 320.0, 240.0), Config::default());
        let config = &settings.dynamic;
        let sensor = SensorModel::new(&camera, &settings, &[1.0]);
        let mut map = Map::default();
        map.insert_keyframe(0, Isometry3::identity(), FrameFeatures::default());
        let first = FirstPose { timestamp_ns: 0, sensor: &sensor, map: &map, t_cam_world: &Isometry3::identity() };
        // Enough features on the wall, and one on the person.
        let feature = |raw: [f32; 2], depth_m: f32| Feature {
            raw,
            u: raw[0],
            v: raw[1],
            octave: 0,
            angle_rad: 0.0,
            depth_m: Some(depth_m),
            trust: 1.0,
        };
        let wall = (0..600).map(|i| feature([400.0 + (i % 30) as f32 * 5.0, 20.0 + (i / 30) as f32 * 10.0], 2.4));
        let all: Vec<Feature> = std::iter::once(feature([250.0, 250.0], 2.25)).chain(wall).collect();
        let descriptors = vec![Descriptor::default(); all.len()];
        let detection = Detection { class: 0, score: 0.6, bbox: BOX };
        let (depth, gray) = (room(true), Image::new(640, 480));
        let mut full = Full::new(0);
        let frame = |full: &mut Full, share: f32| {
            let mut features = FrameFeatures::from_parts(all.clone(), descriptors.clone(), sensor.bounds);
            let movable = &[detection];
            let input =
                FilterInput { movable, detected: true, mask: None, gray: &gray, depth: &depth, sensor: &sensor };
            full.before_pose(config, &input, &mut features);
            let before = features.features[0].trust;
            full.tracks.list[0].add_evidence(&config.full, share, 0.4);
            full.after_pose(config, &first, &mut features);
            [before, features.features[0].trust]
        };
        assert_eq!(frame(&mut full, 0.5), [0.0; 2], "a box is believed at first");
        for _ in 0..10 {
            frame(&mut full, 1.0);
        }
        assert!(frame(&mut full, 1.0).into_iter().all(|trust| trust > 0.8), "it stands still");
        let [before, after] = frame(&mut full, 0.0);
        assert!(before > 0.8 && after == 0.0, "it starts to move");
    }

    #[test]
    fn a_track_without_a_detection_that_shows_only_the_wall_ends() {
        let (fx, fy, cx, cy) = (520.0, 520.0, 320.0, 240.0);
        let distortion = [0.0; 5];
        let camera = Camera::pinhole(640, 480, fx, fy, cx, cy).with_distortion(distortion);
        let settings = Config::default();
        let config = &settings.dynamic;
        let sensor = SensorModel::new(&camera, &settings, &[1.0]);
        let mut map = Map::default();
        let reference = map.insert_keyframe(0, Isometry3::identity(), FrameFeatures::default());
        let first = FirstPose { timestamp_ns: 0, sensor: &sensor, map: &map, t_cam_world: &Isometry3::identity() };
        let mut full = Full::new(0);
        let mut features = FrameFeatures::default();
        let mut process = |time_ns: i64, person: bool, boxes: &[Detection]| {
            let (depth, gray) = (room(person), Image::new(640, 480));
            let input =
                FilterInput { movable: boxes, detected: true, mask: None, gray: &gray, depth: &depth, sensor: &sensor };
            full.before_pose(config, &input, &mut features);
            let active = |full: &Full| full.tracks.list.iter().filter(|track| !track.ended).count();
            let before = active(&full);
            full.after_pose(config, &first, &mut features);
            full.end_frame(config, time_ns, (reference, Isometry3::identity()));
            (before, active(&full), full.segmenter.instances.covers([250.0, 250.0], 0.0))
        };
        let detection = Detection { class: 0, score: 0.9, bbox: BOX };
        for second in 0..3 {
            assert_eq!(process(second * 1_000_000_000, false, &[]), (0, 0, false));
        }
        assert_eq!(process(3_000_000_000, true, &[detection]), (1, 1, true));
        assert_eq!(process(3_033_000_000, true, &[]), (1, 1, true), "a person without a detection stays tracked");
        assert_eq!(process(3_066_000_000, false, &[]), (1, 0, false), "the wall is not a person");
    }
}

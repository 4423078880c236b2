//! Whether an instance is where it was: its features are looked for in a frame of a quarter of a second before, and in the oldest frame of
//! the last seconds that was taken from nearby.
//!
//! In: the features of a frame with its first pose, and which instance each lies on. Out: for each instance, how many of its features the
//! earlier frames show at the place that they have now. The features beside all instances give the share to compare with: it says how well
//! features are found again in these images if nothing moves.

use std::collections::VecDeque;

use fearless_simd::{Level, Simd, dispatch};

use crate::config::FullConfig;
use crate::context::SensorModel;
use crate::dynamic::FirstPose;
use crate::features::{Descriptor, Feature, FrameFeatures};
use crate::geometry::Pose;
use crate::map::KeyframeRelativePose;

/// Every n-th feature beside the instances is looked for: enough for the share of those that are found.
const BACKGROUND_STEP: usize = 3;

/// Share of the features of the background from which on a comparison says something: by chance, one in twenty is found.
const MIN_BACKGROUND_SHARE: f32 = 0.15;

/// Least depth of a place, m.
const MIN_DEPTH_M: f64 = 0.01;

/// The features of an earlier frame.
#[derive(Clone, Debug, Default)]
struct Earlier {
    timestamp_ns: i64,
    relative_pose: Option<KeyframeRelativePose>,
    features: FrameFeatures,
}

/// Features that an earlier frame should show, and those that it shows at their place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Displacement {
    /// Number of features whose place the earlier frame shows.
    pub expected: u32,
    /// Number of those that it shows there.
    pub found: u32,
}

impl Displacement {
    /// Returns the share of the features that are found.
    pub(super) fn share(&self) -> f32 {
        self.found as f32 / self.expected.max(1) as f32
    }
}

/// Comparison of a frame with an earlier one. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub(super) struct Comparison {
    /// What it has shown of the instance of each track.
    pub tracks: Vec<Displacement>,
    /// The same of the features beside all instances.
    pub background: Displacement,
    /// Time between the two frames, s; 0 if no comparison was possible.
    pub gap_s: f32,
}

impl Comparison {
    /// Begins a comparison with that number of tracks.
    fn clear(&mut self, tracks: usize) {
        self.tracks.clear();
        self.tracks.resize(tracks, Displacement::default());
        (self.background, self.gap_s) = (Displacement::default(), 0.0);
    }

    /// Returns which share of the features of a track is found, relative to that of the background; `None` if one of them says too little.
    pub(super) fn relative_share(&self, config: &FullConfig, track: usize) -> Option<f32> {
        let (track, background) = (self.tracks.get(track)?, self.background);
        let is_enough = |displacement: &Displacement| displacement.expected >= config.displacement_min_features;
        let says_enough = is_enough(track) && is_enough(&background) && background.share() >= MIN_BACKGROUND_SHARE;
        says_enough.then(|| track.share() / background.share())
    }
}

/// Frames of the last seconds. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub(super) struct EarlierFrames {
    frames: VecDeque<Earlier>,
    /// Frames whose memory is allocated at the start, so that later frames allocate none.
    spare: Vec<Earlier>,
    /// The features of the current frame, until its final pose is known, and its time stamp, ns.
    kept: FrameFeatures,
    kept_ns: Option<i64>,
    /// Comparisons with the last frame that is old enough for a step to be seen, and with the oldest frame.
    pub comparisons: [Comparison; 2],
}

impl EarlierFrames {
    /// Keeps the features of the frame for later ones, if the last inserted frame is old enough.
    pub(super) fn keep(&mut self, config: &FullConfig, timestamp_ns: i64, features: &FrameFeatures) {
        let is_due = |last: &Earlier| seconds(last.timestamp_ns, timestamp_ns) >= config.displacement_spacing_s;
        if self.frames.is_empty() && self.spare.is_empty() {
            self.frames.reserve(config.displacement_frames);
            self.spare.resize_with(config.displacement_frames, || {
                let mut spare = Earlier::default();
                spare.features.copy_from(features);
                spare
            });
        }
        if self.frames.back().is_none_or(is_due) {
            self.kept_ns = Some(timestamp_ns);
            self.kept.copy_from(features);
        }
    }

    /// Inserts the kept features with the final pose of their frame.
    pub(super) fn insert(&mut self, config: &FullConfig, timestamp_ns: i64, relative_pose: KeyframeRelativePose) {
        if self.kept_ns.take() != Some(timestamp_ns) {
            return;
        }
        let oldest = if self.frames.len() >= config.displacement_frames { self.frames.pop_front() } else { None };
        let mut frame = oldest.or_else(|| self.spare.pop()).unwrap_or_default();
        (frame.timestamp_ns, frame.relative_pose) = (timestamp_ns, Some(relative_pose));
        std::mem::swap(&mut frame.features, &mut self.kept);
        self.frames.push_back(frame);
    }

    /// Removes all frames.
    pub(super) fn clear(&mut self) {
        self.spare.extend(self.frames.drain(..));
        self.kept_ns = None;
    }

    /// Returns the features of the last frame that is old enough for a step to be seen, and the pose of the camera in it.
    pub(super) fn recent(&self, config: &FullConfig, first: &FirstPose<'_>) -> Option<(&FrameFeatures, Pose)> {
        let [recent, _] = choose(&self.frames, config, first);
        recent.and_then(|frame| Some((&frame.features, frame.seen_from(first)?)))
    }

    /// Looks for the features of the frame in earlier ones; `track_of` returns on the instance of which track, below `tracks`, a position of
    /// the raw image lies.
    pub(super) fn compare(
        &mut self,
        config: &FullConfig,
        first: &FirstPose<'_>,
        features: &FrameFeatures,
        tracks: usize,
        track_of: impl Fn([f32; 2]) -> Option<usize>,
    ) {
        if tracks == 0 {
            return;
        }
        let frames = choose(&self.frames, config, first);
        for (comparison, frame) in self.comparisons.iter_mut().zip(frames) {
            comparison.clear(tracks);
            let Some((earlier, t_earlier_cam)) = frame.and_then(|frame| Some((frame, frame.seen_from(first)?))) else {
                continue;
            };
            comparison.gap_s = seconds(earlier.timestamp_ns, first.timestamp_ns) as f32;
            let search = Search { config, sensor: first.sensor, earlier: &earlier.features, t_earlier_cam };
            for (i, f) in features.features.iter().enumerate() {
                let count = match track_of(f.raw) {
                    Some(track) => comparison.tracks.get_mut(track),
                    None => (i % BACKGROUND_STEP == 0 && f.trust > 0.0).then_some(&mut comparison.background),
                };
                if let (Some(count), Some(found)) = (count, search.find(f, &features.descriptors[i])) {
                    count.expected += 1;
                    count.found += u32::from(found);
                }
            }
        }
    }
}

impl Earlier {
    /// Returns the pose of the current camera in this one, if both are known.
    fn seen_from(&self, first: &FirstPose<'_>) -> Option<Pose> {
        let (reference, t_earlier_reference) = self.relative_pose?;
        let t_reference_world = first.map.keyframe_pose(reference)?;
        Some(t_earlier_reference * t_reference_world * first.t_cam_world.inverse())
    }
}

/// Chooses the frames to compare with: the last one that is old enough for a step to be seen, and the oldest, if that is another one.
fn choose<'a>(frames: &'a VecDeque<Earlier>, config: &FullConfig, first: &FirstPose<'_>) -> [Option<&'a Earlier>; 2] {
    let is_near = |frame: &&Earlier| {
        let limit_rad = config.displacement_max_angle_deg.to_radians();
        frame.seen_from(first).is_some_and(|t_earlier_cam| {
            t_earlier_cam.translation.vector.norm() <= config.displacement_max_distance_m
                && t_earlier_cam.rotation.angle() <= limit_rad
        })
    };
    let oldest = frames.iter().find(is_near);
    let is_old = |frame: &&Earlier| seconds(frame.timestamp_ns, first.timestamp_ns) >= config.displacement_spacing_s;
    let recent = frames.iter().rev().find(is_old).or(oldest);
    [recent, oldest.filter(|oldest| recent.is_some_and(|recent| recent.timestamp_ns > oldest.timestamp_ns))]
}

fn seconds(from_ns: i64, to_ns: i64) -> f64 {
    to_ns.saturating_sub(from_ns) as f64 * 1e-9
}

/// The search of features of the current frame in an earlier one.
pub(super) struct Search<'a> {
    pub config: &'a FullConfig,
    pub sensor: &'a SensorModel,
    pub earlier: &'a FrameFeatures,
    pub t_earlier_cam: Pose,
}

impl Search<'_> {
    /// Returns whether the earlier frame shows a feature at the place that it has now; `None` if it does not show that place, or if the place
    /// is not known.
    pub(super) fn find(&self, feature: &Feature, descriptor: &Descriptor) -> Option<bool> {
        dispatch!(Level::new(), simd => self.find_with(simd, feature, descriptor))
    }

    #[inline(always)]
    fn find_with<S: Simd>(&self, _: S, feature: &Feature, descriptor: &Descriptor) -> Option<bool> {
        let pinhole = &self.sensor.pinhole;
        let point = pinhole.unproject(f64::from(feature.u), f64::from(feature.v), f64::from(feature.depth_m?));
        let place = self.t_earlier_cam * point;
        if place.z <= MIN_DEPTH_M {
            return None;
        }
        let [u, v] = pinhole.project(&place.coords).map(|v| v as f32);
        if !self.sensor.bounds.contains(u, v) {
            return None;
        }
        let radius = self.config.displacement_px * self.sensor.scale(feature.octave);
        let (bf, mut least) = (pinhole.bf as f32, u32::MAX);
        let expected_px = bf / place.z as f32;
        let octaves = feature.octave.saturating_sub(1)..=feature.octave + 1;
        self.earlier.for_each_near(u, v, radius, octaves, |j| {
            let other = &self.earlier.features[j];
            if other.depth_m.is_none_or(|z| (bf / z - expected_px).abs() <= radius) {
                least = least.min(descriptor.distance(&self.earlier.descriptors[j]));
            }
        });
        Some(least <= self.config.displacement_max_bits)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::config::Config;
    use crate::map::Map;

    /// Returns the descriptor of a feature: those of different features differ in about half of the bits.
    pub(in crate::dynamic::full) fn descriptor(i: u32) -> Descriptor {
        Descriptor([1u64, 2, 3, 4].map(|k| {
            let bits = (u64::from(i) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_mul(2 * k + 1);
            (bits ^ (bits >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9)
        }))
    }

    /// Returns features of a wall 2 m away, and beside them those of an instance, right of column 400, that has moved by `step_px`.
    fn features(sensor: &SensorModel, step_px: f32) -> FrameFeatures {
        let place = |i: u32| [20.0 + (i % 30) as f32 * 20.0, 20.0 + (i / 30) as f32 * 40.0];
        let feature = |i: u32| {
            let [x, v] = place(i);
            let u = if x > 400.0 { x + step_px } else { x };
            Feature { raw: [u, v], u, v, octave: 0, angle_rad: 0.0, depth_m: Some(2.0), trust: 1.0 }
        };
        FrameFeatures::from_parts((0..300).map(feature).collect(), (0..300).map(descriptor).collect(), sensor.bounds)
    }

    /// Returns the share of the instance's features that an earlier frame shows at their place, relative to that of the wall's.
    fn share_after(step_px: f32, moved: Pose) -> f32 {
        let (camera, settings) = (Camera::pinhole(640, 480, 520.0, 520.0, 320.0, 240.0), Config::default());
        let (sensor, config) = (SensorModel::new(&camera, &settings, &[1.0]), &settings.dynamic.full);
        let mut map = Map::default();
        let reference = map.insert_keyframe(0, Pose::identity(), FrameFeatures::default());
        let mut frames = EarlierFrames::default();
        frames.keep(config, 0, &features(&sensor, 0.0));
        frames.insert(config, 0, (reference, Pose::identity()));
        let first = FirstPose { timestamp_ns: 300_000_000, sensor: &sensor, map: &map, t_cam_world: &moved };
        let track_of = |[x, _]: [f32; 2]| (x > 400.0).then_some(0);
        frames.compare(config, &first, &features(&sensor, step_px), 1, track_of);
        frames.insert(config, 300_000_000, (reference, Pose::identity()));
        assert_eq!(frames.frames.len(), 1, "only kept features are inserted");
        let [recent, oldest] = &frames.comparisons;
        assert_eq!(oldest.relative_share(config, 0), None, "there is one earlier frame only");
        assert!((recent.gap_s - 0.3).abs() < 1e-6);
        recent.relative_share(config, 0).unwrap_or(f32::NAN)
    }

    #[test]
    fn an_instance_that_stands_still_is_found_and_one_that_moves_is_not() {
        assert_eq!(share_after(1.0, Pose::identity()), 1.0);
        assert!(share_after(10.0, Pose::identity()) < 0.1);
    }

    #[test]
    fn a_pose_that_says_that_the_background_has_moved_gives_no_share() {
        assert!(share_after(0.0, Pose::translation(0.1, 0.0, 0.0)).is_nan());
        assert!(share_after(0.0, Pose::translation(2.0, 0.0, 0.0)).is_nan(), "from too far away nothing is compared");
    }
}

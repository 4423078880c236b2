//! First stage: features with depth, and how far the dynamic filter trusts each to be static.

use std::sync::Arc;

use super::{FrameRejected, Pass, Slam, StageTimes, Stopwatch};
use crate::config::DepthSource;
use crate::dynamic::FilterInput;
use crate::frame::Frame;
use crate::image::{DepthImage, gray_from_rgb};
use crate::tracking::TrackingState;

impl Slam {
    /// Refuses a frame that no stage could work with.
    pub(super) fn check(&mut self, frame: &Frame) -> Result<(), FrameRejected> {
        let camera = &self.context.sensor.camera;
        let size = |name, width: usize, height: usize| (name, width, height);
        let sizes = [
            Some(size("colour", frame.color.width(), frame.color.height())),
            frame.depth.as_ref().map(|depth| size("depth", depth.raw.width(), depth.raw.height())),
            frame.right.as_ref().map(|right| size("right", right.width(), right.height())),
            frame.mask.as_ref().map(|mask| size("mask", mask.width(), mask.height())),
        ];
        for (image, width, height) in sizes.into_iter().flatten() {
            if (width, height) != (camera.width, camera.height) {
                let (camera_width, camera_height) = (camera.width, camera.height);
                return Err(FrameRejected::Size { image, width, height, camera_width, camera_height });
            }
        }
        match self.context.config.depth.source {
            DepthSource::Image if frame.depth.is_none() => return Err(FrameRejected::NoDepthImage),
            DepthSource::Stereo if frame.right.is_none() => return Err(FrameRejected::NoRightImage),
            _ => {}
        }
        if let Some(last_ns) = self.last_timestamp_ns.filter(|last| *last >= frame.timestamp_ns) {
            return Err(FrameRejected::Time { timestamp_ns: frame.timestamp_ns, last_ns });
        }
        self.last_timestamp_ns = Some(frame.timestamp_ns);
        Ok(())
    }

    /// Extracts features while the detector runs, and applies the dynamic filter to them.
    pub(super) fn sense(&mut self, frame: &Frame) -> Pass {
        let mut times = StageTimes::default();
        let mut clock = Stopwatch::start();
        let boxes_are_due = self.start_detector(frame);
        self.extract(frame);
        let depth = self.depth_image(frame);
        times.features = clock.lap();
        let detected = self.collect_detections(frame, boxes_are_due);
        times.detector_wait = clock.lap();
        let input = FilterInput {
            movable: &self.detections.movable,
            detected,
            mask: frame.mask.as_deref().or(self.detections.mask.as_ref()),
            gray: &self.gray,
            depth: &depth,
            sensor: &self.context.sensor,
        };
        self.filter.before_pose(&self.context.config.dynamic, &input, &mut self.tracker.current.features);
        times.dynamic = clock.lap();
        Pass { depth, times, clock, loop_closure: None, map_begun: false }
    }

    /// Hands the image to the detector if detections are due and the frame does not bring its own. Returns whether they are due.
    fn start_detector(&mut self, frame: &Frame) -> bool {
        let due = self.detections_are_due(frame.timestamp_ns);
        self.statistics.frames += 1;
        let roll_deg = self.roll_deg();
        if let Some(detector) = self.detector.as_mut().filter(|_| due && frame.detections.is_none()) {
            detector.start(&frame.color, roll_deg);
        }
        due
    }

    /// Returns whether the image of `timestamp_ns` is to be searched for people.
    fn detections_are_due(&mut self, timestamp_ns: i64) -> bool {
        let config = &self.context.config.dynamic;
        let is_due = self.statistics.frames.is_multiple_of(config.detect_every);
        if !is_due || config.detect_max_gap_s == 0.0 {
            return is_due;
        }
        let is_tracking = self.state == TrackingState::Tracking;
        let expected = is_tracking.then(|| self.tracker.predict(self.owner.map()));
        self.demand.is_due(config.detect_max_gap_s, timestamp_ns, expected, self.filter.wants_detections())
    }

    /// Returns how far the next image has to be turned to be upright, in degrees, as far as that is known before its pose: the angle for
    /// [`RollCompensation::detect`](crate::RollCompensation::detect) when detections come with the frame.
    pub fn roll_deg(&self) -> i32 {
        match self.state {
            TrackingState::NotInitialized => 0,
            _ => {
                let expected = self.tracker.predict(self.owner.map());
                self.gravity.roll_deg(&expected, self.context.config.dynamic.roll_compensation_deg)
            }
        }
    }

    /// Collects the detections of movable objects of this frame. Returns whether the image was searched for them: not if the detector
    /// fails, is late, or is not due. Tracks of people are carried over such frames.
    fn collect_detections(&mut self, frame: &Frame, due: bool) -> bool {
        self.detections.clear();
        if let Some(known) = &frame.detections {
            self.detections.movable.extend(known.iter().filter(|_| due));
            return due;
        }
        let Some(detector) = &mut self.detector else {
            self.note_missing_detector(frame);
            return false;
        };
        // A map is not begun before the people in it are known.
        let waits = !self.context.config.dynamic.detect_async || self.state == TrackingState::NotInitialized;
        match if waits { detector.finish() } else { detector.poll() } {
            None => false,
            Some(Ok(output)) => {
                self.detections.take(output);
                true
            }
            Some(Err(error)) => {
                tracing::warn!(timestamp_ns = frame.timestamp_ns, %error, "no detections for this frame");
                self.statistics.detector_failures += 1;
                false
            }
        }
    }

    /// Counts a frame in which nothing searches for people although the filter needs that, and warns at the first one.
    fn note_missing_detector(&mut self, frame: &Frame) {
        if !self.needs_boxes || frame.mask.is_some() {
            return;
        }
        if self.statistics.frames_without_detector == 0 {
            tracing::warn!(
                "no detector, and no detections or mask with the frame: people are not recognised as such; give the builder a detector, \
                 or choose dynamic.method = \"none\""
            );
        }
        self.statistics.frames_without_detector += 1;
    }

    /// Returns the depth image that all stages use.
    fn depth_image(&self, frame: &Frame) -> Arc<DepthImage> {
        match (&frame.depth, self.context.config.depth.source) {
            (Some(depth), DepthSource::Image) => depth.clone(),
            _ => self.sparse_depth.clone(),
        }
    }

    /// Extracts the features of the frame, undistorted and with depth.
    fn extract(&mut self, frame: &Frame) {
        let count = self.features_wanted();
        if let (Some(stereo), Some(right)) = (&mut self.stereo, &frame.right) {
            stereo.start(right, count);
        }
        gray_from_rgb(&frame.color, &mut self.gray);
        self.extractor.set_count(count);
        self.extractor.extract(&self.gray, &mut self.extracted);
        self.tracker.begin_frame(frame.timestamp_ns);
        let (current, sensor) = (&mut self.tracker.current, &self.context.sensor);
        let none = DepthImage::default();
        let measured = frame.depth.as_deref().filter(|_| self.context.config.depth.source == DepthSource::Image);
        current.features.fill(&self.extracted, measured.unwrap_or(&none), &sensor.camera, sensor.bounds);
        if let (Some(stereo), Some(sparse)) = (&mut self.stereo, Arc::get_mut(&mut self.sparse_depth)) {
            stereo.finish(&self.extractor, &self.extracted, &mut current.features, sparse);
        }
        let depth_ns = measured.and(frame.depth_timestamp_ns);
        let depth_after_s = depth_ns.map(|ns| ns.saturating_sub(frame.timestamp_ns) as f64 * 1e-9);
        // The velocity of the frame does not reach as far as the next one: such a depth image is used as it is.
        let depth_after_s = depth_after_s.filter(|seconds| seconds.abs() * sensor.camera.fps <= 1.0);
        let times = self.frame_times.with_depth_after(depth_after_s.unwrap_or(0.0));
        if !times.is_instant() || self.readout_search.is_some() {
            current.features.keep_measured(times);
        }
        current.clear_matches();
    }

    /// Returns how many features to extract, so that about `features.count` remain when those on moving bodies are dropped: the share
    /// dropped in the last frame is expected again.
    fn features_wanted(&self) -> usize {
        let config = &self.context.config;
        let last = &self.tracker.current.features.features;
        let trusted = last.iter().filter(|f| f.trust > 0.0).count().max(1);
        let factor = (last.len() as f64 / trusted as f64).clamp(1.0, config.dynamic.max_feature_factor);
        let begins = !self.context.sensor.measures_depth && self.is_young();
        let start = if begins { config.monocular.init_feature_factor } else { 1.0 };
        (config.features.count as f64 * factor * start) as usize
    }
}

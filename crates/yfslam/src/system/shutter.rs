//! The rolling shutter over time: what a frame shows about the one before it, and the readout time where the camera does not tell it.

use nalgebra::Vector6;

use super::{Anchor, Slam};
use crate::features::rolling_shutter::{FrameTimes, RowTimes};
use crate::geometry::perturbed;
use crate::tracking::ReadoutEstimator;

/// Estimates that follow each other: each is made with the poses that the one before has corrected.
const ROUNDS: usize = 3;

/// Keyframes that the first estimate needs: it is used for the time being, and replaced.
const FIRST_KEYFRAMES: usize = 4;

/// Standard deviations by which a readout time differs from that of a global shutter.
const ROLLING_SIGMAS: f64 = 4.0;

/// Standard deviations within which it is that of a global shutter.
const GLOBAL_SIGMAS: f64 = 2.0;

/// Frames for which memory is reserved.
const FRAMES: usize = 2048;

/// How the readout time of the rows of an image is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Readout {
    /// Time from the first to the last row that is in use, ms; 0 is a global shutter.
    pub in_use_ms: f64,
    /// Whether the camera told it. If it did not, it was estimated, or a global shutter is assumed.
    pub from_camera: bool,
    /// The estimate, ms, where the camera did not tell it.
    pub estimate_ms: Option<f64>,
    /// Standard deviation of the estimate, ms.
    pub sigma_ms: Option<f64>,
    /// Mean of the squared residual of the depths, in units of their variance, over the frames from which the estimate was made: least where
    /// the delay between colour and depth images is right.
    pub depth_residual: Option<f64>,
    /// Whether the estimate was certain enough to be used.
    pub is_certain: bool,
}

/// The estimate of the readout time while it is under way.
#[derive(Clone, Debug)]
pub(super) struct ReadoutSearch {
    pub(super) estimator: ReadoutEstimator,
    round: usize,
    /// Sum of the mean squared residuals of the depths, and their number.
    depth_residuals: (f64, usize),
    /// Time stamps, ns, of the frames so far, and how the pose of each, relative to its keyframe, changes with the readout time.
    pose_changes: Vec<(i64, Vector6<f64>)>,
}

impl Default for ReadoutSearch {
    fn default() -> Self {
        let pose_changes = Vec::with_capacity(FRAMES);
        Self { estimator: ReadoutEstimator::default(), round: 0, depth_residuals: (0.0, 0), pose_changes }
    }
}

impl Slam {
    /// Takes over what the frame has shown about the velocity of the last one: its pose, the features of a keyframe, and what it says about
    /// the readout time.
    pub(super) fn correct_last_frame(&mut self) {
        let Some(velocity) = self.tracker.last_velocity else { return };
        let (timestamp_ns, relative_pose) = self.tracker.last_pose();
        if let (Some(anchor), Some((reference, t_cam_reference))) = (self.anchors.last_mut(), relative_pose)
            && anchor.timestamp_ns == timestamp_ns
        {
            *anchor = Anchor { timestamp_ns, reference, t_cam_reference };
        }
        if self.tracker.last_was_keyframe() && !self.is_map_frozen() {
            self.owner.retime(timestamp_ns, &velocity);
        }
        if let Some(mut search) = self.readout_search.take() {
            if let Some(residual) = self.tracker.current.depth_residual(&self.context.sensor) {
                let (sum, count) = &mut search.depth_residuals;
                (*sum, *count) = (*sum + residual, *count + 1);
                self.readout.depth_residual = Some(*sum / *count as f64);
            }
            let change = self.tracker.estimate_readout(&self.context, self.owner.map(), &mut search.estimator);
            search.pose_changes.extend(change.map(|change| (timestamp_ns, change)));
            self.readout_search = self.conclude(search);
        }
    }

    /// Uses the estimate of the readout time once it is certain. Returns the search if it has to go on.
    fn conclude(&mut self, mut search: ReadoutSearch) -> Option<ReadoutSearch> {
        let config = &self.context.config.tracking;
        let Some(estimate) = search.estimator.estimate() else { return Some(search) };
        if search.estimator.is_full() && !self.readout.from_camera {
            // The motion of this camera does not show it: no more time is spent on it.
            return None;
        }
        let (readout_ms, sigma_ms) = (1e3 * estimate.readout_s, 1e3 * estimate.sigma_s);
        let camera = &self.context.sensor.camera;
        // A sensor reads its rows in no more than the time between two frames.
        let longest_ms = 1e3 / camera.fps;
        let is_possible = readout_ms.abs() <= longest_ms + 3.0 * sigma_ms;
        let readout_ms = readout_ms.clamp(-longest_ms, longest_ms);
        let is_precise = sigma_ms <= config.readout_max_sigma_ms;
        let is_rolling = readout_ms.abs() >= config.readout_min_ms.max(ROLLING_SIGMAS * sigma_ms);
        let is_certain = estimate.keyframes >= config.readout_min_keyframes && is_precise && is_possible;
        // The report belongs to the value in use, not to a later estimate that is still under way.
        if search.round == 0 || is_certain {
            self.readout.estimate_ms = Some(readout_ms);
            self.readout.sigma_ms = Some(sigma_ms);
            self.readout.is_certain = is_certain;
        }
        let needed = if search.round == 0 { FIRST_KEYFRAMES } else { config.readout_min_keyframes };
        if self.readout.from_camera || estimate.keyframes < needed {
            return Some(search);
        }
        match (is_certain, is_rolling && is_possible) {
            (true, true) => self.use_readout(readout_ms, &search.pose_changes),
            // At first, a rough value is better than none.
            (false, true) if search.round == 0 => self.use_readout(readout_ms, &search.pose_changes),
            (false, _) => return Some(search),
            (true, false) if readout_ms.abs() >= GLOBAL_SIGMAS * sigma_ms => return Some(search),
            // A global shutter, or something that the model does not describe: the images are used as they are.
            (true, false) => {
                if search.round > 0 {
                    self.use_readout(0.0, &search.pose_changes);
                }
                return None;
            }
        }
        search.round += 1;
        search.estimator.clear();
        (search.round < ROUNDS).then_some(search)
    }

    /// Uses a readout time from now on, and corrects the map and the poses of earlier frames for it.
    fn use_readout(&mut self, readout_ms: f64, pose_changes: &[(i64, Vector6<f64>)]) {
        let change_s = 1e-3 * (readout_ms - self.readout.in_use_ms);
        let mut changes = pose_changes.iter().peekable();
        for anchor in &mut self.anchors {
            while changes.next_if(|(timestamp_ns, _)| *timestamp_ns < anchor.timestamp_ns).is_some() {}
            if let Some((_, change)) = changes.next_if(|(timestamp_ns, _)| *timestamp_ns == anchor.timestamp_ns) {
                anchor.t_cam_reference = perturbed(&(change * change_s), &anchor.t_cam_reference);
            }
        }
        let camera = &self.context.sensor.camera;
        let color = RowTimes::new(camera, readout_ms);
        let depth = camera.depth_readout_ms.map_or(color, |ms| RowTimes::new(camera, ms));
        self.readout.in_use_ms = readout_ms;
        self.frame_times = FrameTimes { color, depth, ..self.frame_times };
        self.tracker.set_row_times(&self.frame_times);
        if !self.is_map_frozen() {
            self.owner.set_row_times(&self.frame_times);
        }
    }
}

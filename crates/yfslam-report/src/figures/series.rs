//! In: a report. Out: what its figures show of a method: trajectory in one world frame, errors over time, periods without a pose.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::orientation::{BodyRotation, mean_rotation};
use crate::content::{MethodReport, Report};
use yfslam_eval::{Alignment, Match, StampedPose, associate};

/// Least number of consecutive frames without a pose that count as lost: single frames may have been dropped by the sensor.
const SHORTEST_LOSS: usize = 3;
/// Time before the first and after the last frame for which the ground truth is shown, ns.
const MARGIN_NS: i64 = 50_000_000;

/// Position of the camera at a time.
#[derive(Clone, Copy, Debug)]
pub struct At {
    pub time_s: f64,
    pub position_m: Vector3<f64>,
    /// Up direction of its image, in the world.
    pub up: Vector3<f64>,
}

/// Error of an estimate at a time, after alignment.
#[derive(Clone, Copy, Debug)]
pub struct ErrorAt {
    pub time_s: f64,
    pub translation_m: f64,
    /// Roll, pitch and yaw of the camera about its viewing direction, its right and its down, degrees.
    pub rotation_deg: [f64; 3],
}

/// What figures show of one method.
pub struct Series {
    /// Connected parts of the trajectory in the world of the ground truth; empty if it cannot be aligned.
    pub track: Vec<Vec<At>>,
    /// Errors, in the same parts.
    pub errors: Vec<Vec<ErrorAt>>,
    /// Periods without a pose, s.
    pub lost: Vec<[f64; 2]>,
}

/// Seconds since the first frame.
pub struct Clock {
    first_ns: i64,
    last_ns: i64,
}

impl Clock {
    /// Returns the clock of a report.
    pub fn new(report: &Report) -> Self {
        let poses = report.methods.iter().flat_map(|m| m.trajectory).map(|p| p.timestamp_ns);
        let stamps = || report.frames_ns.iter().copied();
        let first_ns = stamps().chain(poses.clone()).min().unwrap_or(0);
        Self { first_ns, last_ns: stamps().chain(poses).max().unwrap_or(first_ns) }
    }

    /// Returns the time of the last frame, s.
    pub fn end_s(&self) -> f64 {
        self.seconds(self.last_ns)
    }

    fn seconds(&self, timestamp_ns: i64) -> f64 {
        timestamp_ns.saturating_sub(self.first_ns) as f64 / 1e9
    }

    fn at(&self, pose: &StampedPose) -> At {
        let up = pose.t_world_cam.rotation * -Vector3::y();
        At { time_s: self.seconds(pose.timestamp_ns), position_m: pose.t_world_cam.translation.vector, up }
    }

    /// Returns the part of the ground truth in the time of the frames.
    pub fn truth(&self, truth: &[StampedPose], body_rotation: &BodyRotation) -> Vec<At> {
        let span = self.first_ns.saturating_sub(MARGIN_NS)..=self.last_ns.saturating_add(MARGIN_NS);
        truth.iter().filter(|p| span.contains(&p.timestamp_ns)).map(|p| self.at(&body_rotation.camera(p))).collect()
    }
}

impl Series {
    /// Prepares the data of a method.
    pub fn new(report: &Report, method: &MethodReport, clock: &Clock, body_rotation: &BodyRotation) -> Self {
        let gaps = gaps(report.frames_ns, method.trajectory);
        let lost = gaps.iter().map(|gap| gap.map(|t| clock.seconds(t))).collect();
        let alignment = match (report.truth, method.evaluation) {
            (Some(_), None) => return Self { track: Vec::new(), errors: Vec::new(), lost },
            (_, evaluation) => evaluation.map(|e| e.ate.alignment),
        };
        let moved = |pose: &StampedPose| alignment.map_or(*pose, |a| a.apply(pose));
        let track = method.trajectory.iter().map(|pose| clock.at(&moved(pose))).collect();
        let errors = alignment.map_or(Vec::new(), |alignment| errors(report, method, &alignment, clock, body_rotation));
        Self {
            track: split(track, &lost, |at: &At| at.time_s),
            errors: split(errors, &lost, |error: &ErrorAt| error.time_s),
            lost,
        }
    }

    /// Returns all errors, in order of time.
    pub fn all_errors(&self) -> impl Iterator<Item = &ErrorAt> + Clone {
        self.errors.iter().flatten()
    }
}

/// Returns the periods without a pose, each from the last pose before it to the first pose after it, ns.
fn gaps(frames_ns: &[i64], trajectory: &[StampedPose]) -> Vec<[i64; 2]> {
    let (Some(&first), Some(&last)) = (frames_ns.first(), frames_ns.last()) else { return Vec::new() };
    let mut ends = vec![first - 1];
    ends.extend(trajectory.iter().map(|p| p.timestamp_ns));
    ends.push(last + 1);
    let frames_between = |from: i64, to: i64| {
        frames_ns.partition_point(|t| *t < to).saturating_sub(frames_ns.partition_point(|t| *t <= from))
    };
    let pairs = ends.windows(2).filter_map(|pair| <[i64; 2]>::try_from(pair).ok());
    pairs.filter(|&[from, to]| frames_between(from, to) >= SHORTEST_LOSS).collect()
}

fn errors(
    report: &Report,
    method: &MethodReport,
    alignment: &Alignment,
    clock: &Clock,
    body_rotation: &BodyRotation,
) -> Vec<ErrorAt> {
    let (Some(truth), Some(evaluation)) = (report.truth, method.evaluation) else { return Vec::new() };
    let mut matches = associate(truth, method.trajectory, evaluation.max_diff_ns).unwrap_or_default();
    matches.iter_mut().for_each(|m| m.reference = body_rotation.camera(&m.reference));
    let turn = mean_rotation(&matches);
    let error = |m: &Match| {
        let (truth, estimate) = (m.reference.t_world_cam, m.estimate.t_world_cam);
        let aligned = alignment.apply(&m.estimate).t_world_cam;
        ErrorAt {
            time_s: clock.seconds(m.estimate.timestamp_ns),
            translation_m: (truth.translation.vector - aligned.translation.vector).norm(),
            rotation_deg: roll_pitch_yaw_deg(&(truth.rotation.inverse() * turn * estimate.rotation)),
        }
    };
    matches.iter().map(error).collect()
}

/// Returns the angles of a rotation in the camera frame (x right, y down, z forward): roll about z, pitch about x, yaw about y.
fn roll_pitch_yaw_deg(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    // In the axes forward, right, down these are the usual Euler angles.
    let q = Quaternion::new(rotation.w, rotation.k, rotation.i, rotation.j);
    let (roll, pitch, yaw) = UnitQuaternion::new_unchecked(q).euler_angles();
    [roll, pitch, yaw].map(f64::to_degrees)
}

/// Splits values in order of time at the periods without a pose.
fn split<T>(values: Vec<T>, lost: &[[f64; 2]], time_s: impl Fn(&T) -> f64) -> Vec<Vec<T>> {
    let mut parts: Vec<Vec<T>> = Vec::new();
    let mut before = None;
    for value in values {
        // The number of periods that have ended gives the part to which a value belongs.
        let over = lost.partition_point(|[_, to]| *to <= time_s(&value) + 1e-6);
        match parts.last_mut() {
            Some(part) if before == Some(over) => part.push(value),
            _ => parts.push(vec![value]),
        }
        before = Some(over);
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Isometry3;

    fn poses(frames: impl IntoIterator<Item = i64>) -> Vec<StampedPose> {
        frames.into_iter().map(|i| StampedPose::new(i * 33, Isometry3::identity())).collect()
    }

    #[test]
    fn three_frames_without_a_pose_are_a_loss_and_two_are_not() {
        let frames_ns: Vec<i64> = (0..20).map(|i| i * 33).collect();
        let trajectory = poses([0, 1, 4, 8, 9, 10, 11, 12, 13, 14, 15, 16]);
        assert_eq!(gaps(&frames_ns, &trajectory), [[4 * 33, 8 * 33], [16 * 33, 19 * 33 + 1]]);
        assert_eq!(gaps(&frames_ns, &poses(3..20)), [[-1, 3 * 33]]);
        assert!(gaps(&[], &trajectory).is_empty());
        let parts = split(vec![0.0, 1.0, 5.0, 6.0], &[[1.0, 5.0]], |v| *v);
        assert_eq!(parts, [vec![0.0, 1.0], vec![5.0, 6.0]]);
    }

    #[test]
    fn roll_is_about_the_viewing_direction_pitch_about_right_and_yaw_about_down() {
        let angles = |axis: Vector3<f64>| {
            roll_pitch_yaw_deg(&UnitQuaternion::new(axis * 10f64.to_radians())).map(|a| (a * 1e6).round() / 1e6)
        };
        assert_eq!(angles(Vector3::z()), [10.0, 0.0, 0.0]);
        assert_eq!(angles(Vector3::x()), [0.0, 10.0, 0.0]);
        assert_eq!(angles(Vector3::y()), [0.0, 0.0, 10.0]);
    }
}

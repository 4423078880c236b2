//! Splits the pose in the map into odometry that never jumps and a correction that may (REP 105).
//!
//! In: poses of the base in the map, and whether the map has changed. Out: the pose of the base in `odom`, its velocity, and the pose of
//! `odom` in the map.
//!
//! The motion between two frames moves the base in `odom`. When a loop was closed, the camera was relocalised, or the base would have
//! moved faster than it can, the difference is no motion: the base moves on in `odom` as it did before, and `odom` moves in the map.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// A velocity is not carried over a longer time, s.
const LONGEST_STEP_S: f64 = 0.5;

/// Fastest motion that is taken for motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedLimit {
    /// Metres per second.
    pub linear_m_s: f64,
    /// Radians per second.
    pub angular_rad_s: f64,
}

/// Splits poses in the map into odometry and a correction.
#[derive(Clone, Debug)]
pub struct OdomSplit {
    limit: SpeedLimit,
    t_odom_base: Isometry3<f64>,
    last: Option<(i64, Isometry3<f64>)>,
    velocity: Velocity,
    path_m: f64,
}

/// Velocity of the base along its own axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Velocity {
    /// Metres per second.
    pub linear_m_s: Vector3<f64>,
    /// Radians per second.
    pub angular_rad_s: Vector3<f64>,
}

/// Result for one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OdomStep {
    /// Pose of the base in `odom`.
    pub t_odom_base: Isometry3<f64>,
    /// Pose of `odom` in the map.
    pub t_map_odom: Isometry3<f64>,
    /// Velocity of the base.
    pub velocity: Velocity,
    /// Time since the last frame, s; `None` at the first one.
    pub step_s: Option<f64>,
    /// Whether the map has jumped.
    pub has_jumped: bool,
    /// Length of the path in `odom`, m.
    pub path_m: f64,
}

impl OdomSplit {
    /// Begins with the base at the origin of `odom`.
    pub fn new(limit: SpeedLimit) -> Self {
        let t_odom_base = Isometry3::identity();
        Self { limit, t_odom_base, last: None, velocity: Velocity::default(), path_m: 0.0 }
    }

    /// Takes the pose of the base at `stamp_ns`; `is_corrected` says that the map has changed since the last frame.
    pub fn update(&mut self, stamp_ns: i64, t_map_base: Isometry3<f64>, is_corrected: bool) -> OdomStep {
        let step_s = self.last.map(|(last_ns, _)| (stamp_ns.saturating_sub(last_ns)) as f64 / 1e9);
        let mut has_jumped = false;
        if let (Some((_, last)), Some(step_s)) = (self.last, step_s.filter(|s| *s > 0.0)) {
            let motion = last.inverse() * t_map_base;
            let velocity = Velocity {
                linear_m_s: motion.translation.vector / step_s,
                angular_rad_s: motion.rotation.scaled_axis() / step_s,
            };
            let is_possible = velocity.linear_m_s.norm() <= self.limit.linear_m_s
                && velocity.angular_rad_s.norm() <= self.limit.angular_rad_s;
            has_jumped = is_corrected || !is_possible;
            if !has_jumped {
                self.velocity = velocity;
            } else if step_s > LONGEST_STEP_S {
                self.velocity = Velocity::default();
            }
            let motion = if has_jumped { self.velocity.over(step_s) } else { motion };
            self.path_m += motion.translation.vector.norm();
            self.t_odom_base *= motion;
            self.t_odom_base.rotation.renormalize();
        }
        self.last = Some((stamp_ns, t_map_base));
        OdomStep {
            t_odom_base: self.t_odom_base,
            t_map_odom: t_map_base * self.t_odom_base.inverse(),
            velocity: self.velocity,
            step_s,
            has_jumped,
            path_m: self.path_m,
        }
    }

    /// Notes that the pose is unknown: what follows begins where the base was last.
    pub fn lose(&mut self) {
        self.last = None;
        self.velocity = Velocity::default();
    }

    /// Notes that the map frame was moved by hand.
    pub fn move_map(&mut self, t_new_old: &Isometry3<f64>) {
        if let Some((_, pose)) = &mut self.last {
            *pose = t_new_old * *pose;
        }
    }
}

impl Velocity {
    fn over(&self, step_s: f64) -> Isometry3<f64> {
        let rotation = UnitQuaternion::from_scaled_axis(self.angular_rad_s * step_s);
        Isometry3::from_parts(Translation3::from(self.linear_m_s * step_s), rotation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: i64 = 100_000_000;

    fn split() -> OdomSplit {
        OdomSplit::new(SpeedLimit { linear_m_s: 3.0, angular_rad_s: 3.0 })
    }

    fn along_x(x: f64) -> Isometry3<f64> {
        Isometry3::translation(x, 0.0, 0.0)
    }

    #[test]
    fn without_corrections_odometry_is_the_motion_since_the_start_and_the_map_stays() {
        let mut split = split();
        let start = Isometry3::new(Vector3::new(4.0, 1.0, 0.0), Vector3::z());
        for i in 0..10 {
            let step = split.update(STEP * i, start * along_x(0.1 * i as f64), false);
            assert!((step.t_odom_base.translation.x - 0.1 * i as f64).abs() < 1e-9);
            assert!((step.t_map_odom.translation.vector - start.translation.vector).norm() < 1e-9);
        }
    }

    #[test]
    fn a_loop_moves_the_map_and_never_the_odometry() {
        let mut split = split();
        let mut last = split.update(0, along_x(0.0), false).t_odom_base;
        for i in 1..20 {
            // The loop shifts the whole map by 2 m at frame 10.
            let shift = if i < 10 { 0.0 } else { 2.0 };
            let pose = Isometry3::translation(0.1 * f64::from(i), shift, 0.0);
            let step = split.update(STEP * i64::from(i), pose, i == 10);
            let moved = (step.t_odom_base.translation.vector - last.translation.vector).norm();
            assert!((moved - 0.1).abs() < 1e-9, "frame {i} moved {moved} m in odom");
            assert_eq!(step.has_jumped, i == 10);
            assert!(((step.t_map_odom * step.t_odom_base).translation.vector - pose.translation.vector).norm() < 1e-9);
            last = step.t_odom_base;
        }
    }

    #[test]
    fn a_jump_that_was_not_announced_is_recognised_by_its_speed() {
        let mut split = split();
        split.update(0, along_x(0.0), false);
        split.update(STEP, along_x(0.1), false);
        let step = split.update(2 * STEP, along_x(5.0), false);
        assert!(step.has_jumped && (step.t_odom_base.translation.x - 0.2).abs() < 1e-9);
    }

    #[test]
    fn after_a_loss_odometry_continues_where_it_was() {
        let mut split = split();
        split.update(0, along_x(0.0), false);
        let before = split.update(STEP, along_x(0.1), false);
        split.lose();
        let after = split.update(50 * STEP, along_x(3.0), false);
        assert_eq!(after.t_odom_base, before.t_odom_base);
        assert!((after.t_map_odom.translation.x - 2.9).abs() < 1e-9 && after.velocity == Velocity::default());
    }
}

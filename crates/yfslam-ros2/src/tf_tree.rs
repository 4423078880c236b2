//! Transforms between frames: fixed ones of `/tf_static`, and those of `odom` to the base of the last seconds.

use std::collections::{BTreeMap, VecDeque};

use nalgebra::Isometry3;

use crate::messages::{TfMessage, TransformStamped};

/// Frames that are remembered: more than any robot has.
const MOST_FRAMES: usize = 4096;
/// Longest chain of frames, which ends circles.
const LONGEST_CHAIN: usize = 64;
/// Transforms that are remembered, such as 10 s at 100 Hz.
const MOST_POSES: usize = 1000;

/// Fixed transforms.
#[derive(Clone, Debug, Default)]
pub struct StaticTf(BTreeMap<String, (String, Isometry3<f64>)>);

impl StaticTf {
    /// Adds transforms; those with numbers that are not finite are left out.
    pub fn add(&mut self, message: &TfMessage) {
        for TransformStamped { header, child_frame_id, transform } in &message.transforms {
            if let Some(pose) = transform.to_isometry().filter(|_| self.0.len() < MOST_FRAMES) {
                self.0.insert(plain(child_frame_id), (plain(&header.frame_id), pose));
            }
        }
    }

    /// Returns the pose of frame `child` in frame `parent`, wherever both are in the tree.
    pub fn lookup(&self, parent: &str, child: &str) -> Option<Isometry3<f64>> {
        let ancestors = self.chain(&plain(child));
        let parents = self.chain(&plain(parent));
        let (name, t_common_child) =
            ancestors.iter().find(|(name, _)| parents.iter().any(|(other, _)| other == name))?;
        let (_, t_common_parent) = parents.iter().find(|(other, _)| other == name)?;
        Some(t_common_parent.inverse() * t_common_child)
    }

    /// Returns the frame itself and its ancestors, each with the pose of the frame in it.
    fn chain(&self, frame: &str) -> Vec<(String, Isometry3<f64>)> {
        let mut chain = vec![(frame.to_owned(), Isometry3::identity())];
        while let Some((last, pose)) = chain.last().filter(|_| chain.len() < LONGEST_CHAIN)
            && let Some((parent, t_parent_last)) = self.0.get(last)
        {
            chain.push((parent.clone(), t_parent_last * pose));
        }
        chain
    }
}

/// Poses of the base in `odom` that another node publishes.
#[derive(Clone, Debug, Default)]
pub struct GivenOdom(VecDeque<(i64, Isometry3<f64>)>);

impl GivenOdom {
    /// Adds a pose.
    pub fn add(&mut self, stamp_ns: i64, t_odom_base: Isometry3<f64>) {
        if self.0.back().is_some_and(|(last, _)| stamp_ns <= *last) {
            self.0.clear();
        }
        if self.0.len() == MOST_POSES {
            self.0.pop_front();
        }
        self.0.push_back((stamp_ns, t_odom_base));
    }

    /// Returns the pose at a time, between the two that are nearest, or the last one if the time is less than `ahead_ns` after it.
    pub fn at(&self, stamp_ns: i64, ahead_ns: i64) -> Option<Isometry3<f64>> {
        let next = self.0.partition_point(|(at, _)| *at < stamp_ns);
        match (next.checked_sub(1).and_then(|i| self.0.get(i)), self.0.get(next)) {
            (_, Some((at, pose))) if *at == stamp_ns => Some(*pose),
            (Some((before_ns, before)), Some((after_ns, after))) => {
                let share = stamp_ns.saturating_sub(*before_ns) as f64 / (after_ns - before_ns).max(1) as f64;
                before.try_lerp_slerp(after, share, 1e-9)
            }
            (Some((last_ns, last)), None) if stamp_ns.saturating_sub(*last_ns) <= ahead_ns => Some(*last),
            _ => None,
        }
    }
}

/// Returns the name of a frame without the slash of tf 1.
fn plain(frame: &str) -> String {
    frame.trim_start_matches('/').to_owned()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::messages::Header;

    fn tree(transforms: &[(&str, &str, Isometry3<f64>)]) -> StaticTf {
        let mut tree = StaticTf::default();
        let stamped = |(parent, child, pose): &(&str, &str, Isometry3<f64>)| TransformStamped {
            header: Header::new(0, parent),
            child_frame_id: (*child).into(),
            transform: (*pose).into(),
        };
        tree.add(&TfMessage { transforms: transforms.iter().map(stamped).collect() });
        tree
    }

    #[test]
    fn a_pose_is_found_up_down_and_across_the_tree() {
        let turn = Isometry3::new(Vector3::new(0.0, 0.0, 1.0), Vector3::z());
        let tree = tree(&[
            ("base", "mast", turn),
            ("mast", "/optical", Isometry3::translation(1.0, 0.0, 0.0)),
            ("base", "laser", turn),
        ]);
        let expected = turn * Isometry3::translation(1.0, 0.0, 0.0);
        let near = |a: Isometry3<f64>, b: Isometry3<f64>| (a.inverse() * b).translation.vector.norm() < 1e-9;
        assert!(near(tree.lookup("base", "optical").unwrap(), expected));
        assert!(near(tree.lookup("optical", "base").unwrap(), expected.inverse()));
        assert!(near(tree.lookup("laser", "optical").unwrap(), Isometry3::translation(1.0, 0.0, 0.0)));
        assert_eq!(tree.lookup("base", "wheel"), None);
    }

    #[test]
    fn a_circle_of_frames_ends() {
        let one = Isometry3::identity();
        assert_eq!(tree(&[("a", "b", one), ("b", "a", one)]).lookup("c", "a"), None);
    }

    #[test]
    fn odometry_is_interpolated_and_carried_on_for_a_short_time_only() {
        let mut odom = GivenOdom::default();
        odom.add(100, Isometry3::translation(1.0, 0.0, 0.0));
        odom.add(200, Isometry3::translation(2.0, 0.0, 0.0));
        let x = |stamp| odom.at(stamp, 50).map(|pose| pose.translation.x);
        assert_eq!([x(99), x(100), x(150), x(240), x(251)], [None, Some(1.0), Some(1.5), Some(2.0), None]);
    }
}

//! Detection on demand: when the next image has to be searched for people, if not every image is (`dynamic.detect_max_gap_s`).

use crate::geometry::Pose;

/// Angle by which the camera turns until the image shows much that no detection has seen, rad. Source: chosen: a tenth of the view of
/// common cameras.
const MAX_TURN_RAD: f64 = 0.1;
/// Path of the camera likewise, m. Source: chosen: a tenth of the width of the view at 2 m.
const MAX_PATH_M: f64 = 0.2;

/// The last image that was searched.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DetectionDemand {
    last: Option<(i64, Pose)>,
}

impl DetectionDemand {
    /// Returns whether the image of `timestamp_ns` is to be searched, and remembers it if so. `expected` is the pose of its camera, world
    /// to camera, if it is known, and `is_wanted` whether the filter cannot do without.
    pub(super) fn is_due(
        &mut self,
        max_gap_s: f64,
        timestamp_ns: i64,
        expected: Option<Pose>,
        is_wanted: bool,
    ) -> bool {
        let is_known = |(last_ns, last): (i64, Pose)| {
            let moved = expected.map(|expected| expected * last.inverse());
            // Half a millisecond for the jitter of stamps.
            let gap_s = timestamp_ns.saturating_sub(last_ns) as f64 * 1e-9 + 0.0005;
            gap_s < max_gap_s
                && moved.is_some_and(|moved| {
                    moved.rotation.angle() < MAX_TURN_RAD && moved.translation.vector.norm() < MAX_PATH_M
                })
        };
        let is_due = is_wanted || !self.last.is_some_and(is_known);
        if is_due {
            self.last = expected.map(|expected| (timestamp_ns, expected));
        }
        is_due
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::*;

    #[test]
    fn an_image_is_searched_after_the_gap_after_motion_when_wanted_and_when_the_pose_is_not_known() {
        let mut demand = DetectionDemand::default();
        let ms = |ms: i64| ms * 1_000_000;
        let at = |x: f64, turn: f64| Some(Isometry3::new(Vector3::new(x, 0.0, 0.0), Vector3::y() * turn));
        assert!(demand.is_due(0.15, ms(0), at(0.0, 0.0), false), "the first");
        assert!(!demand.is_due(0.15, ms(33), at(0.01, 0.01), false));
        assert!(demand.is_due(0.15, ms(66), at(0.02, 0.02), true), "wanted");
        assert!(!demand.is_due(0.15, ms(100), at(0.05, 0.05), false));
        assert!(demand.is_due(0.15, ms(133), at(0.05, 0.13), false), "turned since the last search");
        assert!(demand.is_due(0.15, ms(166), at(0.3, 0.13), false), "moved");
        assert!(!demand.is_due(0.15, ms(200), at(0.3, 0.13), false));
        assert!(demand.is_due(0.15, ms(316), at(0.3, 0.13), false), "time has passed");
        assert!(demand.is_due(0.15, ms(333), None, false), "lost");
        assert!(demand.is_due(0.15, ms(366), at(0.3, 0.13), false), "no pose of the last search");
        assert!(demand.is_due(0.0, ms(367), at(0.3, 0.13), false), "every image");
    }
}

//! Whether the drift that a loop would take away can have come about on the way since.
//!
//! In: the two ends of a loop and the drift between them. Out: yes or no. The scale of an RGB-D map is measured, so its drift grows with
//! the way and stays a small share of it; a place that merely looks the same is metres and right angles off. Without depth the scale
//! drifts, too.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use slotmap::SecondaryMap;

use crate::config::LoopConfig;
use crate::geometry::Similarity;
use crate::map::{KeyFrameId, Map};

/// Whether the camera can have drifted by `drift` between the two keyframes.
pub(super) fn is_plausible(
    config: &LoopConfig,
    map: &Map,
    from: KeyFrameId,
    to: KeyFrameId,
    drift: &Similarity,
) -> bool {
    // Between two submaps there is no way, and nothing to be explained by it.
    let Some(way) = way_between(map, from, to) else { return false };
    let motion = drift.isometry;
    let (shift_m, turn_deg) = (motion.translation.vector.norm(), motion.rotation.angle().to_degrees());
    let scale = drift.scaling().ln().abs();
    shift_m <= config.max_drift_m + config.max_drift_m_per_m * way
        && turn_deg <= config.max_drift_deg + config.max_drift_deg_per_m * way
        && scale <= (config.max_drift_scale + config.max_drift_scale_per_m * way).ln_1p()
}

/// The shortest way from one keyframe to another over keyframes that share landmarks: metres, to which each radian turned adds one.
/// (Dijkstra, A Note on Two Problems in Connexion with Graphs, Numerische Mathematik 1959.)
fn way_between(map: &Map, from: KeyFrameId, to: KeyFrameId) -> Option<f64> {
    let mut ways: SecondaryMap<KeyFrameId, u64> = SecondaryMap::new();
    let mut open = BinaryHeap::from([(Reverse(0), from)]);
    ways.insert(from, 0);
    while let Some((Reverse(way_um), id)) = open.pop() {
        if id == to {
            return Some(way_um as f64 * 1e-6);
        }
        let Some(keyframe) = map.keyframe(id).filter(|_| ways.get(id) == Some(&way_um)) else { continue };
        let covisible = keyframe.covisible.iter().map(|(other, _)| other);
        for &other in covisible.chain(&keyframe.parent).chain(&keyframe.children).chain(&keyframe.loop_edges) {
            let Some(there) = map.keyframe(other) else { continue };
            let motion = there.t_cam_world * keyframe.t_cam_world.inverse();
            // Whole micrometres: an order that has no relative_poses of rounding.
            let step_um = ((motion.translation.vector.norm() + motion.rotation.angle()) * 1e6) as u64;
            let way_um = way_um.saturating_add(step_um);
            if ways.get(other).is_none_or(|known| way_um < *known) {
                ways.insert(other, way_um);
                open.push((Reverse(way_um), other));
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::{Descriptor, Feature, FrameFeatures, ImageBounds};
    use crate::geometry::{Pose, unscaled};
    use nalgebra::{Point3, Vector3};

    /// Keyframes a metre apart along a way, each of which shares landmarks with the next.
    fn walk(metres: usize) -> (Map, Vec<KeyFrameId>) {
        let bounds = ImageBounds { u_min: 0.0, u_max: 640.0, v_min: 0.0, v_max: 480.0 };
        let feature = |i| Feature {
            raw: [i as f32, 8.0],
            u: i as f32,
            v: 8.0,
            octave: 0,
            angle_rad: 0.0,
            depth_m: Some(2.0),
            trust: 1.0,
        };
        let mut map = Map::default();
        let mut ids: Vec<KeyFrameId> = Vec::new();
        for at in 0..=metres {
            let features =
                FrameFeatures::from_parts((0..40).map(feature).collect(), vec![Descriptor([0; 4]); 40], bounds);
            let pose = Pose::translation(-(at as f64), 0.0, 0.0);
            let id = map.insert_keyframe(at as i64, pose, features);
            if let Some(&last) = ids.last() {
                for i in 0..20 {
                    let landmark = map.insert_landmark(Point3::new(at as f64, 0.0, 2.0), last, i, [0; 3], &[1.0]);
                    map.add_observation(landmark.unwrap(), id, 20 + i);
                }
                map.update_covisibility(id);
            }
            ids.push(id);
        }
        (map, ids)
    }

    #[test]
    fn a_long_way_explains_a_drift_that_a_short_one_does_not() {
        let (map, ids) = walk(20);
        assert!((way_between(&map, ids[0], ids[20]).unwrap() - 20.0).abs() < 1e-4);
        let c = LoopConfig::default();
        let explained = |end: usize, drift: Pose| is_plausible(&c, &map, ids[0], ids[end], &unscaled(&drift));
        let shift = Pose::translation(0.0, 0.8, 0.0);
        assert!(explained(20, shift) && !explained(5, shift));
        let turn = Pose::rotation(Vector3::new(0.0, 0.2, 0.0));
        assert!(explained(20, turn) && !explained(5, turn));
        assert!(!explained(20, Pose::rotation(Vector3::new(0.0, std::f64::consts::PI, 0.0))));
        for scale in [1.4, 1.0 / 1.4] {
            let explained = |end: usize| is_plausible(&c, &map, ids[0], ids[end], &Similarity::from_scaling(scale));
            assert!(explained(20) && !explained(5));
        }
    }

    #[test]
    fn there_is_no_way_between_maps_that_share_nothing() {
        let (mut map, ids) = walk(3);
        let features = map.keyframe(ids[0]).unwrap().features.clone();
        let apart = map.insert_keyframe(9, Pose::identity(), features);
        assert_eq!(way_between(&map, ids[0], apart), None);
    }
}

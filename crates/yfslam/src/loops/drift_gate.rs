//! Plausibility of the drift that a loop would correct.
//!
//! In: the two keyframes of a loop and the drift between them. Out: whether odometry can have accumulated that drift on the path
//! between them. The scale of an RGB-D map is measured, so its drift is a small share of the length of the path; a place that
//! merely has the same appearance differs by metres and right angles. Without depth the scale drifts, too.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use slotmap::SecondaryMap;

use crate::config::LoopConfig;
use crate::geometry::Similarity;
use crate::map::{KeyFrameId, Map};

/// Returns whether `drift` can have accumulated between the two keyframes.
pub(super) fn is_plausible(
    config: &LoopConfig,
    map: &Map,
    from: KeyFrameId,
    to: KeyFrameId,
    drift: &Similarity,
) -> bool {
    // Between two submaps there is no path on which drift could have accumulated.
    let Some(path_m) = path_length_m(map, from, to) else { return false };
    let motion = drift.isometry;
    let (shift_m, turn_deg) = (motion.translation.vector.norm(), motion.rotation.angle().to_degrees());
    let scale = libm::log(drift.scaling()).abs();
    shift_m <= config.max_drift_m + config.max_drift_m_per_m * path_m
        && turn_deg <= config.max_drift_deg + config.max_drift_deg_per_m * path_m
        && scale <= libm::log1p(config.max_drift_scale + config.max_drift_scale_per_m * path_m)
}

/// Returns the length of the shortest path between two keyframes over covisible keyframes, parents, children and loop edges:
/// metres, plus one for each radian of rotation. (Dijkstra, A Note on Two Problems in Connexion with Graphs, Numerische Mathematik
/// 1959.)
fn path_length_m(map: &Map, from: KeyFrameId, to: KeyFrameId) -> Option<f64> {
    let mut lengths: SecondaryMap<KeyFrameId, u64> = SecondaryMap::new();
    let mut open = BinaryHeap::from([(Reverse(0), from)]);
    lengths.insert(from, 0);
    while let Some((Reverse(length_um), id)) = open.pop() {
        if id == to {
            return Some(length_um as f64 * 1e-6);
        }
        let Some(keyframe) = map.keyframe(id).filter(|_| lengths.get(id) == Some(&length_um)) else { continue };
        let covisible = keyframe.covisible.iter().map(|(other, _)| other);
        for &other in covisible.chain(&keyframe.parent).chain(&keyframe.children).chain(&keyframe.loop_edges) {
            let Some(neighbour) = map.keyframe(other) else { continue };
            let motion = neighbour.t_cam_world * keyframe.t_cam_world.inverse();
            // Whole micrometres: integers have a total order without rounding.
            let step_um = ((motion.translation.vector.norm() + motion.rotation.angle()) * 1e6) as u64;
            let length_um = length_um.saturating_add(step_um);
            if lengths.get(other).is_none_or(|known| length_um < *known) {
                lengths.insert(other, length_um);
                open.push((Reverse(length_um), other));
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

    /// Returns a map of keyframes 1 m apart along a line, each of which shares landmarks with the next.
    fn line(metres: usize) -> (Map, Vec<KeyFrameId>) {
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
        for k in 0..=metres {
            let features =
                FrameFeatures::from_parts((0..40).map(feature).collect(), vec![Descriptor([0; 4]); 40], bounds);
            let pose = Pose::translation(-(k as f64), 0.0, 0.0);
            let id = map.insert_keyframe(k as i64, pose, features);
            if let Some(&last) = ids.last() {
                for i in 0..20 {
                    let landmark = map.insert_landmark(Point3::new(k as f64, 0.0, 2.0), last, i, [0; 3], &[1.0]);
                    map.add_observation(landmark.unwrap(), id, 20 + i);
                }
                map.update_covisibility(id);
            }
            ids.push(id);
        }
        (map, ids)
    }

    #[test]
    fn a_drift_is_plausible_on_a_long_path_and_not_on_a_short_one() {
        let (map, ids) = line(20);
        assert!((path_length_m(&map, ids[0], ids[20]).unwrap() - 20.0).abs() < 1e-4);
        let c = LoopConfig::default();
        let is_explained = |end: usize, drift: Pose| is_plausible(&c, &map, ids[0], ids[end], &unscaled(&drift));
        let shift = Pose::translation(0.0, 0.8, 0.0);
        assert!(is_explained(20, shift) && !is_explained(5, shift));
        let turn = Pose::rotation(Vector3::new(0.0, 0.2, 0.0));
        assert!(is_explained(20, turn) && !is_explained(5, turn));
        assert!(!is_explained(20, Pose::rotation(Vector3::new(0.0, std::f64::consts::PI, 0.0))));
        for scale in [1.4, 1.0 / 1.4] {
            let is_explained = |end: usize| is_plausible(&c, &map, ids[0], ids[end], &Similarity::from_scaling(scale));
            assert!(is_explained(20) && !is_explained(5));
        }
    }

    #[test]
    fn there_is_no_path_between_submaps() {
        let (mut map, ids) = line(3);
        let features = crate::features::FrameFeatures::clone(&map.keyframe(ids[0]).unwrap().features);
        let separate = map.insert_keyframe(9, Pose::identity(), features);
        assert_eq!(path_length_m(&map, ids[0], separate), None);
    }
}

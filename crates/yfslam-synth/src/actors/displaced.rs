//! A box that is displaced while it is outside the view of the camera.
//!
//! In: free places of the scene and the whole path of the camera. Out: the place of the box at any time. It changes its place at
//! one moment of the sequence, in the middle of the longest time in which neither the old nor the new place is in view; the choice
//! depends on the path alone, so that a frame still depends on its number only. Without such a moment with views before and after
//! it, the box stays.

use nalgebra::Isometry3;

use super::in_view;
use super::people::upright;
use crate::camera_path::CameraPath;
use crate::config::WorldConfig;
use crate::mesh::Vec3;
use crate::rng::Rng;
use crate::scene::Scene;

/// Size: right, forward, up, m.
pub const BOX_M: [f32; 3] = [0.40, 0.34, 0.46];
/// Distance of the displacement, m.
const MOVED_M: f32 = 0.35;
/// Steps in which the path is searched.
const STEPS: usize = 1000;

/// The places of the box.
#[derive(Clone, Debug)]
pub struct DisplacedBox {
    from: Isometry3<f32>,
    to: Isometry3<f32>,
    /// Time of the displacement, s.
    at: Option<f64>,
}

impl DisplacedBox {
    /// Chooses the place with the longest time out of view.
    pub fn new(scene: &Scene, config: &WorldConfig, path: &CameraPath) -> Self {
        let mut rng = Rng::new(config.seed, 0xd15);
        let seconds = config.frames as f64 / config.camera.fps;
        let steps = config.frames.min(STEPS);
        let times: Vec<f64> = (0..steps).map(|k| k as f64 * seconds / steps as f64).collect();
        let views: Vec<Isometry3<f64>> = times.iter().map(|&t| path.pose(t).inverse()).collect();
        let radius = Vec3::from(BOX_M).norm() / 2.0;
        let mut best: Option<(usize, Self)> = None;
        for place in &scene.stands {
            let at = place.position;
            let away = rng.range(0.0, std::f32::consts::TAU);
            let from = upright([at.x, at.y], at.z, rng.range(-0.6, 0.6));
            let to = upright(
                [at.x + MOVED_M * libm::cosf(away), at.y + MOVED_M * libm::sinf(away)],
                at.z,
                rng.range(-0.6, 0.6),
            );
            let seen = |pose: &Isometry3<f32>, view: &Isometry3<f64>| {
                let middle = pose.translation.vector + Vec3::z() * (BOX_M[2] / 2.0);
                in_view(&config.camera, view, &middle, f64::from(radius))
            };
            let seen: Vec<bool> = views.iter().map(|view| seen(&from, view) || seen(&to, view)).collect();
            let (length, middle) = longest_gap(&seen);
            let found = Self { from, to, at: (length > 0).then(|| times[middle]) };
            if best.as_ref().is_none_or(|(longest, _)| length > *longest) {
                best = Some((length, found));
            }
        }
        best.map_or_else(
            || {
                // A scene without free places keeps the box in the middle of its walk.
                let middle = scene.walk_center.coords.cast::<f32>();
                let pose = upright([middle.x, middle.y], middle.z, 0.0);
                Self { from: pose, to: pose, at: None }
            },
            |(_, found)| found,
        )
    }

    /// Returns the pose at `time` seconds: the middle of its bottom.
    pub fn at(&self, time: f64) -> Isometry3<f32> {
        if self.at.is_some_and(|at| time >= at) { self.to } else { self.from }
    }
}

/// Returns the length and middle of the longest run of `false` that has `true` before and after it and is at least two long.
fn longest_gap(seen: &[bool]) -> (usize, usize) {
    let (mut best, mut start, mut before) = ((0, 0), 0, false);
    for (k, &now) in seen.iter().enumerate() {
        if now {
            if before && k - start > best.0.max(1) {
                best = (k - start, usize::midpoint(start, k));
            }
            (start, before) = (k + 1, true);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_gap_lies_between_two_views() {
        let seen = |text: &str| -> Vec<bool> { text.chars().map(|c| c == '1').collect() };
        assert_eq!(longest_gap(&seen("0000110011000100")), (3, 11));
        assert_eq!(longest_gap(&seen("000011111")), (0, 0), "never seen before");
        assert_eq!(longest_gap(&seen("1111000")), (0, 0), "never seen after");
    }
}

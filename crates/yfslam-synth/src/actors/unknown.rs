//! Objects that no person detector knows and that move without a person: a box, a laptop, a door, a partition wall.
//!
//! In: the kind of object and the first pose of the camera. Out: the pose of the object at any time. It rests before the camera until
//! it has been mapped, moves, rests again and returns; then this repeats.

use nalgebra::Isometry3;

use super::people::{smooth, upright};
use crate::config::UnknownObject;
use crate::mesh::Vec3;

/// A place of the object, and the time at which it is there.
struct Key {
    time_s: f32,
    /// To the right of the first pose of the camera and forward of it, and above the floor, m.
    place: [f32; 3],
    /// Heading: angle about the vertical, rad; 0 turns the front to the camera.
    heading: f32,
}

const fn key(time_s: f32, place: [f32; 3], heading: f32) -> Key {
    Key { time_s, place, heading }
}

/// A small box is carried across the view at chest height, turned, and carried back.
const BOX: &[Key] = &[
    key(3.0, [-0.60, 1.55, 1.00], 0.3),
    key(5.5, [0.60, 1.45, 1.15], -0.5),
    key(7.0, [0.60, 1.45, 1.15], -0.5),
    key(8.5, [0.05, 1.25, 0.95], 0.6),
    key(10.0, [-0.60, 1.55, 1.00], 0.3),
];
/// A large box is pushed in front of the camera, where it covers most of the view and sways, and is taken away again.
const LARGE_BOX: &[Key] = &[
    key(3.0, [-1.15, 2.00, 0.75], 0.2),
    key(5.5, [-0.05, 1.35, 0.95], -0.1),
    key(6.5, [0.08, 1.32, 0.98], 0.1),
    key(7.5, [-0.10, 1.35, 0.94], -0.1),
    key(8.5, [-0.05, 1.35, 0.95], -0.1),
    key(11.0, [-1.15, 2.00, 0.75], 0.2),
    key(12.0, [-1.15, 2.00, 0.75], 0.2),
];
/// An open laptop is handed from the left to the right, close to the camera.
const LAPTOP: &[Key] = &[
    key(2.5, [-0.42, 1.10, 1.12], 0.25),
    key(4.5, [0.40, 1.00, 1.20], -0.3),
    key(6.0, [0.40, 1.00, 1.20], -0.3),
    key(8.0, [-0.42, 1.10, 1.12], 0.25),
];
/// A door opens away from the camera by 80° about its left edge, and is closed again.
const DOOR: &[Key] = &[
    key(3.0, [-0.55, 1.50, 0.02], 0.0),
    key(5.0, [-0.55, 1.50, 0.02], 1.4),
    key(6.5, [-0.55, 1.50, 0.02], 1.4),
    key(8.5, [-0.55, 1.50, 0.02], 0.0),
    key(9.5, [-0.55, 1.50, 0.02], 0.0),
];
/// A partition wall that covers three fifths of the view is rolled to the side and back.
const WALL: &[Key] = &[
    key(3.0, [-0.35, 1.90, 0.60], 0.0),
    key(6.0, [0.55, 1.80, 0.60], 0.1),
    key(7.0, [0.55, 1.80, 0.60], 0.1),
    key(10.0, [-0.35, 1.90, 0.60], 0.0),
];

/// The motion of an object that no detector knows.
#[derive(Clone, Debug)]
pub struct UnknownMotion {
    keys: &'static [Key],
    /// World from the first pose of the camera, levelled and on the floor.
    base: Isometry3<f32>,
    moves: bool,
}

impl std::fmt::Debug for Key {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} s: {:?}", self.time_s, self.place)
    }
}

impl UnknownMotion {
    /// Returns the motion of `object` before the first pose of the camera (world from camera); it rests unless it `moves`.
    pub fn new(object: UnknownObject, camera: &Isometry3<f64>, moves: bool) -> Self {
        let keys = match object {
            UnknownObject::Box => BOX,
            UnknownObject::LargeBox => LARGE_BOX,
            UnknownObject::Laptop => LAPTOP,
            UnknownObject::Door => DOOR,
            UnknownObject::Wall => WALL,
        };
        let forward = (camera.rotation * nalgebra::Vector3::z()).cast::<f32>();
        let at = camera.translation.vector.cast::<f32>();
        Self { keys, base: upright([at.x, at.y], 0.0, libm::atan2f(-forward.x, forward.y)), moves }
    }

    /// Returns the pose at `time` seconds: the middle of its bottom, or the lower end of the hinge of a door.
    pub fn at(&self, time: f64) -> Isometry3<f32> {
        let period = self.keys.last().map_or(1.0, |key| key.time_s);
        let t = if self.moves { (time as f32).rem_euclid(period) } else { 0.0 };
        let next = self.keys.iter().position(|key| t < key.time_s).unwrap_or(0);
        let (from, to) = (&self.keys[next.saturating_sub(1)], &self.keys[next]);
        let s = if next == 0 { 0.0 } else { smooth((t - from.time_s) / (to.time_s - from.time_s)) };
        let mix = |a: f32, b: f32| a + s * (b - a);
        let place = Vec3::from_fn(|axis, _| mix(from.place[axis], to.place[axis]));
        self.base * upright([place.x, place.y], place.z, mix(from.heading, to.heading))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_object_rests_then_moves_and_returns_to_its_first_place() {
        let camera = Isometry3::identity();
        for (name, object) in UnknownObject::ALL {
            let [moving, still] = [true, false].map(|moves| UnknownMotion::new(object, &camera, moves));
            let shift = |motion: &UnknownMotion, time: f64| {
                let [a, b] = [motion.at(0.0), motion.at(time)];
                (a.translation.vector - b.translation.vector).norm() + a.rotation.angle_to(&b.rotation)
            };
            assert_eq!(shift(&moving, 2.0), 0.0, "{name} rests first");
            assert!((0..300).any(|k| shift(&moving, f64::from(k) / 30.0) > 0.8), "{name} moves");
            assert!((0..300).all(|k| shift(&still, f64::from(k) / 30.0) == 0.0), "{name} rests");
            let period = f64::from(moving.keys.last().unwrap().time_s);
            assert!(shift(&moving, period) < 1e-5 && shift(&moving, period - 0.02) < 0.01, "{name} returns");
        }
    }
}

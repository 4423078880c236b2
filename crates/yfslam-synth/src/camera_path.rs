//! Camera paths: key poses joined by minimum-jerk moves after the TUM freiburg3 sequences, or a circuit through the scene; plus
//! hand shake.
//!
//! In: motion, seed and time. Out: the pose of the camera in the world. Moves follow s(τ) = 10τ³ − 15τ⁴ + 6τ⁵ (Flash and Hogan,
//! "The coordination of arm movements", 1985), so that velocity and acceleration are continuous everywhere; the duration of each
//! follows from its length and the mean speed of the recording.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::config::{CameraMotion, WorldConfig};
use crate::rng::Rng;
use crate::scene::Scene;
use crate::tour::{Pace, Tour};

/// Mean speed of walking_xyz: 5.79 m in 28.8 s.
const XYZ_SPEED: f64 = 5.79 / 28.8;
/// Mean speed of walking_halfsphere: 7.69 m in 35.8 s.
const HALFSPHERE_SPEED: f64 = 7.69 / 35.8;
/// Radius of the half sphere, m; "approximately one metre diameter" on the web page of the benchmark.
const HALFSPHERE_RADIUS: f64 = 0.55;
/// Mean turning rate of walking_rpy, rad/s (20.9°/s on the web page of the benchmark).
const RPY_RATE: f64 = 0.365;
/// Distance of the camera in front of the point it is turned about (slightly below it), m: gives rpy its 2.70 m in 30.6 s.
const RPY_LEVER: f64 = 0.353;
/// Amplitude of the hand shake per sine and axis, m and rad; gives walking_static its 0.28 m in 24.8 s.
const SHAKE_M: f64 = 0.000_935;
const SHAKE_RAD: f64 = 0.0008;

/// A wheeled robot: slow, low, and shaken slightly by its wheels.
const DRIVE: Pace = Pace { speed: [0.7, 0.7], turn: 0.6, height: 0.85, tilt: 0.05, rounding: 0.6 };
/// A person who carries the camera around.
pub const WALK: Pace = Pace { speed: [0.4, 1.2], turn: 0.698, height: 1.35, tilt: 0.10, rounding: 0.9 };
/// Length of a loop beyond its start, relative.
const LOOP_OVERLAP: f64 = 0.06;
/// Frequencies (Hz) of hand shake and their weights: slow sway, wrist, and a trace of tremor.
const HAND: [(f64, f64); 3] = [(0.35, 2.2), (1.3, 1.0), (4.1, 0.18)];
/// The same for a robot: body and wheels.
const WHEELS: [(f64, f64); 3] = [(0.8, 0.6), (3.1, 0.3), (6.3, 0.15)];

/// Coordinates of a key pose; their meaning depends on the motion.
type Key = Vector3<f64>;

/// A camera path.
#[derive(Clone, Debug)]
pub struct CameraPath {
    motion: CameraMotion,
    base: Isometry3<f64>,
    /// The circuit, for motions along one.
    tour: Option<Tour>,
    /// Start times of the moves, s; move k leads from key k to key k + 1 (the last back to key 0).
    starts: Vec<f64>,
    keys: Vec<Key>,
    period: f64,
    /// Per axis (three of translation, three of rotation), three sines: amplitude, angular frequency, phase.
    shake: [[[f64; 3]; 3]; 6],
}

impl CameraPath {
    /// Creates the path of `config` in `scene`.
    pub fn new(config: &WorldConfig, scene: &Scene) -> Self {
        let motion = config.motion;
        let mut rng = Rng::new(config.seed, 0xca);
        let keys = keys(motion, &mut rng);
        let seconds = config.frames as f64 / config.camera.fps;
        let (tour, sines) = match motion {
            CameraMotion::Drive => (Some(Tour::new(&scene.circuit, DRIVE, seconds)), WHEELS),
            CameraMotion::Loop => (Some(Tour::new(&scene.circuit, WALK, seconds / (1.0 + LOOP_OVERLAP))), HAND),
            _ => (None, HAND),
        };
        let shake = shake(config.hand_shake, sines, &mut rng);
        let mut path = Self { motion, base: scene.camera, tour, starts: Vec::new(), keys, period: 0.0, shake };
        for k in 0..path.keys.len() {
            path.starts.push(path.period);
            path.period += path.duration(k);
        }
        path
    }

    /// Returns the circuit, if the camera moves along one.
    pub fn tour(&self) -> Option<&Tour> {
        self.tour.as_ref()
    }

    /// Returns the pose (world from camera) at `time` seconds.
    pub fn pose(&self, time: f64) -> Isometry3<f64> {
        let [x, y, z, roll, pitch, yaw] = self.shake.map(|sines| {
            sines.iter().map(|[amplitude, omega, phase]| amplitude * libm::sin(omega * time + phase)).sum::<f64>()
        });
        let shake = Isometry3::new(Vector3::new(x, y, z), Vector3::new(pitch, yaw, roll));
        match &self.tour {
            Some(tour) => tour.pose(time) * shake,
            None => self.base * self.local(&self.coordinates(time)) * shake,
        }
    }

    fn coordinates(&self, time: f64) -> Key {
        if self.period <= 0.0 {
            return Key::zeros();
        }
        let t = time.rem_euclid(self.period);
        let k = self.starts.partition_point(|&start| start <= t).saturating_sub(1);
        let end = self.starts.get(k + 1).copied().unwrap_or(self.period);
        let s = minimum_jerk((t - self.starts[k]) / (end - self.starts[k]));
        self.key(k) * (1.0 - s) + self.key(k + 1) * s
    }

    fn key(&self, k: usize) -> Key {
        self.keys[k % self.keys.len()]
    }

    /// Returns the camera pose relative to the base for the given coordinates; the camera axes are right, down, forward.
    fn local(&self, c: &Key) -> Isometry3<f64> {
        match self.motion {
            CameraMotion::Static | CameraMotion::Drive | CameraMotion::Loop => Isometry3::identity(),
            CameraMotion::Xyz => Isometry3::translation(c.x, c.y, c.z),
            CameraMotion::Rpy => {
                let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), c.z)
                    * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), c.y)
                    * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), c.x);
                around(Vector3::new(0.0, 0.3 * RPY_LEVER, -RPY_LEVER), turn)
            }
            CameraMotion::Halfsphere => {
                let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), c.x)
                    * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), c.y);
                around(Vector3::new(0.0, 0.0, HALFSPHERE_RADIUS), turn)
            }
        }
    }

    /// Returns the duration of move k, s.
    fn duration(&self, k: usize) -> f64 {
        let (from, to) = (self.key(k), self.key(k + 1));
        let steps = 32;
        let poses: Vec<Isometry3<f64>> =
            (0..=steps).map(|i| self.local(&from.lerp(&to, f64::from(i) / f64::from(steps)))).collect();
        let sum = |f: &dyn Fn(&Isometry3<f64>, &Isometry3<f64>) -> f64| -> f64 {
            poses.windows(2).map(|pair| f(&pair[0], &pair[1])).sum()
        };
        let length = sum(&|a, b| (a.translation.vector - b.translation.vector).norm());
        match self.motion {
            CameraMotion::Static | CameraMotion::Drive | CameraMotion::Loop => 0.0,
            CameraMotion::Xyz => length / XYZ_SPEED,
            CameraMotion::Rpy => sum(&|a, b| a.rotation.angle_to(&b.rotation)) / RPY_RATE,
            CameraMotion::Halfsphere => length / HALFSPHERE_SPEED,
        }
    }
}

/// Returns the rotation by `turn` about the point `pivot`.
fn around(pivot: Vector3<f64>, turn: UnitQuaternion<f64>) -> Isometry3<f64> {
    Translation3::from(pivot) * turn * Translation3::from(-pivot)
}

fn minimum_jerk(t: f64) -> f64 {
    t * t * t * (10.0 - 15.0 * t + 6.0 * t * t)
}

/// Returns the key poses of one round, with a little variation by the seed; three rounds differ, then the path repeats.
fn keys(motion: CameraMotion, rng: &mut Rng) -> Vec<Key> {
    let mut keys = Vec::new();
    for _ in 0..3 {
        let mut near = |x: f64| x * rng.range64(0.85, 1.15);
        match motion {
            CameraMotion::Static | CameraMotion::Drive | CameraMotion::Loop => {}
            CameraMotion::Xyz => {
                // Two strokes along each axis: right and left, down and up, forward and back.
                for (axis, reach) in [(0, 0.38), (1, 0.24), (2, 0.30)] {
                    for side in [1.0, -1.0, 1.0, -1.0] {
                        let mut key = Key::zeros();
                        key[axis] = near(side * reach);
                        keys.push(key);
                    }
                    keys.push(Key::zeros());
                }
            }
            CameraMotion::Rpy => {
                for (axis, reach) in [(0, 0.42), (1, 0.30), (2, 0.40)] {
                    for side in [1.0, -1.0, 1.0, -1.0] {
                        let mut key = Key::zeros();
                        key[axis] = near(side * reach);
                        keys.push(key);
                    }
                    keys.push(Key::zeros());
                }
            }
            CameraMotion::Halfsphere => {
                // Azimuth to the right, elevation up (a negative rotation about the x axis of the camera).
                for (azimuth, elevation) in
                    [(0.7, 0.0), (0.5, -0.3), (0.0, -0.5), (-0.5, -0.3), (-0.75, 0.05), (-0.3, 0.2), (0.1, -0.2)]
                {
                    keys.push(Key::new(near(azimuth), near(elevation), 0.0));
                }
                keys.push(Key::zeros());
            }
        }
    }
    keys
}

fn shake(strength: f64, sines: [(f64, f64); 3], rng: &mut Rng) -> [[[f64; 3]; 3]; 6] {
    std::array::from_fn(|axis| {
        let amplitude = strength * if axis < 3 { SHAKE_M } else { SHAKE_RAD };
        // Incommensurate by their random part.
        sines.map(|(hertz, weight)| {
            // A faster sine is smaller, so that the path length does not depend on the draw.
            let detune = rng.range64(0.85, 1.15);
            let omega = std::f64::consts::TAU * hertz * detune;
            [amplitude * weight / detune, omega, rng.range64(0.0, std::f64::consts::TAU)]
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::look_at::look_at;
    use nalgebra::Point3;

    fn path(motion: CameraMotion, seed: u64) -> CameraPath {
        let config = WorldConfig { motion, seed, ..WorldConfig::default() };
        CameraPath::new(&config, &Scene::new(config.scene, seed))
    }

    fn length(path: &CameraPath, seconds: f64) -> f64 {
        let poses: Vec<_> = (0..(seconds * 30.0) as usize).map(|i| path.pose(i as f64 / 30.0)).collect();
        poses.windows(2).map(|p| (p[0].translation.vector - p[1].translation.vector).norm()).sum()
    }

    #[test]
    fn path_lengths_are_those_of_the_recordings_within_four_percent() {
        for seed in 0..5 {
            for (motion, seconds, metres) in [
                (CameraMotion::Static, 24.8, 0.28),
                (CameraMotion::Xyz, 28.8, 5.79),
                (CameraMotion::Rpy, 30.6, 2.70),
                (CameraMotion::Halfsphere, 35.8, 7.69),
            ] {
                let got = length(&path(motion, seed), seconds);
                assert!((got / metres - 1.0).abs() < 0.04, "{motion:?} seed {seed}: {got} m instead of {metres} m");
            }
        }
    }

    #[test]
    fn acceleration_never_jumps() {
        for (_, motion) in CameraMotion::ALL {
            let path = path(motion, 1);
            let h = 1e-3;
            let acceleration = |t: f64| {
                let p = |t| path.pose(t).translation.vector;
                (p(t + h) - 2.0 * p(t) + p(t - h)) / (h * h)
            };
            let jumps = (1..30_000).map(|i| {
                let t = f64::from(i) * h;
                (acceleration(t + h) - acceleration(t)).norm()
            });
            let largest = jumps.fold(0.0, f64::max);
            // A step in acceleration would exceed this at any time step; jerk times one millisecond is the largest regular change.
            assert!(largest < 0.05, "{motion:?}: acceleration jumps by {largest} m/s²");
        }
    }

    #[test]
    fn a_camera_looks_along_its_z_axis_with_y_down() {
        let pose = look_at(Point3::new(0.0, -2.0, 1.0), Point3::new(0.0, 3.0, 1.0));
        assert!((pose * Vector3::z() - Vector3::y()).norm() < 1e-12);
        assert!((pose * Vector3::y() + Vector3::z()).norm() < 1e-12);
    }
}

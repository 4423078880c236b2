//! Configuration of a synthetic sequence. Every key has a default; unknown keys are refused.

mod choices;
mod error;
mod light;
mod sensor;
mod validate;

use serde::{Deserialize, Serialize};
use yfslam::Camera;

pub use choices::{Activity, CameraMotion, CarriedObject, SceneKind, UnknownObject};
pub use error::WorldError;
pub use light::LightConfig;
pub use sensor::SensorConfig;

/// Greatest number of people and robots together.
pub const MAX_PEOPLE: usize = 6;

/// A synthetic sequence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WorldConfig {
    /// The scene.
    pub scene: SceneKind,
    /// Motion of the camera.
    pub motion: CameraMotion,
    /// Activity of the people.
    pub activity: Activity,
    /// Number of people, 0 to 6.
    pub people: usize,
    /// Moving objects other than people. Each is an actor with a number of its own; see [`CLASS_NAMES`](crate::CLASS_NAMES).
    pub actors: ActorsConfig,
    /// Mean share of the image that walking people and driving robots cover, 0 to 0.8. To reach it they walk past the camera more
    /// slowly and closer and, for a large share, stop before it; [`World::person_share`](crate::World::person_share) returns the
    /// share that was reached.
    pub person_share: f64,
    /// Number of frames.
    pub frames: usize,
    /// Seed of textures, people, paths and noise.
    pub seed: u64,
    /// Camera, including its lens distortion. Its `fps` is the frame rate, its `bf` the baseline of the depth sensor.
    pub camera: Camera,
    /// Depth units per metre.
    pub depth_factor: f64,
    /// Distance of a second camera to the right of the first, m; 0 for none. A stereo camera has no depth image and no lens
    /// distortion, and `camera.bf` is this distance times `camera.fx`.
    pub stereo_m: f64,
    /// Strength of the hand shake; 1 has the path length of `walking_static`, 0 none.
    pub hand_shake: f64,
    /// Light.
    pub light: LightConfig,
    /// Errors of the sensor.
    pub sensor: SensorConfig,
    /// Whether frames have the exact boxes of visible people as detections.
    pub detections: bool,
    /// Least number of visible pixels for a box at 640 × 480; it scales with the image area.
    pub min_person_px: usize,
    /// Whether object edges are anti-aliased with four samples per edge pixel.
    pub antialias: bool,
}

impl Default for WorldConfig {
    fn default() -> Self {
        Self {
            scene: SceneKind::Office,
            motion: CameraMotion::Xyz,
            activity: Activity::Walking,
            people: 2,
            actors: ActorsConfig::default(),
            person_share: 0.2,
            frames: 300,
            seed: 1,
            camera: default_camera(),
            depth_factor: 5000.0,
            stereo_m: 0.0,
            hand_shake: 1.0,
            light: LightConfig::default(),
            sensor: SensorConfig::default(),
            detections: false,
            min_person_px: 400,
            antialias: true,
        }
    }
}

/// Moving objects other than people. Each is an actor with a number of its own; see [`CLASS_NAMES`](crate::CLASS_NAMES).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ActorsConfig {
    /// Number of rescue robots that drive among the people; at most 6 together with the people.
    pub robots: usize,
    /// Whether the first walking person who carries nothing pushes a chair.
    pub pushed_chair: bool,
    /// Whether the first walking person carries an object, puts it down, leaves it there and fetches it again.
    pub carried_box: bool,
    /// The carried object; `box` unless `carried_box` is on.
    pub carried_object: CarriedObject,
    /// Whether a box is displaced while it and its new place are outside the view of the camera. If that never happens within the
    /// sequence, it stays where it is.
    pub moved_object: bool,
    /// An object that no person detector knows and that moves without a person; `None` for none.
    pub unknown: Option<UnknownObject>,
    /// Whether that object moves; else it stays at its first place, which is the reference for a comparison.
    pub unknown_moves: bool,
}

impl Default for ActorsConfig {
    fn default() -> Self {
        Self {
            robots: 0,
            pushed_chair: false,
            carried_box: false,
            carried_object: CarriedObject::Box,
            moved_object: false,
            unknown: None,
            unknown_moves: true,
        }
    }
}

/// Returns the calibration of freiburg3 from the web page of the TUM benchmark, which has no distortion.
pub fn default_camera() -> Camera {
    Camera::pinhole(640, 480, 535.4, 539.2, 320.1, 247.6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_the_same_after_toml_and_unknown_keys_are_refused() {
        let text = toml::to_string(&WorldConfig::default()).unwrap();
        assert_eq!(toml::from_str::<WorldConfig>(&text).unwrap(), WorldConfig::default());
        let error = toml::from_str::<WorldConfig>("poeple = 3").unwrap_err().to_string();
        assert!(error.contains("poeple"), "{error}");
    }

    #[test]
    fn a_bad_value_is_named_with_its_range() {
        let error = WorldConfig { people: 7, ..Default::default() }.validate().unwrap_err().to_string();
        assert_eq!(error, "the synthetic world's `people` is 7; it must be between 0 and 6");
    }
}

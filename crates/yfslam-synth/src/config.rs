//! What a synthetic sequence is made of. Everything has a default; unknown keys are refused.

use serde::{Deserialize, Serialize};
use yfslam::Camera;

/// How the camera is moved, after the freiburg3 sequences of the TUM RGB-D benchmark (Sturm et al., IROS 2012).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CameraMotion {
    /// Held still by hand: 0.28 m in 24.8 s, all of it hand shake.
    Static,
    /// Along the three axes in turn, orientation kept: 5.79 m in 28.8 s.
    Xyz,
    /// Turned about roll, pitch and yaw: 2.70 m in 30.6 s, 21°/s.
    Rpy,
    /// On a half sphere, looking at its centre: 7.69 m in 35.8 s.
    Halfsphere,
    /// On a wheeled robot, forwards along the scene's round at up to 0.7 m/s, with a little vibration.
    Drive,
    /// Carried once around the scene's round and 6 % past its start, as fast as the number of frames asks for but between
    /// 0.4 and 1.2 m/s and at most 40°/s. At the fastest the corridor takes 1241 frames at 30 Hz, 1320 with the overlap;
    /// fewer frames show a part of it.
    Loop,
}

impl CameraMotion {
    /// All motions with their names in specs.
    pub const ALL: [(&str, Self); 6] = [
        ("static", Self::Static),
        ("xyz", Self::Xyz),
        ("rpy", Self::Rpy),
        ("halfsphere", Self::Halfsphere),
        ("drive", Self::Drive),
        ("loop", Self::Loop),
    ];
}

/// What the people do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Activity {
    /// They walk around the desk, all the same way and two abreast, stop, turn and walk on. Where a camera on a tour leaves no room
    /// for that (the corridor), they walk the tour: every second one ahead of the camera, the others towards it and past it.
    Walking,
    /// They sit (or stand, once the chairs are taken) and gesture a little.
    Sitting,
    /// One sits, one sits down and gets up again and again, all others walk.
    Crowd,
}

impl Activity {
    /// All activities with their names in specs.
    pub const ALL: [(&str, Self); 3] = [("sitting", Self::Sitting), ("walking", Self::Walking), ("crowd", Self::Crowd)];
}

/// Where it happens.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SceneKind {
    /// An office of 6.4 m × 6 m with a desk in the middle.
    #[default]
    Office,
    /// A damaged hall of 14 m × 12 m: rubble, pillars, crates and barrels, little texture, few lamps.
    Rescue,
    /// Four corridors around a block, 45.6 m along the middle: doors, signs, notice boards, radiators and plants.
    Corridor,
    /// An empty laboratory of 6 m × 5.4 m with white walls: sockets, a cable duct, a whiteboard and floor seams.
    Lab,
}

impl SceneKind {
    /// All scenes with their names in specs.
    pub const ALL: [(&str, Self); 4] =
        [("office", Self::Office), ("rescue", Self::Rescue), ("corridor", Self::Corridor), ("lab", Self::Lab)];
}

/// What someone carries, puts down and fetches again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CarriedObject {
    /// A cardboard box of 36 cm × 26 cm × 24 cm.
    #[default]
    Box,
    /// An open laptop, 34 cm wide, switched off: its screen is too dark for the depth sensor from some distance on.
    Laptop,
}

impl CarriedObject {
    /// All objects with their names in specs.
    pub const ALL: [(&str, Self); 2] = [("box", Self::Box), ("laptop", Self::Laptop)];
}

/// A synthetic sequence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WorldConfig {
    /// Where it happens.
    pub scene: SceneKind,
    /// How the camera moves.
    pub motion: CameraMotion,
    /// What the people do.
    pub activity: Activity,
    /// Number of people, 0 to 6.
    pub people: usize,
    /// What moves besides people.
    pub actors: ActorsConfig,
    /// Mean share of the picture that all who walk or drive cover, 0 to 0.8. They stroll more slowly past the camera and nearer
    /// to it, and for a large share stop before it, to meet it as well as they can; [`World::person_share`](crate::World::person_share) tells what was reached.
    pub person_share: f64,
    /// Number of frames.
    pub frames: usize,
    /// Seed of textures, people, paths and noise.
    pub seed: u64,
    /// The camera that is rendered, lens distortion included. Its `fps` is the frame rate, its `depth_factor` the unit
    /// of depth, its `bf` the baseline of the depth sensor.
    pub camera: Camera,
    /// Distance of a second camera to the right of the first, m; 0 for none. A stereo camera has no depth image, no lens distortion,
    /// and `camera.bf` is this times `camera.fx`.
    pub stereo_m: f64,
    /// Strength of the hand shake; 1 has the path length of `walking_static`, 0 none.
    pub hand_shake: f64,
    /// Light and its quality.
    pub light: LightConfig,
    /// What the sensor adds to the exact picture.
    pub sensor: SensorConfig,
    /// Whether frames carry the exact boxes of visible people as detections.
    pub detections: bool,
    /// Least number of visible pixels for a box, at 640 × 480; scales with the image area.
    pub min_person_px: usize,
    /// Whether object edges are smoothed (four samples per edge pixel).
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

/// What moves besides people. Each is an actor with a number of its own; see [`CLASS_NAMES`](crate::CLASS_NAMES).
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ActorsConfig {
    /// Number of rescue robots that drive around among the people; with them at most 6.
    pub robots: usize,
    /// Whether a walking person pushes a chair around: the first one who carries nothing.
    pub pushed_chair: bool,
    /// Whether the first walking person carries something, puts it down, leaves it there and fetches it again.
    pub carried_box: bool,
    /// What that is; a box unless `carried_box` is on.
    pub carried_object: CarriedObject,
    /// Whether a box is displaced while it and its new place are out of the camera's view. If that never happens within
    /// the sequence, it stays where it is.
    pub moved_object: bool,
}

/// The calibration of freiburg3 as the TUM benchmark's web page gives it: no distortion.
pub fn default_camera() -> Camera {
    Camera {
        width: 640,
        height: 480,
        fx: 535.4,
        fy: 539.2,
        cx: 320.1,
        cy: 247.6,
        distortion: [0.0; 5],
        depth_factor: 5000.0,
        fps: 30.0,
        bf: 40.0,
    }
}

/// Light and its quality.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LightConfig {
    /// Shadow rays per lamp and light-map texel, twice as many for ambient light; 0 lights without shadows.
    pub shadow_rays: usize,
    /// Whether moving people darken the floor and furniture around them.
    pub moving_shadows: bool,
    /// Brightness of the picture; 1 suits every scene, 0.2 is dark.
    pub exposure: f32,
    /// How much the lamps that are not steady change: slowly all the time and at times suddenly; 0 not at all, 1 down to
    /// darkness. In the office all but the window, in the others half of the lamps.
    pub flicker: f32,
}

impl Default for LightConfig {
    fn default() -> Self {
        Self { shadow_rays: 8, moving_shadows: true, exposure: 1.0, flicker: 0.0 }
    }
}

/// What the sensor adds to the exact picture. Each part has its own switch: a zero (or `false`) turns it off.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensorConfig {
    /// Standard deviation of colour noise, grey levels of 255.
    pub color_noise: f32,
    /// Depth noise independent of distance, m: the first term of σ_z = a + b (z − 0.4 m)² (Nguyen, Izadi and Lovell,
    /// "Modeling Kinect sensor noise for improved 3D reconstruction and tracking", 3DIMPVT 2012, eq. 3: a = 0.0012 m).
    pub depth_noise_m: f32,
    /// Depth noise that grows with distance, 1/m: the second term there (b = 0.0019 /m).
    pub depth_noise_growth: f32,
    /// Depth noise at steep angles θ of the surface, m^1.5: the factor of θ² / (π/2 − θ)² / √z, which is added above 60° (same paper,
    /// eq. 3: 0.0001). The paper itself was not at hand for this term: formula and factor agree with open implementations that cite
    /// it, and that the two terms above hold alone between 10° and 60° with what others say of it.
    pub depth_noise_angle: f32,
    /// Step of the disparity in px of a structured-light sensor (1/8 for the Kinect: Khoshelham and Elberink,
    /// Sensors 2012, section 3); the depth step is z² · step / bf.
    pub disparity_step_px: f32,
    /// Whether places that the projector cannot see, and depth edges, have no depth.
    pub holes: bool,
    /// Angle between the surface's normal and the ray beyond which there is no depth, degrees; 90 measures at any angle. The
    /// default is a choice of ours, from no measurement: little of the projected light comes back from steeper surfaces.
    pub max_angle_deg: f32,
    /// Least light that comes back, as reflectance · cos θ / z², 1/m²; darker places have no depth; 0 measures them all. The default
    /// loses black cloth and screens (reflectance 0.04) beyond 2.8 m and keeps grey walls over the whole range.
    pub min_return: f32,
    /// Time between the colour image and the depth image that goes with it, s: depth shows the world this much later. 0 is a sensor
    /// that synchronises both, as PrimeSense ones can; freely running ones are up to half a frame apart.
    pub depth_offset_s: f64,
    /// How long the colour camera's shutter is open, s: what moves is smeared; 0 freezes it. 10 ms is the shortest time that does not
    /// flicker in light of 50 Hz mains.
    pub exposure_s: f64,
    /// Share of a change of brightness that automatic exposure makes up for, 0 to 1; 0 keeps the gain. PrimeSense cameras adapt.
    pub auto_exposure: f32,
    /// Nearest depth that is measured, m.
    pub min_depth_m: f32,
    /// Farthest depth that is measured, m.
    pub max_depth_m: f32,
}

impl Default for SensorConfig {
    fn default() -> Self {
        Self {
            color_noise: 1.5,
            depth_noise_m: 0.0012,
            depth_noise_growth: 0.0019,
            depth_noise_angle: 0.0001,
            disparity_step_px: 0.125,
            holes: true,
            max_angle_deg: 80.0,
            min_return: 0.005,
            depth_offset_s: 0.0,
            exposure_s: 0.010,
            auto_exposure: 0.8,
            min_depth_m: 0.4,
            max_depth_m: 5.0,
        }
    }
}

impl SensorConfig {
    /// The perfect sensor: no noise, no blur, no holes, depth of everything, rounded to the camera's unit only.
    pub fn perfect() -> Self {
        Self {
            color_noise: 0.0,
            depth_noise_m: 0.0,
            depth_noise_growth: 0.0,
            depth_noise_angle: 0.0,
            disparity_step_px: 0.0,
            holes: false,
            max_angle_deg: 90.0,
            min_return: 0.0,
            depth_offset_s: 0.0,
            exposure_s: 0.0,
            auto_exposure: 0.0,
            min_depth_m: 0.0,
            max_depth_m: f32::INFINITY,
        }
    }
}

/// Why a world cannot be made.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum WorldError {
    /// A value outside its range.
    #[error("the synthetic world's `{name}` is {value}; it must be {range}")]
    OutOfRange {
        /// Name of the field.
        name: &'static str,
        /// The value found.
        value: String,
        /// What is allowed.
        range: &'static str,
    },
    /// A spec that cannot be read.
    #[error("`{spec}` does not name a synthetic world: {reason}")]
    Spec {
        /// The text that was given.
        spec: String,
        /// What is wrong and what would be right.
        reason: String,
    },
}

/// Greatest number of people and robots together.
pub const MAX_PEOPLE: usize = 6;

impl WorldConfig {
    /// Refuses values that no world can be made of.
    pub(crate) fn validate(&self) -> Result<(), WorldError> {
        let camera = &self.camera;
        let size = 16..=4096;
        let finite = |values: &[f64]| values.iter().all(|v| v.is_finite());
        check(self.people <= MAX_PEOPLE, "people", self.people, "between 0 and 6")?;
        let (robots, actors) = (self.actors.robots, &self.actors);
        check(self.people + robots <= MAX_PEOPLE, "actors.robots", robots, "at most 6 together with the people")?;
        let movers = usize::from(actors.pushed_chair) + usize::from(actors.carried_box);
        let free = if self.activity == Activity::Walking { self.people } else { 0 };
        check(
            movers <= free,
            "people",
            self.people,
            "at least as many as push a chair or carry a box, and they must walk (activity `walking`)",
        )?;
        let nobody_carries = !actors.carried_box && actors.carried_object != CarriedObject::Box;
        check(!nobody_carries, "actors.carried_object", "not a box", "left out unless `carried_box` is on")?;
        check((0.0..=0.8).contains(&self.person_share), "person_share", self.person_share, "between 0 and 0.8")?;
        check((1..=1_000_000).contains(&self.frames), "frames", self.frames, "between 1 and 1000000")?;
        check(size.contains(&camera.width), "camera.width", camera.width, "between 16 and 4096 px")?;
        check(size.contains(&camera.height), "camera.height", camera.height, "between 16 and 4096 px")?;
        check(camera.fx.is_finite() && camera.fx > 1.0, "camera.fx", camera.fx, "greater than 1 px")?;
        check(camera.fy.is_finite() && camera.fy > 1.0, "camera.fy", camera.fy, "greater than 1 px")?;
        check(finite(&[camera.cx, camera.cy]), "camera.cx, camera.cy", camera.cx, "finite")?;
        check(finite(&camera.distortion), "camera.distortion", format!("{:?}", camera.distortion), "finite")?;
        check((1e-3..=1e3).contains(&camera.fps), "camera.fps", camera.fps, "between 0.001 and 1000 Hz")?;
        let factor = camera.depth_factor;
        check((1.0..=1e6).contains(&factor), "camera.depth_factor", factor, "between 1 and 1000000 units per metre")?;
        check(camera.bf.is_finite() && camera.bf >= 0.0, "camera.bf", camera.bf, "at least 0 px·m")?;
        check((0.0..=2.0).contains(&self.stereo_m), "stereo_m", self.stereo_m, "between 0 and 2 m")?;
        if self.stereo_m > 0.0 {
            let distortion = camera.distortion;
            check(
                distortion == [0.0; 5],
                "camera.distortion",
                format!("{distortion:?}"),
                "zero for a stereo camera, whose pictures are rectified (such as --camera tum3)",
            )?;
            let same = (camera.bf / (self.stereo_m * camera.fx) - 1.0).abs() < 1e-6;
            check(same, "camera.bf", camera.bf, "stereo_m times camera.fx")?;
        }
        check((0.0..=20.0).contains(&self.hand_shake), "hand_shake", self.hand_shake, "between 0 and 20")?;
        let light = &self.light;
        check(light.shadow_rays <= 1024, "light.shadow_rays", light.shadow_rays, "at most 1024")?;
        check((0.0..=100.0).contains(&light.exposure), "light.exposure", light.exposure, "between 0 and 100")?;
        check((0.0..=1.0).contains(&light.flicker), "light.flicker", light.flicker, "between 0 and 1")?;
        let s = &self.sensor;
        for (name, value) in [
            ("sensor.color_noise", s.color_noise),
            ("sensor.depth_noise_m", s.depth_noise_m),
            ("sensor.depth_noise_growth", s.depth_noise_growth),
            ("sensor.depth_noise_angle", s.depth_noise_angle),
            ("sensor.disparity_step_px", s.disparity_step_px),
            ("sensor.min_return", s.min_return),
        ] {
            check((0.0..=100.0).contains(&value), name, value, "between 0 and 100")?;
        }
        check((0.0..=90.0).contains(&s.max_angle_deg), "sensor.max_angle_deg", s.max_angle_deg, "between 0 and 90")?;
        let (offset, exposure) = (s.depth_offset_s, s.exposure_s);
        check((-1.0..=1.0).contains(&offset), "sensor.depth_offset_s", offset, "between -1 and 1 s")?;
        check((0.0..=1.0).contains(&exposure), "sensor.exposure_s", exposure, "between 0 and 1 s")?;
        check((0.0..=1.0).contains(&s.auto_exposure), "sensor.auto_exposure", s.auto_exposure, "between 0 and 1")?;
        check(s.min_depth_m >= 0.0, "sensor.min_depth_m", s.min_depth_m, "at least 0 m")?;
        check(s.max_depth_m > s.min_depth_m, "sensor.max_depth_m", s.max_depth_m, "greater than sensor.min_depth_m")
    }
}

fn check(good: bool, name: &'static str, value: impl ToString, range: &'static str) -> Result<(), WorldError> {
    if good { Ok(()) } else { Err(WorldError::OutOfRange { name, value: value.to_string(), range }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_survives_a_round_trip_through_toml_and_unknown_keys_are_refused() {
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

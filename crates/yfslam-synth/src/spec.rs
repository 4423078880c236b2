//! Descriptions of worlds in one line of text, such as `synth:walking_xyz?seed=7&people=2&frames=300`.
//!
//! In: the text. Out: a [`WorldConfig`], or an error that lists the valid names.

use yfslam::Camera;

use crate::config::{
    Activity, CameraMotion, CarriedObject, SceneKind, SensorConfig, UnknownObject, WorldConfig, WorldError,
    default_camera,
};
use crate::suite::{DEFAULT_NAME, find, names};

/// Keys of a description and their values.
const KEYS: &[(&str, &str)] = &[
    ("scene", "office, rescue, corridor or lab"),
    ("motion", "static, xyz, rpy, halfsphere, drive or loop"),
    ("seed", "integer"),
    ("people", "0 to 6"),
    ("activity", "sitting, walking or crowd"),
    ("robots", "0 to 6, with the people at most 6"),
    ("chair", "on or off: a person pushes a chair"),
    ("carry", "on or off: a person carries an object, puts it down and fetches it"),
    ("object", "box or laptop: the carried object"),
    ("moved", "on or off: a box is displaced while out of view"),
    ("unknown", "box, large_box, laptop, door or wall: an object that no detector knows moves without a person"),
    ("unknown_moves", "on or off: off leaves that object at its first place"),
    ("frames", "number of frames"),
    ("share", "share of the view that people cover, 0 to 0.8"),
    ("width", "px"),
    ("height", "px"),
    ("fps", "frames per second"),
    ("stereo", "m from the left to a right camera, such as 0.11, instead of depth; 0 is none"),
    ("shake", "hand shake, 1 is natural"),
    ("noise", "on or off: off is the perfect sensor, without any of the effects below"),
    ("blur", "exposure time in ms; 0 is off"),
    ("autoexposure", "on or off"),
    ("offset_ms", "ms from the colour image to its depth image, such as 12; 0 is off"),
    (
        "readout",
        "ms from the first to the last row of an image, -100 to 100; negative reads the bottom row first, 0 all rows at once",
    ),
    ("depth_readout", "the same for the depth image; as for the colour image unless given"),
    ("unknown_readout", "on or off: on leaves the readout out of the calibration of the camera"),
    ("holes", "on or off: pixels without depth at edges, on grazing and on dark surfaces"),
    ("boxes", "on or off: exact person boxes as detections"),
    ("shadows", "on or off"),
    ("exposure", "brightness of the image, 1 is normal"),
    ("flicker", "changing light, 0 to 1"),
];

/// Returns whether `text` describes a synthetic world, that is, starts with `synth:`.
pub fn is_spec(text: &str) -> bool {
    text.starts_with("synth:")
}

/// Splits a description into the name and the text after the question mark.
pub fn split(spec: &str) -> (&str, &str) {
    let text = spec.strip_prefix("synth:").unwrap_or(spec);
    let (name, query) = text.split_once('?').unwrap_or((text, ""));
    (if name.is_empty() { DEFAULT_NAME } else { name }, query)
}

/// Parses a description; the prefix `synth:` is optional, and an empty name means `walking_xyz`.
///
/// # Errors
/// The name or a key is unknown, or a value is malformed or out of range. The message lists the valid names.
pub fn parse(spec: &str) -> Result<WorldConfig, WorldError> {
    parse_with_camera(spec, default_camera(), WorldConfig::default().depth_factor)
}

/// Parses a description for another camera than the default and its depth units per metre; its `width`, `height` and `fps` change
/// that camera, and so does `readout`. The calibration has the readout if the description or the camera mentions it, unless the
/// description has `unknown_readout=on`.
///
/// # Errors
/// As for [`parse`], also if `camera` cannot be rendered.
pub fn parse_with_camera(spec: &str, camera: Camera, depth_factor: f64) -> Result<WorldConfig, WorldError> {
    let fail = |reason: String| WorldError::Spec { spec: spec.to_owned(), reason };
    let (name, query) = split(spec);
    let mut config = WorldConfig { camera, depth_factor, ..WorldConfig::default() };
    config.sensor.readout_ms = config.camera.readout_ms.unwrap_or_default();
    config.sensor.depth_readout_ms = config.camera.depth_readout_ms;
    let world =
        find(name).ok_or_else(|| fail(format!("unknown world `{name}`; the worlds are {}", names().join(", "))))?;
    world.apply(&mut config);
    let mut tells_readout = true;
    for pair in query.split('&').filter(|pair| !pair.is_empty()) {
        let (key, value) =
            pair.split_once('=').ok_or_else(|| fail(format!("`{pair}` is not of the form key=value")))?;
        if key == "unknown_readout" {
            tells_readout = !switch(key, value).map_err(fail)?;
        } else {
            set(&mut config, key, value).map_err(fail)?;
        }
    }
    if config.stereo_m > 0.0 {
        config.camera.bf = config.stereo_m * config.camera.fx;
    }
    calibrate_readout(&mut config, tells_readout);
    config.validate().map_err(|error| fail(error.to_string()))?;
    Ok(config)
}

/// Writes the readout of the sensor into the calibration of the camera, or removes it there. A camera whose shutter nobody has
/// mentioned stays without, as most calibrations are. The stamp of the depth image contains its whole offset; no delay remains.
fn calibrate_readout(config: &mut WorldConfig, tells: bool) {
    let sensor = &config.sensor;
    let tells = tells && config.camera.readout_ms.is_some();
    let has_depth = tells && config.stereo_m == 0.0;
    config.camera.readout_ms = tells.then_some(sensor.readout_ms);
    config.camera.depth_readout_ms = has_depth.then_some(sensor.depth_readout());
    config.camera.depth_delay_ms = has_depth.then_some(0.0);
}

fn set(config: &mut WorldConfig, key: &str, value: &str) -> Result<(), String> {
    let camera = &mut config.camera;
    match key {
        "scene" => config.scene = one_of(key, value, &SceneKind::ALL)?,
        "motion" => config.motion = one_of(key, value, &CameraMotion::ALL)?,
        "activity" => config.activity = one_of(key, value, &Activity::ALL)?,
        "seed" => config.seed = number(key, value)?,
        "people" => config.people = number(key, value)?,
        "robots" => config.actors.robots = number(key, value)?,
        "chair" => config.actors.pushed_chair = switch(key, value)?,
        "carry" => config.actors.carried_box = switch(key, value)?,
        "object" => config.actors.carried_object = one_of(key, value, &CarriedObject::ALL)?,
        "moved" => config.actors.moved_object = switch(key, value)?,
        "unknown" => config.actors.unknown = Some(one_of(key, value, &UnknownObject::ALL)?),
        "unknown_moves" => config.actors.unknown_moves = switch(key, value)?,
        "frames" => config.frames = number(key, value)?,
        "share" => config.person_share = number(key, value)?,
        // The view stays the same when the size changes: the intrinsics scale about the corner of the pixel grid.
        "width" => {
            let width = number(key, value)?;
            let scale = width as f64 / camera.width as f64;
            (camera.fx, camera.cx) = (camera.fx * scale, (camera.cx + 0.5) * scale - 0.5);
            camera.bf *= scale;
            camera.width = width;
        }
        "height" => {
            let height = number(key, value)?;
            let scale = height as f64 / camera.height as f64;
            (camera.fy, camera.cy) = (camera.fy * scale, (camera.cy + 0.5) * scale - 0.5);
            camera.height = height;
        }
        "fps" => camera.fps = number(key, value)?,
        "stereo" => config.stereo_m = number(key, value)?,
        "shake" => config.hand_shake = number(key, value)?,
        "noise" => {
            if !switch(key, value)? {
                config.sensor = SensorConfig::perfect();
            }
        }
        "blur" => config.sensor.exposure_s = 1e-3 * number::<f64>(key, value)?,
        "offset_ms" => config.sensor.depth_offset_s = 1e-3 * number::<f64>(key, value)?,
        "readout" => {
            config.sensor.readout_ms = number(key, value)?;
            camera.readout_ms = Some(config.sensor.readout_ms);
        }
        "depth_readout" => {
            config.sensor.depth_readout_ms = Some(number(key, value)?);
            camera.readout_ms = Some(config.sensor.readout_ms);
        }
        "autoexposure" => {
            let adapts = switch(key, value)?;
            config.sensor.auto_exposure = if adapts { SensorConfig::default().auto_exposure } else { 0.0 };
        }
        "holes" => {
            let from = if switch(key, value)? { SensorConfig::default() } else { SensorConfig::perfect() };
            let sensor = &mut config.sensor;
            (sensor.holes, sensor.max_angle_deg, sensor.min_return) = (from.holes, from.max_angle_deg, from.min_return);
        }
        "boxes" => config.detections = switch(key, value)?,
        "shadows" => config.light.moving_shadows = switch(key, value)?,
        "exposure" => config.light.exposure = number(key, value)?,
        "flicker" => config.light.flicker = number(key, value)?,
        _ => {
            let keys: Vec<String> = KEYS.iter().map(|(key, meaning)| format!("{key} ({meaning})")).collect();
            return Err(format!("unknown key `{key}`; the keys are {}", keys.join(", ")));
        }
    }
    Ok(())
}

fn number<T: std::str::FromStr>(key: &str, value: &str) -> Result<T, String> {
    let meaning = KEYS.iter().find(|(k, _)| *k == key).map_or("number", |(_, meaning)| meaning);
    value.parse().map_err(|_| format!("`{key}={value}`: `{value}` cannot be read as {meaning}"))
}

/// Returns the variant named `value`.
fn one_of<T: Copy>(key: &str, value: &str, all: &[(&str, T)]) -> Result<T, String> {
    let names = || all.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    let found = all.iter().find(|(name, _)| *name == value);
    found.map(|&(_, variant)| variant).ok_or_else(|| format!("`{key}={value}`: use one of {}", names()))
}

fn switch(key: &str, value: &str) -> Result<bool, String> {
    match value {
        "on" | "true" | "1" => Ok(true),
        "off" | "false" | "0" => Ok(false),
        _ => Err(format!("`{key}={value}`: use on or off")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::ActorsConfig;

    fn message(spec: &str) -> String {
        parse(spec).unwrap_err().to_string()
    }

    #[test]
    fn a_full_spec_sets_every_field_it_names() {
        let config =
            parse("synth:sitting_rpy?seed=7&people=3&frames=90&width=320&height=240&noise=off&boxes=on").unwrap();
        assert_eq!((config.activity, config.motion), (Activity::Sitting, CameraMotion::Rpy));
        assert_eq!((config.seed, config.people, config.frames), (7, 3, 90));
        assert_eq!((config.camera.width, config.camera.height), (320, 240));
        assert!((config.camera.fx - 267.7).abs() < 1e-9 && (config.camera.cx - 159.8).abs() < 1e-9);
        assert_eq!(config.sensor, SensorConfig::perfect());
        assert!(config.detections);
    }

    #[test]
    fn each_effect_of_the_sensor_has_its_switch() {
        let off = parse("walking_xyz?blur=0&autoexposure=off&holes=off").unwrap().sensor;
        assert_eq!((off.exposure_s, off.auto_exposure), (0.0, 0.0));
        assert_eq!((off.holes, off.max_angle_deg, off.min_return), (false, 90.0, 0.0));
        assert_eq!(off.color_noise, SensorConfig::default().color_noise);
        let on = parse("walking_xyz?noise=off&blur=20&offset_ms=-12&autoexposure=on&holes=on").unwrap().sensor;
        assert!((on.exposure_s - 0.02).abs() < 1e-12 && (on.depth_offset_s + 0.012).abs() < 1e-12);
        assert!(on.auto_exposure > 0.0 && on.holes && on.min_return > 0.0);
        assert!(message("walking_xyz?offset_ms=5000").contains("between -1 and 1 s"));
    }

    #[test]
    fn the_calibration_has_the_readout_that_a_spec_or_a_camera_mentions() {
        let told = |spec: &str| {
            let WorldConfig { camera, sensor, .. } = parse(spec).unwrap();
            let calibrated = (camera.readout_ms, camera.depth_readout_ms, camera.depth_delay_ms);
            ((sensor.readout_ms, sensor.depth_readout()), calibrated)
        };
        assert_eq!(told("walking_xyz"), ((0.0, 0.0), (None, None, None)));
        assert_eq!(told("walking_xyz?readout=0"), ((0.0, 0.0), (Some(0.0), Some(0.0), Some(0.0))));
        let both = (Some(30.0), Some(-20.0), Some(0.0));
        assert_eq!(told("walking_xyz?depth_readout=-20&readout=30"), ((30.0, -20.0), both));
        let unknown = "walking_xyz?unknown_readout=true&readout=30";
        assert_eq!(told(unknown), ((30.0, 30.0), (None, None, None)));
        assert_eq!(told("walking_xyz?readout=30&stereo=0.11"), ((30.0, 30.0), (Some(30.0), None, None)));
        let mut camera = default_camera();
        camera.readout_ms = Some(25.0);
        let rolling = parse_with_camera("walking_xyz", camera, 5000.0).unwrap();
        assert_eq!((rolling.sensor.readout_ms, rolling.camera.readout_ms), (25.0, Some(25.0)));
        assert!(message("walking_xyz?readout=101").contains("between -100 and 100 ms"));
        assert!(message("walking_xyz?depth_readout=-101").contains("between -100 and 100 ms"));
    }

    #[test]
    fn a_stereo_camera_has_its_own_baseline_and_no_distortion() {
        let camera = parse("walking_xyz?stereo=0.2&width=320").unwrap().camera;
        assert!((camera.bf - 0.2 * 267.7).abs() < 1e-9, "{}", camera.bf);
        assert!(message("walking_xyz?stereo=-1").contains("between 0 and 2 m"));
        let bent = default_camera().with_distortion([0.1, 0.0, 0.0, 0.0, 0.0]);
        let error = parse_with_camera("walking_xyz?stereo=0.11", bent, 5000.0).unwrap_err().to_string();
        assert!(error.contains("zero for a stereo camera"), "{error}");
    }

    #[test]
    fn scene_motion_activity_and_light_are_keys_too() {
        let config =
            parse("synth:walking_xyz?scene=lab&motion=drive&activity=sitting&exposure=0.3&flicker=0.5").unwrap();
        assert_eq!(
            (config.scene, config.motion, config.activity),
            (SceneKind::Lab, CameraMotion::Drive, Activity::Sitting)
        );
        assert_eq!((config.light.exposure, config.light.flicker), (0.3, 0.5));
        assert!(message("synth:?scene=attic").contains("use one of office, rescue, corridor, lab"));
        assert!(message("synth:?flicker=2").contains("between 0 and 1"));
    }

    #[test]
    fn a_spec_says_what_moves() {
        let config = parse("walking_xyz?people=3&robots=2&chair=on&carry=on&moved=on&share=0.8").unwrap();
        let carried_object = CarriedObject::Box;
        let actors = ActorsConfig {
            robots: 2,
            pushed_chair: true,
            carried_box: true,
            carried_object,
            moved_object: true,
            ..ActorsConfig::default()
        };
        assert_eq!((config.actors, config.person_share), (actors, 0.8));
        assert_eq!(parse("carried_box?object=laptop").unwrap().actors.carried_object, CarriedObject::Laptop);
        assert!(message("walking_xyz?object=laptop").contains("unless `carried_box` is on"));
        assert!(message("carried_box?object=sofa").contains("use one of box, laptop"));
        assert_eq!(parse("walking_xyz?activity=crowd").unwrap().activity, Activity::Crowd);
        assert!(message("walking_xyz?people=5&robots=2").contains("at most 6 together with the people"));
        assert!(message("walking_xyz?people=1&chair=on&carry=on").contains("at least as many"));
        assert!(message("walking_xyz?activity=running").contains("use one of sitting, walking, crowd"));
    }

    #[test]
    fn every_listed_name_parses() {
        for name in names() {
            parse(&format!("synth:{name}")).unwrap();
        }
    }

    #[test]
    fn errors_name_the_mistake_and_the_cure() {
        let unknown = message("synth:running_xyz");
        assert!(unknown.contains("`running_xyz`") && unknown.contains("walking_halfsphere"), "{unknown}");
        let key = message("synth:walking_xyz?sead=3");
        assert!(key.contains("`sead`") && key.contains("seed (integer)"), "{key}");
        assert!(message("synth:walking_xyz?people=two").contains("`two` cannot be read as 0 to 6"));
        assert!(message("synth:walking_xyz?people=9").contains("between 0 and 6"));
        assert!(message("synth:walking_xyz?noise=maybe").contains("use on or off"));
        assert!(message("synth:walking_xyz?seed").contains("key=value"));
        assert!(message("synth:walking_xyz?width=0").contains("between 16 and 4096"));
    }
}

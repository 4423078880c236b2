//! Worlds named by a line of text, such as `synth:walking_xyz?seed=7&people=2&frames=300`.
//!
//! In: the text. Out: a [`WorldConfig`], or an error that lists what would be right.

use crate::config::{Activity, CameraMotion, SensorConfig, WorldConfig, WorldError};

/// Keys of a spec and what they set.
const KEYS: &[(&str, &str)] = &[
    ("seed", "integer"),
    ("people", "0 to 6"),
    ("activity", "sitting, walking or crowd"),
    ("robots", "0 to 6, with the people at most 6"),
    ("chair", "on or off: someone pushes a chair"),
    ("carry", "on or off: someone carries a box"),
    ("moved", "on or off: a box is displaced while out of view"),
    ("frames", "number of frames"),
    ("share", "share of the view that people cover, 0 to 0.8"),
    ("width", "px"),
    ("height", "px"),
    ("fps", "frames per second"),
    ("shake", "hand shake, 1 is natural"),
    ("noise", "on or off"),
    ("boxes", "on or off: exact person boxes as detections"),
    ("shadows", "on or off"),
];

/// Whether `text` is meant as a synthetic world (it starts with `synth:`).
pub fn is_spec(text: &str) -> bool {
    text.starts_with("synth:")
}

/// Names of all worlds: `sitting` or `walking`, then the camera's motion.
pub fn names() -> Vec<String> {
    let pairs = Activity::ALL.iter().flat_map(|(a, _)| CameraMotion::ALL.iter().map(move |(m, _)| format!("{a}_{m}")));
    pairs.collect()
}

/// Reads a spec; the prefix `synth:` may be left out, an empty name means `walking_xyz`.
///
/// # Errors
/// If the name or a key is unknown, or a value cannot be read or is out of range. The message lists the valid names.
pub fn parse(spec: &str) -> Result<WorldConfig, WorldError> {
    let fail = |reason: String| WorldError::Spec { spec: spec.to_owned(), reason };
    let text = spec.strip_prefix("synth:").unwrap_or(spec);
    let (name, query) = text.split_once('?').unwrap_or((text, ""));
    let name = if name.is_empty() { "walking_xyz" } else { name };
    let mut config = WorldConfig::default();
    (config.activity, config.motion) =
        find(name).ok_or_else(|| fail(format!("unknown world `{name}`; the worlds are {}", names().join(", "))))?;
    for pair in query.split('&').filter(|pair| !pair.is_empty()) {
        let (key, value) =
            pair.split_once('=').ok_or_else(|| fail(format!("`{pair}` is not of the form key=value")))?;
        set(&mut config, key, value).map_err(fail)?;
    }
    config.validate().map_err(|error| fail(error.to_string()))?;
    Ok(config)
}

fn find(name: &str) -> Option<(Activity, CameraMotion)> {
    let (activity, motion) = name.split_once('_')?;
    let (_, activity) = *Activity::ALL.iter().find(|(n, _)| *n == activity)?;
    let (_, motion) = *CameraMotion::ALL.iter().find(|(n, _)| *n == motion)?;
    Some((activity, motion))
}

fn set(config: &mut WorldConfig, key: &str, value: &str) -> Result<(), String> {
    let camera = &mut config.camera;
    match key {
        "seed" => config.seed = number(key, value)?,
        "people" => config.people = number(key, value)?,
        "activity" => {
            let known = Activity::ALL.iter().find(|(name, _)| *name == value);
            config.activity = known.ok_or_else(|| format!("`{key}={value}`: use sitting, walking or crowd"))?.1;
        }
        "robots" => config.actors.robots = number(key, value)?,
        "chair" => config.actors.pushed_chair = switch(key, value)?,
        "carry" => config.actors.carried_box = switch(key, value)?,
        "moved" => config.actors.moved_object = switch(key, value)?,
        "frames" => config.frames = number(key, value)?,
        "share" => config.person_share = number(key, value)?,
        // The view stays the same when the size changes: intrinsics scale about the pixel grid's corner.
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
        "shake" => config.hand_shake = number(key, value)?,
        "noise" => {
            if !switch(key, value)? {
                config.sensor = SensorConfig::perfect();
            }
        }
        "boxes" => config.detections = switch(key, value)?,
        "shadows" => config.light.moving_shadows = switch(key, value)?,
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
    fn a_spec_says_what_moves() {
        let config = parse("walking_xyz?people=3&robots=2&chair=on&carry=on&moved=on&share=0.8").unwrap();
        let actors = ActorsConfig { robots: 2, pushed_chair: true, carried_box: true, moved_object: true };
        assert_eq!((config.actors, config.person_share), (actors, 0.8));
        assert_eq!(parse("walking_xyz?activity=crowd").unwrap().activity, Activity::Crowd);
        assert!(message("walking_xyz?people=5&robots=2").contains("at most 6 together with the people"));
        assert!(message("walking_xyz?people=1&chair=on&carry=on").contains("at least as many"));
        assert!(message("walking_xyz?activity=running").contains("use sitting, walking or crowd"));
    }

    #[test]
    fn every_listed_name_parses() {
        assert_eq!(names().len(), 12);
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

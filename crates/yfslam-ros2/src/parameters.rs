//! The parameters of the node: each with its type, default, range and meaning, which `--help` and the manual list.

use std::collections::BTreeMap;

/// A value of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    Bool(bool),
    Integer(i64),
    Number(f64),
    Text(String),
}

/// What a parameter may be.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    Bool(bool),
    /// Default, least, largest.
    Integer(i64, i64, i64),
    /// Default, least, largest.
    Number(f64, f64, f64),
    Text(&'static str),
    /// One of these; the first is the default.
    Choice(&'static [&'static str]),
}

/// A parameter.
#[derive(Debug)]
pub struct Parameter {
    pub name: &'static str,
    pub kind: Kind,
    /// Whether it can be set while the node runs.
    pub live: bool,
    pub help: &'static str,
}

const fn p(name: &'static str, kind: Kind, live: bool, help: &'static str) -> Parameter {
    Parameter { name, kind, live, help }
}

/// All parameters, in the order in which they are shown.
pub const PARAMETERS: &[Parameter] = &[
    p(
        "color_topic",
        Kind::Text("/camera/camera/color/image_raw"),
        false,
        "Colour images: Image, or CompressedImage if the name ends with /compressed.",
    ),
    p(
        "depth_topic",
        Kind::Text("/camera/camera/aligned_depth_to_color/image_raw"),
        false,
        "Depth images registered to colour: Image, or CompressedImage if the name ends with /compressedDepth.",
    ),
    p("camera_info_topic", Kind::Text("/camera/camera/color/camera_info"), false, "Calibration of the colour images."),
    p(
        "image_reliability",
        Kind::Choice(&["best_effort", "reliable"]),
        false,
        "QoS of images and calibration; best_effort fits publishers of both kinds.",
    ),
    p(
        "sync_tolerance",
        Kind::Number(0.02, 0.0, 1.0),
        false,
        "Largest difference between the stamps of a colour and a depth image, s; 0 asks for equal stamps.",
    ),
    p(
        "depth_units_per_metre",
        Kind::Number(1000.0, 1.0, 100_000.0),
        false,
        "Units of 16-bit depth images; REP 118 says millimetres.",
    ),
    p("map_frame", Kind::Text("map"), false, "Frame of the map."),
    p("odom_frame", Kind::Text("odom"), false, "Frame of odometry, in which nothing jumps."),
    p("base_frame", Kind::Text("base_link"), false, "Frame of the robot, whose pose is published."),
    p(
        "camera_pose",
        Kind::Text(""),
        false,
        "Pose of the camera's optical frame in the base, `x y z roll pitch yaw` in m and rad; empty takes it from /tf_static.",
    ),
    p(
        "tf_timeout",
        Kind::Number(3.0, 0.0, 600.0),
        false,
        "Time to wait for the pose of the camera on /tf_static, s; then the camera is taken to be the base, looking forward.",
    ),
    p(
        "odom",
        Kind::Choice(&["auto", "publish", "given", "none"]),
        false,
        "Who publishes odom to base on /tf: this node, another one (given), no one (map to base is published); auto: this node until another one does.",
    ),
    p(
        "transform_tolerance",
        Kind::Number(0.1, 0.0, 5.0),
        true,
        "Time by which map to odom is dated ahead, s, because it stays valid until the next one.",
    ),
    p(
        "max_linear_speed",
        Kind::Number(5.0, 0.01, 100.0),
        false,
        "Faster motion of the base is a jump of the map, m/s.",
    ),
    p(
        "max_angular_speed",
        Kind::Number(6.0, 0.01, 100.0),
        false,
        "Faster rotation of the base is a jump of the map, rad/s.",
    ),
    p(
        "odom_drift",
        Kind::Number(0.01, 0.0, 1.0),
        true,
        "Standard deviation that odometry gains for each metre of path, m and rad; an assumption, not a measurement.",
    ),
    p("config", Kind::Text(""), false, "Configuration of SLAM in TOML (`yfslam config`); empty takes the defaults."),
    p(
        "method",
        Kind::Choice(&["full", "none", "boxes", "yf", "ds", "dyna", "dms"]),
        false,
        "Method for dynamic scenes.",
    ),
    p("detect_every", Kind::Integer(1, 1, 1000), false, "The detector runs on every n-th frame."),
    p(
        "detect_async",
        Kind::Bool(false),
        false,
        "Tracking does not wait for the detector, and uses boxes when they are ready; for weak boards.",
    ),
    p("threaded", Kind::Bool(true), false, "Mapping runs on its own thread."),
    p("load_map", Kind::Text(""), false, "Map of an earlier session."),
    p("localise_only", Kind::Bool(false), false, "The loaded map stays as it is."),
    p("map_file", Kind::Text("yfslam.map"), true, "File of the services save_map and load_map."),
    p("save_on_exit", Kind::Bool(false), true, "The map is saved when the node ends."),
    p(
        "trajectory_file",
        Kind::Text(""),
        true,
        "File for the trajectory when the node ends (TUM format, base in map); empty writes none.",
    ),
    p("grid", Kind::Bool(true), false, "A live occupancy grid is made."),
    p("grid_period", Kind::Number(1.0, 0.1, 3600.0), true, "Time between two grids, s."),
    p(
        "grid_min_height",
        Kind::Number(0.1, -100.0, 100.0),
        true,
        "Lower end of obstacles above the origin of the map, m.",
    ),
    p("grid_max_height", Kind::Number(1.5, -100.0, 100.0), true, "Upper end of obstacles, m."),
    p("publish_period", Kind::Number(1.0, 0.1, 3600.0), true, "Time between two paths, clouds and graphs, s."),
    p(
        "silence_timeout",
        Kind::Number(1.0, 0.05, 3600.0),
        false,
        "A camera that sends nothing for longer is silent, s.",
    ),
    p(
        "use_sim_time",
        Kind::Bool(false),
        true,
        "Diagnostics are dated by /clock; all else carries the stamps of the images.",
    ),
    p(
        "rmw",
        Kind::Choice(&["fastrtps", "cyclonedds"]),
        false,
        "How services are carried: as the RMW of the other nodes does.",
    ),
];

/// The values of all parameters.
#[derive(Clone, Debug)]
pub struct Parameters(BTreeMap<&'static str, Value>);

impl Default for Parameters {
    fn default() -> Self {
        Self(PARAMETERS.iter().map(|parameter| (parameter.name, parameter.default())).collect())
    }
}

impl Parameter {
    /// Returns the default.
    pub fn default(&self) -> Value {
        match self.kind {
            Kind::Bool(value) => Value::Bool(value),
            Kind::Integer(value, ..) => Value::Integer(value),
            Kind::Number(value, ..) => Value::Number(value),
            Kind::Text(value) => Value::Text(value.into()),
            Kind::Choice(values) => Value::Text(values.first().copied().unwrap_or_default().into()),
        }
    }

    /// Converts a value to the type of the parameter.
    ///
    /// # Errors
    /// It has another type, or is out of range.
    pub fn check(&self, value: &Value) -> Result<Value, String> {
        let wrong = |wanted: String| Err(format!("{} is {value}; give {wanted}", self.name));
        match (self.kind, value) {
            (Kind::Bool(_), Value::Bool(_)) => Ok(value.clone()),
            (Kind::Bool(_), _) => wrong("true or false".into()),
            (Kind::Integer(_, least, most), Value::Integer(given)) if (least..=most).contains(given) => {
                Ok(value.clone())
            }
            (Kind::Integer(_, least, most), _) => wrong(format!("a whole number from {least} to {most}")),
            (Kind::Number(_, least, most), _) => {
                let given = match value {
                    Value::Number(number) => *number,
                    Value::Integer(number) => *number as f64,
                    _ => f64::NAN,
                };
                if (least..=most).contains(&given) {
                    Ok(Value::Number(given))
                } else {
                    wrong(format!("a number from {least} to {most}"))
                }
            }
            (Kind::Text(_), Value::Text(_)) => Ok(value.clone()),
            // A text such as 12 looks like a number.
            (Kind::Text(_), other) => Ok(Value::Text(other.to_string())),
            (Kind::Choice(values), Value::Text(text)) if values.contains(&text.as_str()) => Ok(value.clone()),
            (Kind::Choice(values), _) => wrong(format!("one of {}", values.join(", "))),
        }
    }
}

impl Parameters {
    /// Sets a parameter.
    ///
    /// # Errors
    /// There is none of this name, or the value does not fit.
    pub fn set(&mut self, name: &str, value: &Value) -> Result<(), String> {
        let parameter = find(name)?;
        self.0.insert(parameter.name, parameter.check(value)?);
        Ok(())
    }

    pub fn flag(&self, name: &str) -> bool {
        matches!(self.0.get(name), Some(Value::Bool(true)))
    }

    pub fn integer(&self, name: &str) -> i64 {
        if let Some(Value::Integer(value)) = self.0.get(name) { *value } else { 0 }
    }

    pub fn number(&self, name: &str) -> f64 {
        if let Some(Value::Number(value)) = self.0.get(name) { *value } else { 0.0 }
    }

    pub fn text(&self, name: &str) -> &str {
        if let Some(Value::Text(value)) = self.0.get(name) { value } else { "" }
    }

    /// Returns all names with their values.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &Value)> {
        self.0.iter().map(|(name, value)| (*name, value))
    }
}

/// Finds a parameter.
///
/// # Errors
/// There is none of this name.
pub fn find(name: &str) -> Result<&'static Parameter, String> {
    let found = PARAMETERS.iter().find(|parameter| parameter.name == name);
    found.ok_or_else(|| format!("there is no parameter {name}; yfslam-ros2 --help lists all"))
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Bool(value) => value.fmt(f),
            Self::Integer(value) => value.fmt(f),
            Self::Number(value) => write!(f, "{value:?}"),
            Self::Text(value) => value.fmt(f),
        }
    }
}

impl Value {
    /// Reads a scalar of YAML.
    pub fn parse(text: &str) -> Self {
        let text = text.trim();
        let quoted = |quote: char| text.strip_prefix(quote).and_then(|rest| rest.strip_suffix(quote));
        if let Some(inner) = quoted('"').or_else(|| quoted('\'')) {
            return Self::Text(inner.into());
        }
        match text {
            "true" | "True" | "yes" | "on" => return Self::Bool(true),
            "false" | "False" | "no" | "off" => return Self::Bool(false),
            _ => {}
        }
        let number =
            || text.parse().ok().filter(|_| text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)));
        text.parse()
            .map(Self::Integer)
            .ok()
            .or_else(|| number().map(Self::Number))
            .unwrap_or_else(|| Self::Text(text.into()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_default_is_allowed_and_every_name_is_there_once() {
        for (index, parameter) in PARAMETERS.iter().enumerate() {
            assert_eq!(parameter.check(&parameter.default()), Ok(parameter.default()));
            assert!(PARAMETERS[..index].iter().all(|other| other.name != parameter.name), "{}", parameter.name);
        }
    }

    #[test]
    fn values_are_read_as_yaml_writes_them() {
        let read = ["true", "7", "-0.5", "1e3", "\"7\"", "map", "''", "nan"].map(Value::parse);
        let text = |t: &str| Value::Text(t.into());
        assert_eq!(
            read,
            [
                Value::Bool(true),
                Value::Integer(7),
                Value::Number(-0.5),
                Value::Number(1000.0),
                text("7"),
                text("map"),
                text(""),
                text("nan")
            ]
        );
    }

    #[test]
    fn a_wrong_value_is_refused_with_what_is_right() {
        let mut parameters = Parameters::default();
        for (name, value, words) in [
            ("grid", "7", "true or false"),
            ("detect_every", "0", "1 to 1000"),
            ("odom", "maybe", "auto, publish"),
            ("speed", "1", "--help"),
            ("sync_tolerance", "nan", "from 0"),
        ] {
            let error = parameters.set(name, &Value::parse(value)).unwrap_err();
            assert!(error.contains(words), "{error}");
        }
        assert_eq!(parameters.set("sync_tolerance", &Value::Integer(1)), Ok(()));
        assert_eq!(parameters.number("sync_tolerance"), 1.0);
    }
}

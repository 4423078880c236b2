//! The arguments of a ROS 2 node: `--ros-args -r FROM:=TO -p NAME:=VALUE --params-file FILE -r __ns:=/NS -r __node:=NAME`.

use std::path::PathBuf;

use crate::parameters::Value;

/// What the arguments say.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RosArgs {
    pub node: Option<String>,
    pub namespace: Option<String>,
    /// Names of topics and services, and what stands for them.
    pub remaps: Vec<(String, String)>,
    pub parameters: Vec<(String, Value)>,
    pub files: Vec<PathBuf>,
    /// Other arguments.
    pub rest: Vec<String>,
}

impl RosArgs {
    /// Reads arguments.
    ///
    /// # Errors
    /// An argument is not understood or has no value.
    pub fn parse(arguments: impl IntoIterator<Item = String>) -> Result<Self, String> {
        let mut parsed = Self::default();
        let mut is_ros = false;
        let mut arguments = arguments.into_iter();
        while let Some(argument) = arguments.next() {
            if !is_ros {
                match argument.as_str() {
                    "--ros-args" => is_ros = true,
                    _ => parsed.rest.push(argument),
                }
                continue;
            }
            let mut value = || arguments.next().ok_or_else(|| format!("{argument} needs a value"));
            match argument.as_str() {
                "--" => is_ros = false,
                "--ros-args" => {}
                "-r" | "--remap" => parsed.remap(&value()?)?,
                "-p" | "--param" => {
                    let given = value()?;
                    let (name, value) = split(&given)?;
                    parsed.parameters.push((after_node(name).into(), Value::parse(value)));
                }
                "--params-file" => parsed.files.push(value()?.into()),
                // Logging is set by RUST_LOG, security is not supported; launch files pass these, too.
                "--log-level" | "--log-config-file" | "--log-file-name" => drop(value()?),
                "--enable-rosout-logs"
                | "--disable-rosout-logs"
                | "--enable-stdout-logs"
                | "--disable-stdout-logs"
                | "--enable-external-lib-logs"
                | "--disable-external-lib-logs" => {}
                other => return Err(format!("{other} is not an argument of ROS; see --help")),
            }
        }
        Ok(parsed)
    }

    fn remap(&mut self, rule: &str) -> Result<(), String> {
        let (from, to) = split(rule)?;
        match after_node(from) {
            "__node" | "__name" => self.node = Some(to.into()),
            "__ns" => self.namespace = Some(to.into()),
            from => self.remaps.push((from.into(), to.into())),
        }
        Ok(())
    }
}

fn split(rule: &str) -> Result<(&str, &str), String> {
    rule.split_once(":=").ok_or_else(|| format!("{rule} has no :=, such as in name:=value"))
}

/// Returns the name without the node for which alone it holds: this process has one node.
fn after_node(name: &str) -> &str {
    name.split_once(':').map_or(name, |(_, name)| name)
}

/// Where names of topics and services lead.
#[derive(Clone, Debug, PartialEq)]
pub struct Names {
    pub node: String,
    /// Begins with a slash and, but for the root, does not end with one.
    pub namespace: String,
    remaps: Vec<(String, String)>,
}

impl Names {
    /// Takes node, namespace and remappings of the arguments.
    pub fn new(arguments: &RosArgs, default_node: &str) -> Self {
        let namespace = arguments.namespace.as_deref().unwrap_or("/").trim_matches('/');
        let mut names = Self {
            node: arguments.node.clone().unwrap_or_else(|| default_node.into()),
            namespace: format!("/{namespace}"),
            remaps: Vec::new(),
        };
        names.remaps = arguments.remaps.iter().map(|(from, to)| (names.expand(from), names.expand(to))).collect();
        names
    }

    /// Returns the full name: `~/x` is private, `x` belongs to the namespace, `/x` is full already; then it is remapped.
    pub fn resolve(&self, name: &str) -> String {
        let full = self.expand(name);
        self.remaps.iter().find(|(from, _)| *from == full).map_or(full, |(_, to)| to.clone())
    }

    fn expand(&self, name: &str) -> String {
        let space = if self.namespace == "/" { "" } else { &self.namespace };
        match name.strip_prefix('~') {
            Some(private) => format!("{space}/{}/{}", self.node, private.trim_start_matches('/')),
            None if name.starts_with('/') => name.into(),
            None => format!("{space}/{name}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(line: &str) -> Result<RosArgs, String> {
        RosArgs::parse(line.split_whitespace().map(str::to_owned))
    }

    #[test]
    fn the_arguments_of_a_launch_file_are_understood() {
        let line = "--quiet --ros-args -r __node:=slam -r __ns:=/robot1 --params-file robot.yaml -p grid:=false -r odom:=wheels -p slam:method:=none --log-level info -- more";
        let parsed = parse(line).unwrap();
        assert_eq!((parsed.node.as_deref(), parsed.namespace.as_deref()), (Some("slam"), Some("/robot1")));
        assert_eq!(
            parsed.parameters,
            [("grid".into(), Value::Bool(false)), ("method".into(), Value::Text("none".into()))]
        );
        assert_eq!((parsed.files, parsed.rest), (vec!["robot.yaml".into()], vec!["--quiet".into(), "more".into()]));
        for wrong in ["--ros-args -r", "--ros-args -p grid", "--ros-args --magic"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn names_are_expanded_and_remapped_as_in_ros() {
        let arguments = parse("--ros-args -r __ns:=/robot1 -r odom:=/wheels/odom -r ~/pose:=pose -r /tf:=tf").unwrap();
        let names = Names::new(&arguments, "yfslam");
        let resolved = ["odom", "~/pose", "/tf", "~/save_map", "/diagnostics"].map(|name| names.resolve(name));
        assert_eq!(resolved, ["/wheels/odom", "/robot1/pose", "/robot1/tf", "/robot1/yfslam/save_map", "/diagnostics"]);
        assert_eq!(Names::new(&RosArgs::default(), "yfslam").resolve("~/map"), "/yfslam/map");
    }
}

//! Files of parameters in the usual form of ROS 2:
//!
//! ```yaml
//! /**:                      # or the name of the node, such as yfslam or /robot1/yfslam
//!   ros__parameters:
//!     method: full
//! ```
//!
//! This is the part of YAML that parameters of this node need: maps of scalars by indentation. Lists are refused, because no parameter
//! is one.

use crate::parameters::Value;
use crate::ros_args::Names;

/// Reads the parameters for the node, in the order of the file. `use_sim_time` and `qos_overrides` are read as all others.
///
/// # Errors
/// A line is not understood; the message has its number.
pub fn parse(text: &str, names: &Names) -> Result<Vec<(String, Value)>, String> {
    let mut path: Vec<(usize, String)> = Vec::new();
    let mut found = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let content = without_comment(line);
        let trimmed = content.trim();
        if trimmed.is_empty() || trimmed == "---" {
            continue;
        }
        let wrong = |problem: &str| format!("line {}: {problem}: {trimmed}", index + 1);
        let indent = content.len() - content.trim_start().len();
        if content[..indent].contains('\t') {
            return Err(wrong("indent with spaces, not with tabs"));
        }
        let (key, value) = split_key(trimmed).ok_or_else(|| wrong("is no `name: value`"))?;
        while path.last().is_some_and(|(deeper, _)| *deeper >= indent) {
            path.pop();
        }
        if value.is_empty() {
            path.push((indent, key));
            continue;
        }
        if value.starts_with(['[', '{', '|', '>', '&', '*']) {
            return Err(wrong("is no single value"));
        }
        let keys: Vec<&str> = path.iter().map(|(_, key)| key.as_str()).collect();
        let Some(at) = keys.iter().position(|key| *key == "ros__parameters") else {
            return Err(wrong("stands outside ros__parameters"));
        };
        if is_for(&keys[..at], names) {
            let name = [&keys[at + 1..], &[key.as_str()]].concat().join(".");
            found.push((name, Value::parse(value)));
        }
    }
    Ok(found)
}

/// Returns whether names of nodes and namespaces, from the outside in, mean this node.
fn is_for(keys: &[&str], names: &Names) -> bool {
    let full = names.resolve("~").trim_end_matches('/').to_owned();
    let given = keys.join("/").replace("//", "/");
    let with_slash = if given.starts_with('/') { given.clone() } else { format!("/{given}") };
    match given.as_str() {
        "/**" | "**" => true,
        _ if with_slash.starts_with("/**/") => full.ends_with(&with_slash[3..]),
        _ => with_slash == full || given.trim_start_matches('/') == names.node,
    }
}

fn without_comment(line: &str) -> &str {
    let mut quote = None;
    for (index, c) in line.char_indices() {
        match (quote, c) {
            (None, '"' | '\'') => quote = Some(c),
            (Some(open), _) if open == c => quote = None,
            (None, '#') if index == 0 || line[..index].ends_with(char::is_whitespace) => return &line[..index],
            _ => {}
        }
    }
    line
}

fn split_key(line: &str) -> Option<(String, &str)> {
    let (key, value) = line.split_once(": ").or_else(|| line.strip_suffix(':').map(|key| (key, "")))?;
    let key = key.trim().trim_matches(['"', '\'']);
    (!key.is_empty()).then(|| (key.to_owned(), value.trim()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros_args::RosArgs;

    fn names(namespace: &str) -> Names {
        Names::new(&RosArgs { namespace: Some(namespace.into()), ..RosArgs::default() }, "yfslam")
    }

    #[test]
    fn parameters_of_this_node_and_of_all_nodes_are_read() {
        let text = "# robot\n/**:\n  ros__parameters:\n    method: none  # fast\n    color_topic: \"/a # b\"\nother:\n  ros__parameters:\n    grid: true\n/robot1/yfslam:\n  ros__parameters:\n    grid: false\n    sync_tolerance: 0.01\n";
        let found = parse(text, &names("/robot1")).unwrap();
        let expected = [("method", "none"), ("color_topic", "'/a # b'"), ("grid", "false"), ("sync_tolerance", "0.01")];
        assert_eq!(found, expected.map(|(name, value)| (name.to_owned(), Value::parse(value))));
        assert_eq!(parse(text, &names("/robot2")).unwrap().len(), 2);
        let nested = "robot1:\n  yfslam:\n    ros__parameters:\n      grid: true\n";
        assert_eq!(parse(nested, &names("/robot1")).unwrap().len(), 1);
    }

    #[test]
    fn what_is_not_understood_is_refused_with_its_line() {
        for (text, words) in [
            ("a:\n\tb: 1", "tabs"),
            ("/**:\n  ros__parameters:\n    list: [1, 2]", "line 3"),
            ("grid: true", "outside"),
            ("words", "name: value"),
        ] {
            let error = parse(text, &names("/")).unwrap_err();
            assert!(error.contains(words), "{error}");
        }
    }
}

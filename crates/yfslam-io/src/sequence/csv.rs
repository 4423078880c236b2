//! Tables with commas whose first line names the columns, and their time stamps.

use std::path::Path;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use crate::error::{Error, Result};
use crate::text::content_lines;
use crate::time::parse_stamp_ns;
use crate::trajectory::{StampedPose, TrajectoryFile};

/// A table.
pub struct Table<'a> {
    /// Names of the columns, in lower case, and their units, such as `ns`.
    columns: Vec<(String, String)>,
    /// Line numbers and cells.
    pub rows: Vec<(usize, Vec<&'a str>)>,
}

/// Unit of the time stamps of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeUnit {
    /// Power of ten of one unit, s.
    exponent: i32,
}

impl<'a> Table<'a> {
    /// Parses a table.
    ///
    /// # Errors
    /// It has no line after the header.
    pub fn parse(text: &'a str, path: &Path) -> Result<Self> {
        // The header may be a comment.
        let text = text.trim_start_matches('\u{feff}').trim_start();
        let header = text.lines().next().unwrap_or_default().trim().trim_start_matches('#');
        let column = |name: &str| {
            let name = name.trim().trim_matches('"').to_lowercase();
            let (name, unit) = name.split_once(['(', '[']).unwrap_or((&name, ""));
            (name.trim().to_owned(), unit.trim_end_matches([')', ']']).trim().to_owned())
        };
        let cells = |line: &'a str| line.split(',').map(|cell| cell.trim().trim_matches('"')).collect();
        let is_header = |number: usize| number == 1;
        let rows: Vec<_> =
            content_lines(text).filter(|(n, _)| !is_header(*n)).map(|(number, line)| (number, cells(line))).collect();
        if rows.is_empty() {
            return Err(Error::content(path, "has no line after its header", "record or unpack the sequence again"));
        }
        Ok(Self { columns: header.split(',').map(column).collect(), rows })
    }

    /// Returns the index of a column.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|(column, _)| column == name)
    }
}

impl TimeUnit {
    /// Returns the unit that the header states, else that of the size of the first stamp: nanoseconds since 1970 have 19 digits.
    pub fn of(table: &Table, column: usize) -> Self {
        let stated = table.columns.get(column).map_or("", |(_, unit)| unit.as_str());
        let first = table.rows.first().and_then(|(_, cells)| cells.get(column)).copied().unwrap_or_default();
        let exponent = match stated {
            "s" => 0,
            "ms" => -3,
            "us" | "µs" => -6,
            "ns" => -9,
            _ => exponent_of(first),
        };
        Self { exponent }
    }

    /// Parses a stamp.
    ///
    /// # Errors
    /// The text is no time stamp.
    pub fn parse(self, text: &str, path: &Path, line: usize) -> Result<i64> {
        let in_seconds = if self.exponent == 0 { text.to_owned() } else { format!("{text}e{}", self.exponent) };
        parse_stamp_ns(&in_seconds)
            .map_err(|error| Error::line(path, line, format!("stamp '{text}' {error}"), "write it as a decimal number"))
    }
}

/// Returns the power of ten of the unit in which `text` is a time since 1970: seconds with a point, or by the number of digits.
pub fn exponent_of(text: &str) -> i32 {
    match text.split('.').next().unwrap_or_default().trim_start_matches(['-', '+', '0']).len() {
        0..=11 => 0,
        12..=14 => -3,
        15..=17 => -6,
        _ => -9,
    }
}

/// Parses poses in columns `ts`, `tx`, `ty`, `tz`, `qx`, `qy`, `qz`, `qw`, in any order.
///
/// # Errors
/// A column is missing, or a line does not hold a pose.
pub fn parse_poses(text: &str, path: &Path) -> Result<TrajectoryFile> {
    let table = Table::parse(text, path)?;
    let column = |names: &[&str]| {
        let missing = || {
            let problem = format!("has no column {}", names.first().unwrap_or(&""));
            Error::content(path, problem, "name the columns in the first line: 'ts (ns),tx,ty,tz,qx,qy,qz,qw'")
        };
        names.iter().find_map(|name| table.column(name)).ok_or_else(missing)
    };
    let time = column(&["ts", "timestamp", "time", "t"])?;
    let values = ["tx", "ty", "tz", "qx", "qy", "qz", "qw"].map(|name| column(&[name]));
    let mut indices = [0; 7];
    for (index, value) in indices.iter_mut().zip(values) {
        *index = value?;
    }
    let unit = TimeUnit::of(&table, time);
    let pose = |(number, cells): &(usize, Vec<&str>)| {
        let cell = |column: usize| cells.get(column).copied().unwrap_or_default();
        let timestamp_ns = unit.parse(cell(time), path, *number)?;
        let mut values = [0.0; 7];
        for (value, column) in values.iter_mut().zip(indices) {
            *value = cell(column).parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| {
                Error::line(
                    path,
                    *number,
                    format!("'{}' is not a finite number", cell(column)),
                    "repair or remove the line",
                )
            })?;
        }
        let [x, y, z, qx, qy, qz, qw] = values;
        let quaternion = Quaternion::new(qw, qx, qy, qz);
        if (quaternion.norm() - 1.0).abs() > 0.05 {
            let problem = format!("quaternion of length {:.3}, not 1", quaternion.norm());
            return Err(Error::line(path, *number, problem, "check the names of the columns"));
        }
        let rotation = UnitQuaternion::from_quaternion(quaternion);
        Ok(StampedPose::new(timestamp_ns, Isometry3::from_parts(Translation3::new(x, y, z), rotation)))
    };
    TrajectoryFile::from_poses(table.rows.iter().map(pose).collect::<Result<_>>()?, path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_found_by_name_and_stamps_by_their_unit() {
        let text = "ts (ns), qw,qx,qy,qz, tx,ty,tz\n1000000001,1,0,0,0,4,5,6\n";
        let file = parse_poses(text, Path::new("groundtruth.csv")).unwrap();
        assert_eq!((file.poses[0].timestamp_ns, file.poses[0].t_world_cam.translation.y), (1_000_000_001, 5.0));
        let seconds = parse_poses("#ts,tx,ty,tz,qx,qy,qz,qw\n1.5,0,0,0,0,0,0,1\n", Path::new("g.csv")).unwrap();
        assert_eq!(seconds.poses[0].timestamp_ns, 1_500_000_000);
        let error = parse_poses("ts,tx\n1,2\n", Path::new("g.csv")).unwrap_err().to_string();
        assert!(error.contains("g.csv") && error.contains("no column ty"), "{error}");
        assert_eq!([exponent_of("1305031102"), exponent_of("1305031102175304000"), exponent_of("0.5")], [0, -9, 0]);
    }
}

//! Recognises the format of a trajectory file and parses its lines.

use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Quaternion, Translation3, UnitQuaternion};

use super::columns::{QuaternionOrder, columns, order_in_header};
use super::{FORMAT_CURE, KITTI_PERIOD_NS, StampedPose, TrajectoryFormat, stamps};
use crate::error::{Error, Result};
use crate::rotation;
use crate::text::content_lines;

/// Largest deviation of the length of a quaternion from 1. Files with two decimals stay below it; columns in another order rarely do.
const MAX_NORM_ERROR: f64 = 0.05;

/// Names of the columns after the stamp.
const SCALAR_LAST: [&str; 7] = ["tx", "ty", "tz", "qx", "qy", "qz", "qw"];
const SCALAR_FIRST: [&str; 7] = ["tx", "ty", "tz", "qw", "qx", "qy", "qz"];

/// The poses of a file in the order of its lines.
pub struct Parsed {
    pub poses: Vec<StampedPose>,
    pub format: TrajectoryFormat,
    pub notes: Vec<String>,
}

/// Parses a file.
///
/// # Errors
/// A line is malformed.
pub fn parse(text: &str, path: &Path) -> Result<Parsed> {
    let mut lines: Vec<(usize, &str)> = content_lines(text).collect();
    let is_header = |line: &str| {
        columns(line)
            .next()
            .is_some_and(|word| !word.starts_with(|c: char| c.is_ascii_digit() || "+-.nNiI".contains(c)))
    };
    let named = lines.first().filter(|(_, line)| is_header(line)).map(|(_, line)| *line);
    if named.is_some() {
        lines.remove(0);
    }
    let comment = || text.lines().find(|line| line.trim_start().starts_with('#') && order_in_header(line).is_some());
    let order = named.or_else(comment).and_then(order_in_header);
    let Some(&(_, first)) = lines.first() else {
        return Err(Error::content(path, "contains no pose", FORMAT_CURE));
    };
    let (count, has_commas) = (columns(first).count(), first.contains([',', ';']));
    if [12, 16].contains(&count) && !has_commas {
        return matrices(&lines, count, path);
    }
    let stamps = lines.iter().map(|(number, line)| (*number, columns(line).next().unwrap_or_default()));
    let counts = || lines.iter().map(|(number, line)| (*number, columns(line).count()));
    // Files of EuRoC have velocities and biases after the pose.
    let has_more = has_commas && count > 8;
    if let Some((number, count)) = counts().find(|(_, count)| if has_more { *count < 8 } else { *count != 8 }) {
        return Err(Error::line(path, number, format!("{count} columns, not 8"), FORMAT_CURE));
    }
    let stamps = stamps::parse_all(stamps, path)?;
    let in_nanoseconds = stamps.note.as_deref().is_some_and(|note| note.contains("nanoseconds"));
    let is_euroc = has_commas && (has_more || (in_nanoseconds && order != Some(QuaternionOrder::ScalarLast)));
    let order = order.unwrap_or(if is_euroc { QuaternionOrder::ScalarFirst } else { QuaternionOrder::ScalarLast });
    let poses = lines
        .iter()
        .zip(stamps.stamps_ns)
        .map(|((number, line), stamp_ns)| Ok(StampedPose::new(stamp_ns, pose(line, order, path, *number)?)))
        .collect::<Result<_>>()?;
    let format = if is_euroc { TrajectoryFormat::Euroc } else { TrajectoryFormat::Tum };
    // Nanoseconds are what EuRoC has.
    let notes = stamps.note.filter(|_| !(is_euroc && in_nanoseconds)).into_iter().collect();
    Ok(Parsed { poses, format, notes })
}

/// Parses the columns after the stamp.
fn pose(line: &str, order: QuaternionOrder, path: &Path, number: usize) -> Result<Isometry3<f64>> {
    let names = if order == QuaternionOrder::ScalarFirst { SCALAR_FIRST } else { SCALAR_LAST };
    let mut values = [0.0; 7];
    for ((value, text), name) in values.iter_mut().zip(columns(line).skip(1)).zip(names) {
        *value = finite(text).ok_or_else(|| {
            let problem = format!("{name} is '{text}', not a finite number");
            Error::line(path, number, problem, "remove the line or repair the value")
        })?;
    }
    let [tx, ty, tz, a, b, c, d] = values;
    let quaternion = match order {
        QuaternionOrder::ScalarLast => Quaternion::new(d, a, b, c),
        QuaternionOrder::ScalarFirst => Quaternion::new(a, b, c, d),
    };
    let norm = quaternion.norm();
    if (norm - 1.0).abs() > MAX_NORM_ERROR {
        let problem = format!("quaternion ({a} {b} {c} {d}) has the length {norm:.3}, not 1");
        let cure = format!("check the order of the columns: {}", names.join(" "));
        return Err(Error::line(path, number, problem, cure));
    }
    Ok(Isometry3::from_parts(Translation3::new(tx, ty, tz), UnitQuaternion::from_quaternion(quaternion)))
}

/// Parses matrices, which have no time: the poses are a tenth of a second apart.
fn matrices(lines: &[(usize, &str)], count: usize, path: &Path) -> Result<Parsed> {
    let mut poses = Vec::with_capacity(lines.len());
    for (index, (number, line)) in lines.iter().enumerate() {
        let bad =
            |problem: String| Error::line(path, *number, problem, "write the numbers of the matrix [R t] row by row");
        let found = columns(line).count();
        if found != count {
            return Err(bad(format!("{found} columns, not {count} as in the first line")));
        }
        let values: Option<Vec<f64>> = columns(line).map(finite).collect();
        let values = values.ok_or_else(|| bad("a value is not a finite number".into()))?;
        let &[a, b, c, x, d, e, f, y, g, h, i, z, ..] = &values[..] else {
            return Err(bad("12 numbers are needed".into()));
        };
        let rotation = Matrix3::new(a, b, c, d, e, f, g, h, i);
        let Some(rotation) = rotation::nearest_rotation(&rotation, rotation::OF_POSES) else {
            return Err(bad("is not the matrix of a pose: its rotation is not orthonormal".into()));
        };
        let pose = Isometry3::from_parts(Translation3::new(x, y, z), rotation);
        let timestamp_ns = i64::try_from(index).unwrap_or(i64::MAX).saturating_mul(KITTI_PERIOD_NS);
        poses.push(StampedPose::new(timestamp_ns, pose));
    }
    let notes = vec!["the file has no times; the poses are taken for frames at 10 Hz".to_owned()];
    Ok(Parsed { poses, format: TrajectoryFormat::Kitti, notes })
}

fn finite(text: &str) -> Option<f64> {
    text.parse::<f64>().ok().filter(|value| value.is_finite())
}

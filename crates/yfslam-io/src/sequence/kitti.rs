//! A sequence of the KITTI odometry benchmark (Geiger et al., "Are we ready for autonomous driving?", CVPR 2012).
//!
//! In: a folder with `times.txt`, `calib.txt` and the rectified images `image_2/` and `image_3/` (colour) or `image_0/` and
//! `image_1/` (grey). Out: its frames, the calibration, the ground truth of the left camera.

use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Matrix3, Translation3, Vector3};
use yfslam::config::DepthSource;
use yfslam::{Camera, RgbImage};

use super::layout::{Calibration, Listing, stereo_or_mono};
use super::pairs::{List, from_lists};
use super::{GroundTruthReader, ListedImage, SequenceOptions};
use crate::camera::{CameraSource, check_camera};
use crate::decode::decode_color;
use crate::error::{Error, Result};
use crate::rotation;
use crate::text::{content_lines, read_bytes, read_text};
use crate::time::parse_stamp_ns;
use crate::trajectory::{StampedPose, TrajectoryFile};

/// Numbers of the left and right cameras, the preferred pair first.
const PAIRS: [[usize; 2]; 2] = [[2, 3], [0, 1]];

/// Endings of image files, that of the benchmark first.
const ENDINGS: [&str; 4] = ["png", "jpg", "jpeg", "pgm"];

/// A 3 × 4 matrix, row-major.
type Rows = [f64; 12];

/// Returns whether `folder` is such a sequence.
pub fn is_sequence(folder: &Path) -> bool {
    folder.join("times.txt").is_file() && PAIRS.iter().any(|[left, _]| images(folder, *left).is_dir())
}

fn images(folder: &Path, camera: usize) -> PathBuf {
    folder.join(format!("image_{camera}"))
}

/// Returns the file of an image relative to `folder`; its ending is that of the file that exists, else that of the benchmark.
fn image_file(folder: &Path, camera: usize, index: usize) -> PathBuf {
    let file = |ending: &str| PathBuf::from(format!("image_{camera}/{index:06}.{ending}"));
    let found = ENDINGS.iter().map(|ending| file(ending)).find(|path| folder.join(path).is_file());
    found.unwrap_or_else(|| file("png"))
}

/// Lists the frames of `folder`.
pub fn list(folder: &Path, options: &SequenceOptions) -> Result<Listing> {
    let exists = |[left, _]: &&[usize; 2]| images(folder, *left).is_dir();
    let [left, right] = PAIRS.iter().find(exists).copied().unwrap_or(PAIRS[0]);
    let depth_source = stereo_or_mono(folder, options, images(folder, right).is_dir())?;
    let path = folder.join("times.txt");
    let stamps_ns = times(&path)?;
    let list_of = |camera: usize| {
        let image = |(index, &stamp_ns): (usize, &i64)| ListedImage {
            stamp_ns,
            image: image_file(folder, camera, index).into(),
        };
        List { images: stamps_ns.iter().enumerate().map(image).collect(), unstamped: 0, path: path.clone() }
    };
    let right_images = (depth_source == DepthSource::Stereo).then(|| list_of(right));
    let (entries, report) = from_lists(folder, list_of(left), right_images, 0)?;
    let calib = folder.join("calib.txt");
    if !options.read_calibration {
        // The pose of the camera beside camera 0 is that of calib.txt, if it can be read.
        let mounting = read_text(&calib).and_then(|text| projection(&text, left, &calib)).map(|p| t_cam0_cam(&p));
        let ground_truth = GroundTruthReader::kitti(ground_truth_path(folder), mounting.unwrap_or_default(), stamps_ns);
        return Ok(Listing { depth_source, entries, report, calibration: None, ground_truth, notes: Vec::new() });
    }
    let text = read_text(&calib)?;
    let (p_left, p_right) = (projection(&text, left, &calib)?, projection(&text, right, &calib)?);
    let first = entries.first().and_then(|entry| Some(folder.join(entry.color.file()?)));
    let camera = camera(folder, &first, &p_left, &p_right, &stamps_ns)?;
    let camera = CameraSource::without_depth(camera, calib.display().to_string());
    check_camera(&camera)?;
    let calibration = Some(Calibration { camera, rectification: None, depth_resampling: None });
    let ground_truth = GroundTruthReader::kitti(ground_truth_path(folder), t_cam0_cam(&p_left), stamps_ns);
    Ok(Listing { depth_source, entries, report, calibration, ground_truth, notes: Vec::new() })
}

/// Reads the times of all frames, ns.
fn times(path: &Path) -> Result<Vec<i64>> {
    let text = read_text(path)?;
    let stamp = |(number, line): (usize, &str)| {
        parse_stamp_ns(line).map_err(|error| {
            Error::line(path, number, format!("'{line}' {error}"), "write seconds, such as 1.036224e-01, one per line")
        })
    };
    content_lines(&text).map(stamp).collect()
}

/// Returns the projection matrix of `camera` from `calib.txt`.
fn projection(text: &str, camera: usize, path: &Path) -> Result<Rows> {
    let found =
        content_lines(text).find_map(|(number, line)| Some((number, line.strip_prefix(&format!("P{camera}:"))?)));
    let cure = "use the original calib.txt of the sequence";
    let (number, line) = found.ok_or_else(|| Error::content(path, format!("the matrix P{camera} is missing"), cure))?;
    matrix(line).ok_or_else(|| Error::line(path, number, format!("P{camera} does not have 12 numbers"), cure))
}

fn matrix(line: &str) -> Option<Rows> {
    let numbers: Vec<f64> = line.split_whitespace().map_while(|word| word.parse().ok()).collect();
    <Rows>::try_from(numbers).ok().filter(|rows| rows.iter().all(|v| v.is_finite()))
}

fn camera(folder: &Path, first: &Option<PathBuf>, left: &Rows, right: &Rows, stamps_ns: &[i64]) -> Result<Camera> {
    let (mut bytes, mut image) = (Vec::new(), RgbImage::default());
    let path = first.as_deref().unwrap_or(folder);
    read_bytes(path, &mut bytes).map_err(|source| Error::read(path, source))?;
    decode_color(&bytes, None, &mut image)
        .map_err(|error| Error::content(path, error.to_string(), "unpack the sequence again"))?;
    let [fx, _, cx, of_left, _, fy, cy, ..] = *left;
    let span_s = stamps_ns.first().zip(stamps_ns.last()).map_or(0.0, |(first, last)| (last - first) as f64 * 1e-9);
    let fps = if span_s > 0.0 { (stamps_ns.len() - 1) as f64 / span_s } else { 10.0 };
    Ok(Camera::pinhole(image.width(), image.height(), fx, fy, cx, cy).with_fps(fps).with_bf(of_left - right[3]))
}

/// Returns the pose of a camera in the frame of camera 0, to which it is parallel: P = K [1 | t] with t = −position.
fn t_cam0_cam(p: &Rows) -> Isometry3<f64> {
    let [fx, _, cx, x, _, fy, cy, y, _, _, _, z] = *p;
    Isometry3::translation(-(x - cx * z) / fx, -(y - cy * z) / fy, -z)
}

/// Finds `groundtruth.txt` in `folder`, or `poses/NN.txt` beside the folder `sequences`, where the benchmark has it.
fn ground_truth_path(folder: &Path) -> Option<PathBuf> {
    let folder = folder.canonicalize().ok()?;
    let mut name = folder.file_name()?.to_owned();
    name.push(".txt");
    let beside = folder.parent()?.parent()?.join("poses").join(name);
    [folder.join("groundtruth.txt"), beside].into_iter().find(|path| path.is_file())
}

/// Returns whether `text` is a list of 3 × 4 matrices.
pub fn is_ground_truth(text: &str) -> bool {
    content_lines(text).next().is_some_and(|(_, line)| matrix(line).is_some())
}

/// Parses the poses of camera 0, one matrix per line and frame, and returns those of the camera.
pub fn parse_ground_truth(
    text: &str,
    path: &Path,
    t_cam0_cam: &Isometry3<f64>,
    stamps_ns: &[i64],
) -> Result<TrajectoryFile> {
    let lines: Vec<(usize, &str)> = content_lines(text).collect();
    if lines.len() != stamps_ns.len() {
        let problem = format!("holds {} poses, but times.txt has {} frames", lines.len(), stamps_ns.len());
        return Err(Error::content(path, problem, "use the poses of this sequence"));
    }
    let pose = |((number, line), &timestamp_ns): ((usize, &str), &i64)| {
        let bad = || Error::line(path, number, "is not the 3 × 4 matrix of a pose", "write its 12 numbers row by row");
        let m = matrix(line).ok_or_else(bad)?;
        let rotation = Matrix3::new(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]);
        let rotation = rotation::nearest_rotation(&rotation, rotation::OF_POSES).ok_or_else(bad)?;
        let translation = Translation3::from(Vector3::new(m[3], m[7], m[11]));
        Ok(StampedPose::new(timestamp_ns, Isometry3::from_parts(translation, rotation) * t_cam0_cam))
    };
    TrajectoryFile::from_poses(lines.into_iter().zip(stamps_ns).map(pose).collect::<Result<_>>()?, path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ground_truth_of_camera_0_is_converted_to_the_colour_camera() {
        // From sequence 00: camera 2 is 6 cm to the left of camera 0.
        let p2 = projection(
            "P2: 718.856 0.0 607.1928 45.38225 0.0 718.856 185.2157 -0.1130887 0.0 0.0 1.0 0.003779761\n",
            2,
            Path::new("calib.txt"),
        );
        let mount = t_cam0_cam(&p2.unwrap());
        assert!((mount.translation.x + 0.0599).abs() < 1e-3 && mount.translation.y.abs() < 2e-3);
        let text = "1 0 0 5 0 1 0 6 0 0 1 7\n1 0 0 5 0 1 0 6 0 0 1 8\n";
        let file = parse_ground_truth(text, Path::new("00.txt"), &mount, &[0, 100]).unwrap();
        assert!((file.poses[1].t_world_cam.translation.vector - Vector3::new(4.94, 6.0, 8.0)).norm() < 6e-3);
        let error = parse_ground_truth(text, Path::new("00.txt"), &mount, &[0]).unwrap_err().to_string();
        assert!(error.contains("holds 2 poses") && error.contains("1 frames"), "{error}");
        let error =
            parse_ground_truth("2 0 0 0 0 1 0 0 0 0 1 0", Path::new("00.txt"), &mount, &[0]).unwrap_err().to_string();
        assert!(error.contains("00.txt:1") && error.contains("3 × 4"), "{error}");
        let error = projection("P0: 1 2 3\n", 2, Path::new("calib.txt")).unwrap_err().to_string();
        assert!(error.contains("the matrix P2 is missing"), "{error}");
    }
}

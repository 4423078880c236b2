//! The EuRoC MAV data set in ASL format (Burri et al., "The EuRoC micro aerial vehicle datasets", IJRR 2016).
//!
//! In: a folder with `mav0/cam0/` and `cam1/` (`data.csv`, `data/`, `sensor.yaml`) and, optionally, the ground truth of the body in
//! `mav0/state_groundtruth_estimate0/data.csv`. Out: its frames, the calibration after rectification, the ground truth of the left
//! camera.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::{Isometry3, Matrix4, Quaternion, Translation3, UnitQuaternion};
use yfslam::Camera;
use yfslam::config::DepthSource;

use super::layout::{Calibration, Listing, stereo_or_mono};
use super::pairs::{List, from_lists};
use super::{GroundTruthReader, ListedImage, SequenceOptions};
use crate::camera::{CameraSource, check_camera};
use crate::error::{Error, Result};
use crate::rectify::{MountedCamera, StereoRectification};
use crate::rotation;
use crate::text::{content_lines, read_text};
use crate::time::parse_stamp_ns;
use crate::trajectory::{StampedPose, TrajectoryFile};

/// Returns the folder that holds `cam0`: `mav0` inside `folder`, or `folder` itself.
pub fn root(folder: &Path) -> Option<PathBuf> {
    [folder.join("mav0"), folder.to_owned()].into_iter().find(|root| root.join("cam0/data.csv").is_file())
}

/// Lists the frames of `folder`.
pub fn list(folder: &Path, options: &SequenceOptions) -> Result<Listing> {
    let root = root(folder).unwrap_or_else(|| folder.join("mav0"));
    let depth_source = stereo_or_mono(folder, options, root.join("cam1/data.csv").is_file())?;
    let is_stereo = depth_source == DepthSource::Stereo;
    let right = is_stereo.then(|| read_list(&root.join("cam1"))).transpose()?;
    let tolerance_ns = options.association_tolerance_ns;
    let (mut entries, report) = from_lists(folder, read_list(&root.join("cam0"))?, right, tolerance_ns)?;
    // Paths are relative to the folder of the whole sequence.
    let from_folder = |path: &Path| path.strip_prefix(folder).unwrap_or(path).to_owned();
    for entry in &mut entries {
        entry.color.map_file(from_folder);
        entry.paired_image.iter_mut().for_each(|paired| paired.image.map_file(from_folder));
    }
    let truth =
        ["state_groundtruth_estimate0", "mocap0", "leica0", "vicon0"].map(|name| root.join(name).join("data.csv"));
    let truth = truth.iter().find(|path| path.is_file()).unwrap_or(&truth[0]).clone();
    let yaml = root.join("cam0/sensor.yaml");
    if !options.read_calibration {
        // The images belong to the camera of the caller. Where the file cannot be read, the ground truth is that of the body.
        let t_body_cam = read_mounting(&yaml);
        let mut notes = Vec::new();
        if t_body_cam.is_none() && truth.is_file() {
            notes.push(format!(
                "the pose of the camera in {} cannot be read: the ground truth is that of the body",
                yaml.display()
            ));
        }
        let ground_truth = GroundTruthReader::euroc(truth, t_body_cam.unwrap_or_default());
        return Ok(Listing { depth_source, entries, report, calibration: None, ground_truth, notes });
    }
    if !yaml.is_file() && (root.join("mocap0").is_dir() || folder.join("dso").is_dir()) {
        let cure =
            "undistort the images to those of a pinhole camera and give --camera, with --sensor mono for one camera";
        return Err(Error::content(folder, "is a sequence of TUM-VI, whose fisheye cameras are not supported", cure));
    }
    let left = read_camera(&yaml)?;
    let (calibration, t_body_cam) = if is_stereo {
        let right = read_camera(&root.join("cam1/sensor.yaml"))?;
        let rectification = StereoRectification::new(&left, &right)
            .map_err(|problem| Error::content(&yaml, problem, "check T_BS of cam0 and cam1"))?;
        let camera = rectification.camera.clone();
        check_camera(&CameraSource::without_depth(camera.clone(), yaml.display().to_string()))?;
        let t_body_cam = left.t_body_cam * rectification.t_left_rectified();
        (calibration(camera, &yaml, Some(Arc::new(rectification))), t_body_cam)
    } else {
        (calibration(left.camera, &yaml, None), left.t_body_cam)
    };
    let ground_truth = GroundTruthReader::euroc(truth, t_body_cam);
    Ok(Listing { depth_source, entries, report, calibration: Some(calibration), ground_truth, notes: Vec::new() })
}

/// Returns the pose of the camera in the body frame, if the file holds one.
fn read_mounting(yaml: &Path) -> Option<Isometry3<f64>> {
    let text = read_text(yaml).ok()?;
    rigid_motion(numbers(&text, "data", yaml).ok()?.try_into().ok()?)
}

fn calibration(camera: Camera, yaml: &Path, rectification: Option<Arc<StereoRectification>>) -> Calibration {
    let origin = format!("{}{}", yaml.display(), if rectification.is_some() { ", rectified with cam1" } else { "" });
    Calibration { camera: CameraSource::without_depth(camera, origin), rectification, depth_resampling: None }
}

/// Lists the images of a camera.
fn read_list(camera: &Path) -> Result<List> {
    let path = camera.join("data.csv");
    let text = read_text(&path)?;
    let image = |(number, line): (usize, &str)| {
        let columns = line.split_once(',').map(|(stamp, name)| (stamp.trim(), name.trim()));
        let Some((stamp, name)) = columns.filter(|(_, name)| !name.is_empty()) else {
            let cure = "write 'nanoseconds,file', such as '1403636579763555584,1403636579763555584.png'";
            return Err(Error::line(&path, number, format!("'{line}' has another form"), cure));
        };
        Ok(ListedImage { stamp_ns: nanoseconds(stamp, &path, number)?, image: camera.join("data").join(name).into() })
    };
    let images = content_lines(&text).map(image).collect::<Result<_>>()?;
    Ok(List { images, unstamped: 0, path })
}

fn nanoseconds(text: &str, path: &Path, number: usize) -> Result<i64> {
    parse_stamp_ns(&format!("{text}e-9")).map_err(|error| {
        let cure = "write the time in nanoseconds, such as 1403636579763555584";
        Error::line(path, number, format!("stamp '{text}' {error}"), cure)
    })
}

/// Reads a `sensor.yaml`.
fn read_camera(path: &Path) -> Result<MountedCamera> {
    let text = read_text(path)?;
    let lists = |key| numbers(&text, key, path);
    for (key, known) in [("camera_model", "pinhole"), ("distortion_model", "radial-tangential")] {
        let found = text.lines().find_map(|line| line.trim().strip_prefix(key)?.trim().strip_prefix(':'));
        let found = found.map(|value| value.split('#').next().unwrap_or_default().trim());
        if let Some(other) = found.filter(|value| *value != known) {
            let cure = format!("only {known} is supported: undistort the images and give --camera");
            return Err(Error::content(path, format!("{key} is '{other}'"), cure));
        }
    }
    let [width, height] = exactly(lists("resolution")?, "resolution", path)?;
    let [fx, fy, cx, cy] = exactly(lists("intrinsics")?, "intrinsics", path)?;
    let [k1, k2, p1, p2] = exactly(lists("distortion_coefficients")?, "distortion_coefficients", path)?;
    let t_body_cam = rigid_motion(exactly(lists("data")?, "T_BS: data", path)?)
        .ok_or_else(|| Error::content(path, "T_BS is not a rigid motion", "calibrate the cameras again"))?;
    let fps = lists("rate_hz").ok().and_then(|rate| rate.first().copied()).unwrap_or(20.0);
    let distortion = [k1, k2, p1, p2, 0.0];
    let (width, height) = (width as usize, height as usize);
    let camera = Camera::pinhole(width, height, fx, fy, cx, cy).with_distortion(distortion).with_fps(fps).with_bf(fx);
    let source = CameraSource::without_depth(camera, path.display().to_string());
    check_camera(&source)?;
    Ok(MountedCamera { camera: source.camera, t_body_cam })
}

/// Returns the numbers after `key:`, one or a list in brackets, which may extend over several lines.
fn numbers(text: &str, key: &str, path: &Path) -> Result<Vec<f64>> {
    let missing =
        || Error::content(path, format!("the key {key} is missing"), "use the original sensor.yaml of the data set");
    let at = text.lines().find_map(|line| {
        let value = line.trim_start().strip_prefix(key)?.trim_start().strip_prefix(':')?;
        Some(value.as_ptr() as usize - text.as_ptr() as usize)
    });
    let rest = text.get(at.ok_or_else(missing)?..).unwrap_or_default();
    let line = rest.lines().next().unwrap_or_default();
    let whole = if line.trim_start().starts_with('[') { rest.split(']').next().unwrap_or_default() } else { line };
    let without_comments: Vec<&str> = whole.lines().map(|line| line.split('#').next().unwrap_or_default()).collect();
    let joined = without_comments.join(" ");
    let words = joined.split(|c: char| c.is_whitespace() || "[],".contains(c)).filter(|word| !word.is_empty());
    let number = |word: &str| match word.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(Error::content(path, format!("{key} is '{word}', not a number"), "write it with a decimal point")),
    };
    words.map(number).collect()
}

fn exactly<const N: usize>(numbers: Vec<f64>, key: &str, path: &Path) -> Result<[f64; N]> {
    let found = numbers.len();
    let cure = "use the original sensor.yaml of the data set";
    numbers.try_into().map_err(|_| Error::content(path, format!("{key} has {found} numbers, not {N}"), cure))
}

/// Converts a row-major matrix into a rigid motion; `None` if it is not one.
fn rigid_motion(rows: [f64; 16]) -> Option<Isometry3<f64>> {
    let matrix = Matrix4::from_row_slice(&rows);
    let rotation = rotation::nearest_rotation(&matrix.fixed_view::<3, 3>(0, 0).into(), rotation::OF_CALIBRATIONS)?;
    Some(Isometry3::from_parts(Translation3::new(matrix[(0, 3)], matrix[(1, 3)], matrix[(2, 3)]), rotation))
}

/// Parses poses of the body, `nanoseconds, px, py, pz, qw, qx, qy, qz, …` on each line, and returns those of the camera.
pub fn parse_ground_truth(text: &str, path: &Path, t_body_cam: &Isometry3<f64>) -> Result<TrajectoryFile> {
    let pose = |(number, line): (usize, &str)| {
        let cure = "write 'nanoseconds,px,py,pz,qw,qx,qy,qz', optionally followed by more columns";
        let mut columns = line.split(',').map(str::trim);
        let timestamp_ns = nanoseconds(columns.next().unwrap_or_default(), path, number)?;
        let values: Vec<f64> =
            columns.take(7).map_while(|text| text.parse().ok().filter(|v: &f64| v.is_finite())).collect();
        let [x, y, z, qw, qx, qy, qz] = values[..] else {
            return Err(Error::line(
                path,
                number,
                format!("'{line}' does not have seven numbers after the time"),
                cure,
            ));
        };
        let quaternion = Quaternion::new(qw, qx, qy, qz);
        if (quaternion.norm() - 1.0).abs() > 0.05 {
            return Err(Error::line(
                path,
                number,
                format!("quaternion of length {:.3}, not 1", quaternion.norm()),
                cure,
            ));
        }
        let rotation = UnitQuaternion::from_quaternion(quaternion);
        let t_world_body = Isometry3::from_parts(Translation3::new(x, y, z), rotation);
        Ok(StampedPose::new(timestamp_ns, t_world_body * t_body_cam))
    };
    TrajectoryFile::from_poses(content_lines(text).map(pose).collect::<Result<_>>()?, path)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file like those of the data set.
    const YAML: &str = "# General\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [0.0, -1.0, 0.0, -0.02,\n         1.0, 0.0, 0.0, \
        -0.06,\n         0.0, 0.0, 1.0, 0.009,\n         0.0, 0.0, 0.0, 1.0]\nrate_hz: 20\nresolution: [752, 480]\n\
        camera_model: pinhole\nintrinsics: [458.654, 457.296, 367.215, 248.375] #fu, fv, cu, cv\n\
        distortion_model: radial-tangential\ndistortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n";

    fn camera(text: &str) -> Result<MountedCamera> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sensor.yaml");
        std::fs::write(&path, text).unwrap();
        read_camera(&path)
    }

    #[test]
    fn a_sensor_file_is_read_and_errors_in_it_are_named() {
        let MountedCamera { camera: c, t_body_cam } = camera(YAML).unwrap();
        assert_eq!((c.width, c.height, c.fps, c.cy, c.distortion[3]), (752, 480, 20.0, 248.375, 1.76187114e-05));
        let right_of_camera = t_body_cam.rotation * nalgebra::Vector3::x();
        assert!((right_of_camera - nalgebra::Vector3::y()).norm() < 1e-12);
        assert_eq!(t_body_cam.translation.vector.z, 0.009);
        for (from, to, words) in [
            ("radial-tangential", "equidistant", ["distortion_model is 'equidistant'", "undistort"]),
            ("[752, 480]", "[752]", ["resolution has 1 numbers, not 2", "sensor.yaml"]),
            ("458.654", "four", ["intrinsics is 'four'", "decimal point"]),
            ("data: [0.0, -1.0", "data: [0.5, -1.0", ["T_BS is not a rigid motion", "calibrate"]),
            ("intrinsics:", "intrinsic:", ["the key intrinsics is missing", "original"]),
        ] {
            let error = camera(&YAML.replace(from, to)).unwrap_err().to_string();
            assert!(words.iter().all(|word| error.contains(word)), "{error}");
        }
    }

    #[test]
    fn the_ground_truth_of_the_body_is_converted_to_the_camera() {
        let t_body_cam = Isometry3::translation(0.0, 0.0, 2.0);
        let text = "#timestamp, p_RS_R_x [m], and so on\n1403636580838555648,4.0,-1.0,0.5,0.0,0.0,1.0,0.0,0.1,0.2\n";
        let file = parse_ground_truth(text, Path::new("data.csv"), &t_body_cam).unwrap();
        assert_eq!(file.poses[0].timestamp_ns, 1_403_636_580_838_555_648);
        // Half a turn about y: the camera's z points along the world's −z.
        assert!(
            (file.poses[0].t_world_cam.translation.vector - nalgebra::Vector3::new(4.0, -1.0, -1.5)).norm() < 1e-12
        );
        let error = parse_ground_truth("1,2,3\n", Path::new("data.csv"), &t_body_cam).unwrap_err().to_string();
        assert!(error.contains("data.csv:1") && error.contains("seven numbers"), "{error}");
    }
}

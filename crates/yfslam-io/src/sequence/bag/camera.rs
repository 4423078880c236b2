//! The camera of a recording in a bag, from its `CameraInfo`.

use std::sync::Arc;

use nalgebra::{Isometry3, Matrix3, Translation3};
use yfslam::Camera;
use yfslam::config::DepthSource;

use super::choose::{Chosen, ImageTopic, Survey};
use crate::bag::Bag;
use crate::camera::{CameraSource, check_camera};
use crate::error::{Error, Result};
use crate::message::METRES_UNITS;
use crate::message::types::CameraInfo;
use crate::rectify::{MountedCamera, StereoRectification};
use crate::rotation;
use crate::sequence::layout::Calibration;
use crate::sequence::{DEFAULT_FPS, SequenceOptions};

/// Units per metre of 16-bit depth images (REP 118: millimetres).
const MILLIMETRES: f64 = 1000.0;

/// Returns the calibration of the chosen topics; `None` if the bag has none.
pub fn calibration(
    bag: &Bag,
    survey: &Survey,
    chosen: &Chosen,
    options: &SequenceOptions,
    stamps_ns: &[i64],
) -> Result<Option<Calibration>> {
    let Some((name, info)) = info_of(bag, survey, &chosen.color, options.topics.camera_info.as_deref())? else {
        return Ok(None);
    };
    let refuse = |problem: String, cure: &str| Error::content(bag.path(), format!("{name}: {problem}"), cure);
    let refusal = |(problem, cure): Refusal| refuse(problem, cure);
    let fps = rate(stamps_ns).unwrap_or(DEFAULT_FPS);
    let is_rectified = shows_rectified(&chosen.color.name);
    let mut camera = camera_of(info, is_rectified).map_err(refusal)?.with_fps(fps);
    let size = chosen.color.head.size;
    if let Some(size) = size.filter(|size| (size.width, size.height) != (camera.width, camera.height)) {
        let problem = format!(
            "is for {}×{} pixels, but the images of {} have {size}",
            info.width, info.height, chosen.color.name
        );
        return Err(refuse(problem, "choose its calibration with --camera-info-topic, or give --camera"));
    }
    let origin = format!("{} {name}{}", bag.path().display(), if is_rectified { ", rectified" } else { "" });
    let mut rectification = None;
    let mut depth_factor = 1.0;
    match (chosen.depth_source, &chosen.paired) {
        (DepthSource::Image, Some(depth)) => {
            depth_factor = if depth.head.encoding.starts_with("32FC1") { METRES_UNITS } else { MILLIMETRES };
        }
        (DepthSource::Stereo, Some(right)) => {
            let cure = "give the calibration with --camera";
            let right = info_of(bag, survey, right, None)?.filter(|(other, _)| *other != name);
            let (_, right) = right.ok_or_else(|| refuse("there is none for the right camera".into(), cure))?;
            let baseline_px = info.p[3] - right.p[3];
            if !(baseline_px.is_finite() && baseline_px > 0.0) {
                let problem =
                    format!("the projections of left and right have no baseline ({} and {})", info.p[3], right.p[3]);
                return Err(refuse(
                    problem,
                    "exchange the topics if they are swapped, or give the calibration with --camera",
                ));
            }
            if is_rectified {
                camera = camera.with_bf(baseline_px);
            } else {
                let right_camera = camera_of(right, false).map_err(refusal)?.with_fps(fps);
                let mounted = |camera: Camera, info: &CameraInfo, x_m: f64| {
                    let no_rotation = || refuse(format!("R is no rotation ({:?})", info.r), "calibrate the pair again");
                    Ok(MountedCamera { camera, t_body_cam: mount(info, x_m).ok_or_else(no_rotation)? })
                };
                let left = mounted(camera, info, 0.0)?;
                let right = mounted(right_camera, right, baseline_px / info.p[0])?;
                let stereo = StereoRectification::new(&left, &right)
                    .map_err(|problem| refuse(problem, "check R and P of both calibrations"))?;
                camera = stereo.camera.clone();
                rectification = Some(Arc::new(stereo));
            }
        }
        _ => {}
    }
    let camera = CameraSource::new(camera, depth_factor, origin);
    check_camera(&camera)?;
    Ok(Some(Calibration { camera, rectification, depth_resampling: None }))
}

/// Returns the calibration that belongs to a topic of images, and the name of its topic.
fn info_of<'a>(
    bag: &Bag,
    survey: &'a Survey,
    image: &ImageTopic,
    named: Option<&str>,
) -> Result<Option<(&'a str, &'a CameraInfo)>> {
    let cameras = survey.cameras.iter().map(|(name, info)| (name.as_str(), info));
    let mut cameras: Vec<_> = cameras.collect();
    if let Some(named) = named {
        let found = cameras.iter().find(|(name, _)| *name == named).copied();
        let offered: Vec<&str> = cameras.iter().map(|(name, _)| *name).collect();
        return found.map(Some).ok_or_else(|| {
            let problem = format!("--camera-info-topic {named}: there is no such topic of CameraInfo");
            let cure =
                if offered.is_empty() { "give --camera".into() } else { format!("they are {}", offered.join(", ")) };
            Error::content(bag.path(), problem, cure)
        });
    }
    // The calibration has the longest part of its name in common with the images, such as /camera/color of /camera/color/image_raw.
    let common = |name: &str| name.split('/').zip(image.name.split('/')).take_while(|(a, b)| a == b).count();
    cameras.sort_by_key(|(name, info)| std::cmp::Reverse((common(name), info.frame_id == image.head.frame_id)));
    let best = cameras.first().copied();
    Ok(match cameras.as_slice() {
        [] => None,
        [_] => best,
        // Every name begins with the empty part before the first slash.
        _ => best.filter(|(name, info)| common(name) > 1 || info.frame_id == image.head.frame_id),
    })
}

/// Returns whether the images of a topic are rectified, by the names of `image_proc` and of RealSense cameras.
fn shows_rectified(topic: &str) -> bool {
    topic.contains("image_rect") || topic.contains("/rect/")
}

/// What is wrong with a calibration, and what to do.
type Refusal = (String, &'static str);

/// Returns the camera of a live topic of images.
///
/// # Errors
/// The calibration cannot be used, and what to do.
pub fn camera_of_topic(info: &CameraInfo, image_topic: &str) -> std::result::Result<Camera, String> {
    let camera =
        camera_of(info, shows_rectified(image_topic)).map_err(|(problem, cure)| format!("{problem}; {cure}"))?;
    let source = CameraSource::new(camera, MILLIMETRES, "camera_info");
    check_camera(&source).map_err(|error| error.to_string())?;
    Ok(source.camera)
}

/// Converts a calibration for images as they are, or for rectified ones.
fn camera_of(info: &CameraInfo, is_rectified: bool) -> std::result::Result<Camera, Refusal> {
    let (width, height) = (info.width as usize, info.height as usize);
    if info.binning.iter().any(|&binning| binning > 1) {
        let problem = format!("binning is {:?}, which changes the image", info.binning);
        return Err((problem, "record without binning, or give the calibration of the images with --camera"));
    }
    let [x, y, roi_height, roi_width] = info.roi;
    if (x, y) != (0, 0) || (roi_width != 0 && roi_width != info.width) || (roi_height != 0 && roi_height != info.height)
    {
        let problem = format!("roi is {roi_width}×{roi_height} at {x}, {y}, which changes the image");
        return Err((problem, "record whole images, or give the calibration of the images with --camera"));
    }
    if is_rectified {
        let [fx, _, cx, _, _, fy, cy, ..] = info.p;
        return Ok(Camera::pinhole(width, height, fx, fy, cx, cy));
    }
    let [fx, _, cx, _, fy, cy, ..] = info.k;
    if fx == 0.0 {
        return Err(("K is all zeros: the camera was not calibrated".into(), "give the calibration with --camera"));
    }
    let (distortion, rational) = distortion(info)?;
    let camera = Camera::pinhole(width, height, fx, fy, cx, cy);
    let mut camera = camera.with_distortion(distortion);
    camera.rational = rational;
    Ok(camera)
}

/// Returns k1, k2, p1, p2, k3, and k4, k5, k6 of the rational model.
fn distortion(info: &CameraInfo) -> std::result::Result<([f64; 5], [f64; 3]), Refusal> {
    let model = info.distortion_model.as_str();
    if info.d.iter().all(|&d| d == 0.0) {
        return Ok(([0.0; 5], [0.0; 3]));
    }
    match model {
        "plumb_bob" | "radtan" | "rational_polynomial" | "Brown Conrady" | "" => {}
        "equidistant" | "fisheye" | "kannala_brandt" => {
            let cure = "record rectified images (image_proc, topic image_rect), or undistort them and give --camera";
            return Err((format!("the distortion model '{model}' of fisheye lenses is not supported"), cure));
        }
        _ => {
            let cure = "record rectified images (image_proc, topic image_rect), or give --camera";
            return Err((format!("the distortion model '{model}' is not supported"), cure));
        }
    }
    let parameter = |index: usize| info.d.get(index).copied().unwrap_or(0.0);
    if info.d.iter().skip(8).any(|&d| d != 0.0) {
        let problem = format!("D has {} parameters, of which 8 are supported", info.d.len());
        return Err((problem, "record rectified images (image_proc, topic image_rect)"));
    }
    Ok(([0, 1, 2, 3, 4].map(parameter), [5, 6, 7].map(parameter)))
}

/// Returns the pose of a camera in the frame of the rectified left camera, if R is a rotation; `x_m` is where it is on the baseline.
fn mount(info: &CameraInfo, x_m: f64) -> Option<Isometry3<f64>> {
    // R turns from the camera to the rectified camera.
    let rotation = rotation::nearest_rotation(&Matrix3::from_row_slice(&info.r), rotation::OF_CALIBRATIONS)?;
    Some(Isometry3::from_parts(Translation3::new(x_m, 0.0, 0.0), rotation))
}

/// Returns the median rate of time stamps, frames per second.
fn rate(stamps_ns: &[i64]) -> Option<f64> {
    let mut periods: Vec<i64> = stamps_ns.windows(2).filter_map(|w| w.last()?.checked_sub(*w.first()?)).collect();
    let middle = periods.len() / 2;
    let median = (!periods.is_empty()).then(|| *periods.select_nth_unstable(middle).1)?;
    Some(1e9 / median as f64).filter(|rate| (0.01..=10_000.0).contains(rate))
}

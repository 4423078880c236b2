//! `yfslam camera`: shows how a camera file is understood.

use anyhow::Result;
use clap::Args;
use yfslam_io::camera::{CameraSource, camera_toml, check_camera};
use yfslam_io::load_camera;

use crate::ui::terminal::print;

const HELP: &str = "\
Examples:
  yfslam camera TUM1.yaml                              settings of ORB-SLAM2 or 3, stella_vslam
  yfslam camera camera_info.yaml --depth-factor 1000   calibration of ROS
  yfslam camera tum1 > camera.toml                     a preset as a file";

/// Print how a camera file of any dialect is understood, as a camera file in TOML.
///
/// Understood are TOML, settings of ORB-SLAM2, ORB-SLAM3 and stella_vslam, the camchain of Kalibr, camera_info of ROS, sensor.yaml of
/// EuRoC, calibrations of OpenCV and VINS, JSON of Open3D, calib.txt of KITTI, calibration.txt of ETH3D and cameras.txt of COLMAP.
#[derive(Args, Debug)]
#[command(after_help = HELP)]
pub struct CameraArgs {
    /// Camera file, or the name of a preset.
    #[arg(value_name = "FILE|PRESET")]
    camera: String,
    /// Depth units per metre, instead of those of the file.
    #[arg(long, value_name = "F")]
    depth_factor: Option<f64>,
}

pub fn run(args: &CameraArgs) -> Result<()> {
    let mut source = load_camera(&args.camera, None)?;
    if let Some(factor) = args.depth_factor {
        source.set_depth_factor(factor);
        check_camera(&source)?;
    }
    print(&text(&source)?)
}

/// Returns the file; what is not known is a comment.
fn text(source: &CameraSource) -> Result<String> {
    let CameraSource { camera, depth_factor, origin, kind, unused_keys, notes, missing, right, .. } = source;
    let mut about = format!("From {origin} ({kind}).\n");
    for note in notes {
        about += &format!("Note: {note}.\n");
    }
    if let Some(right) = right {
        about +=
            &format!("{} describes a second camera; the images of both are rectified when they are read.\n", right.key);
    } else if let Some(problem) = &missing.stereo_problem {
        about += &format!("Not for stereo: {problem}.\n");
    }
    if !unused_keys.is_empty() {
        about += &format!("Keys that are not used: {}.\n", unused_keys.join(", "));
    }
    let toml = camera_toml(camera, *depth_factor, &about)?;
    let unknown = |line: &str| match line.split(" = ").next() {
        Some("width" | "height") if missing.size => {
            Some("# The size of the images is not in the file; that of the first image is used.")
        }
        Some("depth_factor") if missing.depth_factor => {
            Some("# depth_factor is not in the file; RGB-D recordings need it, or --depth-factor.")
        }
        Some("bf") if missing.baseline => {
            Some("# bf (baseline in m times fx) is not in the file; stereo cameras need it.")
        }
        _ => None,
    };
    let mut lines: Vec<&str> = toml.lines().map(|line| unknown(line).unwrap_or(line)).collect();
    lines.dedup();
    Ok(lines.join("\n") + "\n")
}

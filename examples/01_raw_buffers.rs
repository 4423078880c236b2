//! The least program: buffers of a camera in, poses out.
//!
//! `cargo run --release -p yfslam-examples --example 01_raw_buffers`
#![allow(clippy::print_stdout, reason = "an example prints")]

use yfslam::{Camera, DepthImage, Frame, RgbImage, Slam};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut slam = Slam::builder(Camera::pinhole(640, 480, 800.0, 800.0, 319.5, 239.5)).build()?;
    for index in 0..30 {
        let (color_bytes, depth_mm) = camera_buffers(index);
        let color = RgbImage::from_rgb8(&color_bytes, 640, 480, 3 * 640)?;
        let depth = DepthImage::from_u16(&depth_mm, 640, 480, 640, 0.001)?;
        let tracked = slam.track(&Frame::rgbd(index as i64 * 33_333_333, color, depth))?;
        if let Some(pose) = tracked.t_world_cam {
            let [x, y, z] = pose.translation.vector.into();
            println!("frame {index}: at {x:.3} {y:.3} {z:.3} m, {} landmarks", tracked.inliers);
        }
    }
    Ok(())
}

/// Stands in the place of a camera: a wall of random squares, 2 m away; the camera moves 1 cm to the right with each frame.
fn camera_buffers(index: usize) -> (Vec<u8>, Vec<u16>) {
    let gray = |i: usize| {
        let square = ((i % 640 + 4 * index) / 9 * 7919 + i / 640 / 9 * 104_729) as u32;
        let mixed = (square ^ square >> 7).wrapping_mul(2_654_435_761);
        (mixed ^ mixed >> 15).wrapping_mul(2_246_822_519).to_be_bytes()[0]
    };
    ((0..640 * 480).flat_map(|i| [gray(i); 3]).collect(), vec![2000; 640 * 480])
}

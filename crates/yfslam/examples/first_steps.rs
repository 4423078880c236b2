//! The least program: a camera, a system, frames in, poses out.
//!
//! cargo run --release -p yfslam --example first_steps

use std::error::Error;
use std::io::Write;
use std::sync::Arc;

use yfslam::image::{DepthImage, Image, RgbImage};
use yfslam::{Camera, Config, Detection, RgbdFrame, Slam};

const WIDTH: usize = 640;
const HEIGHT: usize = 480;

/// A wall of random fields, 2 m away, seen by a camera that slides 1 cm to the right with each frame (4 px at this focal length).
fn wall(index: usize) -> (RgbImage, DepthImage) {
    let mut color = RgbImage::new(WIDTH, HEIGHT);
    for (i, pixel) in color.data_mut().iter_mut().enumerate() {
        let field = ((i % WIDTH + 4 * index) / 9 * 7919 + i / WIDTH / 9 * 104_729) as u32;
        let mixed = (field ^ field >> 7).wrapping_mul(2_654_435_761);
        *pixel = [(mixed ^ mixed >> 15).wrapping_mul(2_246_822_519).to_be_bytes()[0]; 3];
    }
    let mut raw = Image::new(WIDTH, HEIGHT);
    raw.data_mut().fill(2000u16);
    (color, DepthImage { raw, metres_per_unit: 0.001 })
}

fn main() -> Result<(), Box<dyn Error>> {
    let camera = Camera {
        width: WIDTH,
        height: HEIGHT,
        fx: 800.0,
        fy: 800.0,
        cx: 319.5,
        cy: 239.5,
        distortion: [0.0; 5],
        depth_factor: 1000.0,
        fps: 30.0,
        bf: 40.0,
    };
    // With a detector (crate yfslam-detect) in place of `None`, boxes are found in the picture.
    let mut slam = Slam::new(Config::default(), &camera, None)?;
    for index in 0..30 {
        let (color, depth) = wall(index);
        // Boxes that you know already go with the frame; an empty list says that nobody is there.
        let nobody: Vec<Detection> = Vec::new();
        let frame = RgbdFrame {
            timestamp_ns: index as i64 * 33_333_333,
            color: Arc::new(color),
            depth: Arc::new(depth),
            right: None,
            detections: Some(nobody),
            mask: None,
        };
        let tracked = slam.track(&frame)?;
        if let Some(pose) = tracked.t_world_cam {
            let [x, y, z] = pose.translation.vector.into();
            writeln!(std::io::stdout(), "frame {index}: at {x:.3} {y:.3} {z:.3} m, {} landmarks", tracked.inliers)?;
        }
    }
    Ok(())
}

//! A dense map while driving: after each keyframe the grid for navigation, at the end a point cloud.
//!
//! `cargo run --release -p yfslam-examples --example 06_live_dense_map`
#![allow(clippy::print_stdout, reason = "an example prints")]

use yfslam::Slam;
use yfslam::dense::{DenseConfig, GridCell};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (camera, frames) = yfslam_examples::rendered("walking_xyz?frames=60")?;
    let mut slam = Slam::builder(camera).dense(DenseConfig::default()).build()?;
    for (index, frame) in frames.iter().enumerate() {
        if slam.track(frame)?.is_keyframe {
            // Obstacles between half a metre below and half a metre above the camera.
            let grid = slam.dense()?.ground_grid([-0.5, 0.5]);
            let occupied = grid.cells.iter().filter(|cell| **cell == GridCell::Occupied).count();
            println!("frame {index}: grid of {} × {} cells, {occupied} occupied", grid.width, grid.height);
        }
    }
    println!("{} points", slam.dense()?.cloud().len());
    Ok(())
}

//! A dynamic filter of your own, in the place of those of the library.
//!
//! `cargo run --release -p yfslam-examples --example 05_own_filter`
#![allow(clippy::print_stdout, reason = "an example prints")]

use yfslam::config::DynamicConfig;
use yfslam::{DynamicFilter, FilterInput, FrameFeatures, Slam};

/// Drops what is nearer than a distance: for a robot whose own arm is in the image, say.
struct NearFilter {
    limit_m: f32,
}

impl DynamicFilter for NearFilter {
    fn before_pose(&mut self, _config: &DynamicConfig, _input: &FilterInput<'_>, features: &mut FrameFeatures) {
        for feature in &mut features.features {
            if feature.depth_m.is_some_and(|depth| depth < self.limit_m) {
                feature.trust = 0.0;
            }
        }
    }

    fn needs_boxes(&self) -> bool {
        false
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (camera, frames) = yfslam_examples::rendered("sitting_xyz?frames=20")?;
    let mut slam = Slam::builder(camera).filter(NearFilter { limit_m: 1.5 }).build()?;
    for frame in &frames {
        let tracked = slam.track(frame)?;
        let dropped = slam.features().iter().filter(|feature| feature.trust == 0.0).count();
        println!("{:?}: {} landmarks, {dropped} features dropped", tracked.state, tracked.inliers);
    }
    Ok(())
}

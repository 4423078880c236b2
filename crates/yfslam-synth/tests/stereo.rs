//! Accuracy of the depths that the core computes from rendered stereo pairs.
#![allow(clippy::unwrap_used, reason = "a test may")]

use yfslam::config::DepthSource;
use yfslam::{Config, Method, Slam};
use yfslam_synth::World;

/// Returns the errors of the disparities of all features on smooth surfaces, px of their level, and the share of features that have
/// one.
fn disparity_errors(spec: &str, frames: impl Iterator<Item = usize>) -> (Vec<f64>, f64) {
    let world = World::new(&yfslam_synth::parse(spec).unwrap()).unwrap();
    let camera = &world.config().camera;
    let mut config = Config::default();
    config.depth.source = DepthSource::Stereo;
    config.dynamic.method = Method::None;
    let scale_factor = f64::from(config.features.scale_factor);
    let mut slam = Slam::builder(camera.clone()).config(config).build().unwrap();
    let (mut errors, mut all) = (Vec::new(), 0);
    for index in frames {
        let shot = world.frame(index);
        slam.track(&shot.frame).unwrap();
        let features = slam.features();
        all += features.len();
        for f in features {
            let Some(depth_m) = f.depth_m else { continue };
            let (x, y) = ((f.raw[0] + 0.5) as usize, (f.raw[1] + 0.5) as usize);
            // The surfaces within two pixels: a corner on an edge may belong to any of them.
            let around =
                (0..25).filter_map(|k| shot.exact_depth.get((x + k % 5).checked_sub(2)?, (y + k / 5).checked_sub(2)?));
            let error = |z: &f32| camera.bf / f64::from(depth_m) - camera.bf / f64::from(*z);
            let error = around.filter(|z| **z > 0.0).map(error).min_by(|a, b| a.abs().total_cmp(&b.abs()));
            errors.extend(error.map(|e| e / scale_factor.powi(f.octave.into())));
        }
    }
    let share = errors.len() as f64 / all as f64;
    (errors, share)
}

#[test]
fn two_of_three_features_have_their_depth_to_a_tenth_of_a_pixel_of_their_level() {
    for spec in ["walking_xyz?people=1&stereo=0.11", "corridor_loop?people=0&stereo=0.11"] {
        let (errors, share) = disparity_errors(spec, (0..150).step_by(15));
        let mut absolute: Vec<f64> = errors.iter().map(|e| e.abs()).collect();
        absolute.sort_by(f64::total_cmp);
        let wrong = absolute.iter().filter(|e| **e > 2.0).count() as f64 / errors.len() as f64;
        let median = absolute[errors.len() / 2];
        let bias = errors.iter().filter(|e| e.abs() <= 2.0).sum::<f64>() / errors.len() as f64;
        println!("{spec}: {share:.3} have a depth, {wrong:.4} of them wrong, median {median:.3} px, bias {bias:.3} px");
        assert!(share > 0.66 && wrong < 0.04 && median < 0.1 && bias.abs() < 0.03);
    }
}

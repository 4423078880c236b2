//! A detector of your own: anything that finds boxes in a colour image.
//!
//! `cargo run --release -p yfslam-examples --example 04_own_detector`
#![allow(clippy::print_stdout, reason = "an example prints")]

use yfslam::{BoundingBox, Config, Detection, Detector, DetectorError, RgbImage, Slam};

/// Finds the bounding box of all pixels of a colour: people in yellow vests, say.
struct VestDetector {
    classes: [String; 1],
}

impl Detector for VestDetector {
    fn class_names(&self) -> &[String] {
        &self.classes
    }

    fn detect(&mut self, image: &RgbImage, out: &mut Vec<Detection>) -> Result<(), DetectorError> {
        out.clear();
        let is_yellow = |[r, g, b]: [u8; 3]| r > 150 && g > 120 && b < 80;
        let (mut bbox, mut pixels) = (None::<BoundingBox>, 0);
        for (index, pixel) in image.data().iter().enumerate().filter(|(_, pixel)| is_yellow(**pixel)) {
            let (x, y) = ((index % image.width()) as f32, (index / image.width()) as f32);
            let b = bbox.get_or_insert(BoundingBox { x_min: x, y_min: y, x_max: x, y_max: y });
            (b.x_min, b.x_max, b.y_max) = (b.x_min.min(x), b.x_max.max(x + 1.0), y + 1.0);
            pixels += usize::from(pixel[0] > 0);
        }
        out.extend(bbox.filter(|_| pixels > 50).map(|bbox| Detection { class: 0, score: 0.9, bbox }));
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (camera, frames) = yfslam_examples::rendered("walking_xyz?frames=30&seed=3")?;
    let mut config = Config::default();
    config.dynamic.movable = vec!["vest".to_owned()];
    let detector = VestDetector { classes: ["vest".to_owned()] };
    let mut slam = Slam::builder(camera).config(config).detector(detector).build()?;
    for frame in &frames {
        let tracked = slam.track(frame)?;
        let dropped = slam.features().iter().filter(|feature| feature.trust == 0.0).count();
        println!("{:?}: {} boxes, {dropped} features dropped", tracked.state, slam.detections().len());
    }
    Ok(())
}

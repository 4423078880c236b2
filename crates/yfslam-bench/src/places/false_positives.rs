//! Places that are not in the map: whether they are taken for places that are.

use anyhow::Result;
use yfslam::image::RgbImage;
use yfslam::map::persist::decode;
use yfslam::{Config, MapUse, RgbdFrame};
use yfslam_eval::{AlignmentKind, StampedPose, align, associate};

use super::loaded_sequence::Film;

/// Frames from one that is sought to the next.
const STEP: usize = 4;
/// A pose is wrong if it is that far from the truth, m and degrees.
const WRONG_BEYOND: (f64, f64) = (0.3, 10.0);

/// Prints a line for each sequence.
pub fn table(config: &Config, mapped: f64, films: impl Iterator<Item = Result<Film>>) -> Result<()> {
    println!(
        "| sequence | frames mapped | sought: mapped ones | found | wrong | sought: later ones | found right | wrong |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for film in films {
        let film = film?;
        let (slam, known) = film.mapped(config, mapped)?;
        let estimate: Vec<_> = slam.trajectory().iter().map(|(t, pose)| StampedPose::new(*t, *pose)).collect();
        let truth: Vec<_> = (0..film.len())
            .filter_map(|shown| Some(StampedPose::new(film.stamp_ns(shown), film.truth_at(film.stamp_ns(shown))?)))
            .collect();
        let alignment = align(&associate(&truth, &estimate, 0)?, AlignmentKind::Se3)?;
        let mut slam = film.slam(config)?.with_map(decode(&slam.save_map()?)?, MapUse::Localise)?;
        let mut counts = [[0usize; 3]; 2];
        for (number, frame) in (0..film.len()).step_by(STEP).enumerate() {
            let counts = &mut counts[usize::from(frame >= known)];
            counts[0] += 1;
            let timestamp_ns = 2 * number as i64 * film.period_ns();
            let tracked = slam.track(&RgbdFrame { timestamp_ns, ..film.show(frame) })?;
            if let (Some(pose), Some(truth)) = (tracked.t_world_cam, film.truth_at(film.stamp_ns(frame))) {
                let found = alignment.apply(&StampedPose::new(0, pose)).t_world_cam;
                let error = truth.inverse() * found;
                let (m, deg) = (error.translation.vector.norm(), error.rotation.angle().to_degrees());
                let wrong = m > WRONG_BEYOND.0 || deg > WRONG_BEYOND.1;
                counts[1 + usize::from(wrong)] += 1;
                if wrong {
                    eprintln!("{}: frame {frame}: {m:.2} m, {deg:.1} deg off, {} inliers", film.name, tracked.inliers);
                }
            }
            // A dark picture, so that the next one is sought anew.
            let dark = RgbImage::new(film.camera.width, film.camera.height);
            slam.track(&RgbdFrame {
                timestamp_ns: timestamp_ns + film.period_ns(),
                color: dark.into(),
                ..film.show(frame)
            })?;
        }
        let [[a, b, c], [d, e, f]] = counts;
        println!("| {} | {known} | {a} | {b} | {c} | {d} | {e} | {f} |", film.name);
    }
    Ok(())
}

//! Relocalisation in places that are not in the map: how often they are taken for places that are.

use anyhow::Result;
use yfslam::{Config, MapUse, RgbImage, SavedMap};
use yfslam_eval::{AlignmentKind, StampedPose, align, associate};

use super::sequence::LoadedSequence;
use super::{is_wrong, size};
use crate::row::Row;

/// Number of frames from one that is relocalised to the next.
const STEP: usize = 4;

/// Frames that were relocalised.
#[derive(Default)]
struct Counts {
    tried: usize,
    right: usize,
    wrong: usize,
}

/// One row for each sequence: its first part is mapped, every few frames of all of it are relocalised, each for itself.
pub fn measure(
    config: &Config,
    mapped: f64,
    sequences: impl Iterator<Item = Result<LoadedSequence>>,
) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for sequence in sequences {
        let sequence = sequence?;
        let (mut slam, mapped) = sequence.mapped(config, mapped)?;
        let estimate: Vec<_> = slam.trajectory().iter().map(|(t, pose)| StampedPose::new(*t, *pose)).collect();
        let true_pose = |played| {
            let timestamp_ns = sequence.stamp_ns(played);
            Some(StampedPose::new(timestamp_ns, sequence.true_pose_at(timestamp_ns)?))
        };
        let truth: Vec<_> = (0..sequence.len()).filter_map(true_pose).collect();
        let alignment = align(&associate(&truth, &estimate, 0)?, AlignmentKind::Se3)?;
        let saved = SavedMap::from_bytes(&slam.save_map()?)?;
        let mut slam = sequence.builder(config).map(saved, MapUse::Localise).build()?;
        let [mut inside, mut later] = [Counts::default(), Counts::default()];
        for (number, frame) in (0..sequence.len()).step_by(STEP).enumerate() {
            let counts = if frame < mapped { &mut inside } else { &mut later };
            counts.tried += 1;
            let timestamp_ns = 2 * number as i64 * sequence.period_ns();
            let mut played = sequence.play(frame);
            played.timestamp_ns = timestamp_ns;
            let tracked = slam.track(&played)?;
            if let (Some(pose), Some(truth)) = (tracked.t_world_cam, sequence.true_pose_at(sequence.stamp_ns(frame))) {
                let estimated = alignment.apply(&StampedPose::new(0, pose)).t_world_cam;
                let error = size(&(truth.inverse() * estimated));
                if is_wrong(error) {
                    counts.wrong += 1;
                    eprintln!("{}: frame {frame}: {error:?} (m, °) off, {} inliers", sequence.name, tracked.inliers);
                } else {
                    counts.right += 1;
                }
            }
            // A dark image, so that the next frame is relocalised and not tracked.
            let dark = RgbImage::new(sequence.camera.width, sequence.camera.height);
            played.timestamp_ns += sequence.period_ns();
            played.color = dark.into();
            slam.track(&played)?;
        }
        rows.push(
            Row::new()
                .case("sequence", &sequence.name)
                .figure("frames_mapped", mapped)
                .figure("mapped_tried", inside.tried)
                .figure("mapped_right", inside.right)
                .figure("mapped_wrong", inside.wrong)
                .figure("later_tried", later.tried)
                .figure("later_right", later.right)
                .figure("later_wrong", later.wrong),
        );
    }
    Ok(rows)
}

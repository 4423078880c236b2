//! Places that are recognised without a single error: by the index of this project, and by a bag of words trained on the very map.

use std::time::Instant;

use anyhow::Result;
use yfslam::unstable::{Descriptor, PlaceProbe, descriptors_of};
use yfslam::{Config, KeyFrameId};

use super::bag_of_words::{Vocabulary, similarity};
use super::sequence::LoadedSequence;
use super::size;
use crate::row::Row;

/// Number of frames from one query to the next.
const STEP: usize = 4;
/// A keyframe shows the place of a frame if it is that near to it, m and degrees.
const SAME_PLACE: (f64, f64) = (1.5, 30.0);

/// The best candidate of a query: its score, and whether it shows the place.
type Best = Option<(f64, bool)>;

/// Two rows for each sequence: the first part is mapped, frames of the rest that show mapped places are the queries.
pub fn measure(
    config: &Config,
    mapped: f64,
    sequences: impl Iterator<Item = Result<LoadedSequence>>,
) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for sequence in sequences {
        let sequence = sequence?;
        let (slam, mapped) = sequence.mapped(config, mapped)?;
        let map = slam.map();
        let is_near = |id: KeyFrameId, stamp_ns: i64| {
            let keyframe = map.keyframe(id).and_then(|k| sequence.true_pose_at(k.timestamp_ns));
            keyframe.zip(sequence.true_pose_at(stamp_ns)).is_some_and(|(keyframe, frame)| {
                let (m, deg) = size(&(keyframe.inverse() * frame));
                m < SAME_PLACE.0 && deg < SAME_PLACE.1
            })
        };
        let images: Vec<Vec<Descriptor>> = map.keyframes().map(|(_, k)| descriptors_of(k)).collect();
        let vocabulary = Vocabulary::train(&images);
        let documents: Vec<_> =
            map.keyframes().zip(&images).map(|((id, _), image)| (id, vocabulary.words(image))).collect();
        let (mut ours, mut bag): (Vec<Best>, Vec<Best>) = (Vec::new(), Vec::new());
        let (mut ours_s, mut bag_s) = (0.0, 0.0);
        let mut probe = PlaceProbe::new(config, &sequence.camera, map);
        for played in (mapped..sequence.len()).step_by(STEP) {
            let stamp_ns = sequence.stamp_ns(played);
            if !map.keyframes().any(|(id, _)| is_near(id, stamp_ns)) {
                continue;
            }
            let descriptors = probe.extract(&sequence.play(played));
            let clock = Instant::now();
            let best = probe.best(map);
            ours_s += clock.elapsed().as_secs_f64();
            ours.push(best.map(|(keyframe, matches)| (matches as f64, is_near(keyframe, stamp_ns))));
            let clock = Instant::now();
            let query = vocabulary.words(&descriptors);
            let scored = documents.iter().map(|(id, document)| (similarity(&query, document), *id));
            let best = scored.max_by(|a, b| a.0.total_cmp(&b.0));
            bag_s += clock.elapsed().as_secs_f64();
            bag.push(best.map(|(score, id)| (score, is_near(id, stamp_ns))));
        }
        let bag_name = format!("bag of {} words", vocabulary.len());
        for (name, bests, seconds) in [("index without a vocabulary", &ours, ours_s), (&*bag_name, &bag, bag_s)] {
            let (right, certain) = count(bests);
            let share = |part: usize| part as f64 / bests.len().max(1) as f64;
            rows.push(
                Row::new()
                    .case("sequence", &sequence.name)
                    .case("recogniser", name)
                    .figure("keyframes", map.keyframe_count())
                    .figure("queries", bests.len())
                    .figure("right", share(right))
                    .figure("recall_without_error", share(certain))
                    .figure("ms_per_query", 1e3 * seconds / bests.len().max(1) as f64),
            );
        }
    }
    Ok(rows)
}

/// The number of right candidates, and of those among them that score higher than every wrong one.
fn count(bests: &[Best]) -> (usize, usize) {
    let highest_wrong =
        bests.iter().flatten().filter(|best| !best.1).map(|best| best.0).fold(f64::NEG_INFINITY, f64::max);
    let right = bests.iter().flatten().filter(|best| best.1);
    (right.clone().count(), right.filter(|best| best.0 > highest_wrong).count())
}

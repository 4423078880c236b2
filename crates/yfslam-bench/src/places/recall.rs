//! How many places are recognised without a single error: our recogniser, and a bag of words that was trained on the very map.

use std::time::Instant;

use anyhow::Result;
use yfslam::Config;
use yfslam::dynamic::Evidence;
use yfslam::features::{Descriptor, Features, FrameFeatures, OrbExtractor};
use yfslam::image::{GrayImage, gray_from_rgb};
use yfslam::loops::Recogniser;
use yfslam::map::KeyFrameId;
use yfslam::sensor::SensorModel;

use super::bag_of_words::{Vocabulary, likeness};
use super::loaded_sequence::Film;

/// Frames from one that is sought to the next.
const STEP: usize = 4;
/// A keyframe shows the place of a frame if it is that near to it, m and degrees.
const SAME_PLACE: (f64, f64) = (1.5, 30.0);

/// The best guess for a frame: how sure it is, and whether it is right.
type Guess = Option<(f64, bool)>;

/// Prints two lines for each sequence: the first part is mapped, the rest is sought in it.
pub fn table(config: &Config, mapped: f64, films: impl Iterator<Item = Result<Film>>) -> Result<()> {
    println!(
        "| sequence | keyframes | frames of a mapped place | recogniser | right at best | recall without an error | ms a frame |"
    );
    println!("|---|---|---|---|---|---|---|");
    for film in films {
        let film = film?;
        let (slam, known) = film.mapped(config, mapped)?;
        let map = slam.map();
        let is_near = |id: KeyFrameId, stamp_ns: i64| {
            let at = map.keyframe(id).and_then(|k| film.truth_at(k.timestamp_ns)).zip(film.truth_at(stamp_ns));
            at.is_some_and(|(keyframe, frame)| {
                let between = keyframe.inverse() * frame;
                let (m, deg) = (between.translation.vector.norm(), between.rotation.angle().to_degrees());
                m < SAME_PLACE.0 && deg < SAME_PLACE.1
            })
        };
        let mut recogniser = Recogniser::default();
        map.keyframes().for_each(|(id, _)| recogniser.learn(map, id));
        let pictures: Vec<Vec<Descriptor>> = map.keyframes().map(|(_, k)| trusted(&k.features)).collect();
        let vocabulary = Vocabulary::train(&pictures);
        let documents: Vec<_> =
            map.keyframes().zip(&pictures).map(|((id, _), picture)| (id, vocabulary.words(picture))).collect();
        let (mut ours, mut words): (Vec<Guess>, Vec<Guess>) = (Vec::new(), Vec::new());
        let (mut ours_s, mut words_s) = (0.0, 0.0);
        let mut eye = Eye::new(&film, config);
        for shown in (known..film.len()).step_by(STEP) {
            let stamp_ns = film.stamp_ns(shown);
            if !map.keyframes().any(|(id, _)| is_near(id, stamp_ns)) {
                continue;
            }
            let features = eye.look(&film, config, shown);
            let clock = Instant::now();
            let found = recogniser.candidates(&config.places, map, features, |_| true);
            ours_s += clock.elapsed().as_secs_f64();
            let best = found.first();
            ours.push(best.map(|best| (best.matches.len() as f64, is_near(best.keyframe, stamp_ns))));
            let clock = Instant::now();
            let query = vocabulary.words(&trusted(features));
            let scored = documents.iter().map(|(id, document)| (likeness(&query, document), *id));
            let best = scored.max_by(|a, b| a.0.total_cmp(&b.0));
            words_s += clock.elapsed().as_secs_f64();
            words.push(best.map(|(score, id)| (score, is_near(id, stamp_ns))));
        }
        let sought = ours.len();
        let bag = format!("bag of {} words", vocabulary.len());
        for (name, guesses, seconds) in [("ours, no vocabulary", &ours, ours_s), (bag.as_str(), &words, words_s)] {
            let (right, certain) = judge(guesses);
            println!(
                "| {} | {} | {sought} | {name} | {:.1} % | {:.1} % | {:.2} |",
                film.name,
                map.keyframe_count(),
                100.0 * right as f64 / sought.max(1) as f64,
                100.0 * certain as f64 / sought.max(1) as f64,
                1e3 * seconds / sought.max(1) as f64
            );
        }
    }
    Ok(())
}

/// Right guesses, and those of them that are surer than every wrong one.
fn judge(guesses: &[Guess]) -> (usize, usize) {
    let surest_error = guesses.iter().flatten().filter(|g| !g.1).map(|g| g.0).fold(f64::NEG_INFINITY, f64::max);
    let right = guesses.iter().flatten().filter(|g| g.1);
    (right.clone().count(), right.filter(|g| g.0 > surest_error).count())
}

/// Descriptors of what is trusted to stand still.
fn trusted(features: &FrameFeatures) -> Vec<Descriptor> {
    let pairs = features.features.iter().zip(&features.descriptors);
    pairs.filter(|(feature, _)| feature.trust > 0.0).map(|(_, descriptor)| *descriptor).collect()
}

/// Finds features as the system does; those in boxes of people are not trusted.
struct Eye {
    extractor: OrbExtractor,
    sensor: SensorModel,
    gray: GrayImage,
    extracted: Features,
    features: FrameFeatures,
}

impl Eye {
    fn new(film: &Film, config: &Config) -> Self {
        let extractor = OrbExtractor::new(&config.features);
        Self {
            sensor: SensorModel::new(&film.camera, config, extractor.scale_factors()),
            extractor,
            gray: GrayImage::default(),
            extracted: Features::default(),
            features: FrameFeatures::default(),
        }
    }

    fn look(&mut self, film: &Film, config: &Config, shown: usize) -> &FrameFeatures {
        let frame = film.show(shown);
        gray_from_rgb(&frame.color, &mut self.gray);
        self.extractor.extract(&self.gray, &mut self.extracted);
        self.features.fill(&self.extracted, &frame.depth, &self.sensor.camera, self.sensor.bounds);
        let evidence = Evidence {
            movable: frame.detections.as_deref().unwrap_or_default(),
            looked: true,
            mask: None,
            gray: &self.gray,
            depth: &frame.depth,
            sensor: &self.sensor,
        };
        yfslam::dynamic::Method::Boxes.filter(0).before_pose(&config.dynamic, &evidence, &mut self.features);
        &self.features
    }
}

//! Place recognition: which keyframes show the same place as an image.
//!
//! In: the features of an image, the index of landmarks. Out: candidates, each a group of covisible keyframes with the matches to
//! their landmarks. As in a bag of words (Sivic and Zisserman, ICCV 2003), a feature that matches many keyframes counts little.

use slotmap::SecondaryMap;

use super::descriptor_index::LandmarkIndex;
use crate::config::PlaceConfig;
use crate::features::FrameFeatures;
use crate::map::{KeyFrameId, LandmarkId, Map};

/// A place that the image may show.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    /// The keyframe with the highest score.
    pub keyframe: KeyFrameId,
    /// That keyframe and its covisible ones.
    pub group: Vec<KeyFrameId>,
    /// Features of the image, each with the landmark of the group whose descriptor is nearest.
    pub matches: Vec<(u32, LandmarkId)>,
}

/// Place recognition by the descriptors of landmarks. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub(crate) struct PlaceRecogniser {
    index: LandmarkIndex,
    hits: Vec<Hit>,
    votes: SecondaryMap<KeyFrameId, Vote>,
    voted: Vec<KeyFrameId>,
}

/// A feature, the distance of its descriptor to that of a landmark, and the landmark.
type Hit = (u32, u32, LandmarkId);

#[derive(Clone, Copy, Debug)]
struct Vote {
    score: f64,
    last_feature: u32,
}

impl PlaceRecogniser {
    /// Adds the landmarks of a keyframe that other keyframes observe too.
    pub(crate) fn add_keyframe(&mut self, map: &Map, keyframe: KeyFrameId) {
        let Some(keyframe) = map.keyframe(keyframe) else { return };
        for (_, id) in keyframe.observed() {
            if let Some(landmark) = map.landmark(id).filter(|l| l.observations.len() > 1) {
                self.index.insert(id, &landmark.descriptor);
            }
        }
        self.index.remove_stale(map);
    }

    /// Removes all landmarks.
    pub(crate) fn reset(&mut self) {
        *self = Self::default();
    }

    /// Returns the candidates for an image, best first. Only trusted features count, and only landmarks for which `accepts` returns
    /// true.
    pub(crate) fn candidates(
        &mut self,
        config: &PlaceConfig,
        map: &Map,
        features: &FrameFeatures,
        accepts: impl Fn(LandmarkId) -> bool,
    ) -> Vec<Candidate> {
        self.hits.clear();
        for (i, feature) in features.features.iter().enumerate() {
            if feature.trust > 0.0 {
                let from = self.hits.len();
                let hits = &mut self.hits;
                self.index.for_each_near(&features.descriptors[i], config.max_distance, |landmark, distance| {
                    if accepts(landmark) {
                        hits.push((i as u32, distance, landmark));
                    }
                });
                hits[from..].sort_unstable();
                hits.truncate(from + config.landmarks_per_feature);
            }
        }
        self.vote(map);
        let mut ranked: Vec<(KeyFrameId, f64)> = self.votes.iter().map(|(id, vote)| (id, vote.score)).collect();
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mut candidates: Vec<Candidate> = Vec::new();
        for (id, _) in ranked {
            if candidates.len() >= config.candidates {
                break;
            }
            let (Some(keyframe), false) = (map.keyframe(id), candidates.iter().any(|c| c.group.contains(&id))) else {
                continue;
            };
            let covisible = keyframe.covisible.iter().take(config.group_keyframes).map(|(id, _)| *id);
            let group: Vec<KeyFrameId> = std::iter::once(id).chain(covisible).collect();
            let matches = self.matches(map, &group);
            if matches.len() >= config.min_matches {
                candidates.push(Candidate { keyframe: id, group, matches });
            }
        }
        candidates
    }

    /// Adds up the scores: each feature votes once for each keyframe that observes one of its landmarks, with a weight that falls
    /// with the number of such keyframes.
    fn vote(&mut self, map: &Map) {
        self.votes.clear();
        let keyframes = map.keyframe_count() as f64;
        for hits in self.hits.chunk_by(|a, b| a.0 == b.0) {
            let feature = hits[0].0;
            self.voted.clear();
            for (id, _) in hits.iter().filter_map(|hit| map.landmark(hit.2)).flat_map(|l| &l.observations) {
                let vote = Vote { score: 0.0, last_feature: u32::MAX };
                let Some(entry) = self.votes.entry(*id) else { continue };
                let vote = entry.or_insert(vote);
                if vote.last_feature != feature {
                    vote.last_feature = feature;
                    self.voted.push(*id);
                }
            }
            let weight = libm::log(1.0 + keyframes / self.voted.len() as f64);
            for &id in &self.voted {
                self.votes[id].score += weight;
            }
        }
    }

    /// Returns for each feature the nearest landmark that the group observes; of features with the same landmark only the nearest
    /// is kept.
    fn matches(&self, map: &Map, group: &[KeyFrameId]) -> Vec<(u32, LandmarkId)> {
        let is_observed = |id| map.landmark(id).is_some_and(|l| l.observations.iter().any(|(k, _)| group.contains(k)));
        let nearest = |hits: &[Hit]| hits.iter().find(|hit| is_observed(hit.2)).copied();
        let mut matches: Vec<Hit> = self.hits.chunk_by(|a, b| a.0 == b.0).filter_map(nearest).collect();
        matches.sort_unstable_by_key(|&(feature, distance, landmark)| (landmark, distance, feature));
        matches.dedup_by_key(|hit| hit.2);
        matches.into_iter().map(|(feature, _, landmark)| (feature, landmark)).collect()
    }
}

//! Place recognition, relocalisation and loop closing (ORB-SLAM, IEEE T-RO 2015, sections V-C and VII; ORB-SLAM2, IEEE T-RO 2017,
//! section III-C), without a vocabulary.
//!
//! ```text
//! features ─► place_recognition ─► verify ─► similarity ───► correct ───────► global_bundle
//!              candidates            P3P       without depth   fuse landmarks,   bundle adjustment
//!                                                              pose graph        of the submap
//! ```
//!
//! In: keyframes, and frames whose pose is unknown. Out: poses of relocalised frames; a map whose accumulated drift is corrected.

mod correct;
mod descriptor_index;
mod drift_gate;
mod global_bundle;
mod place_recognition;
mod similarity;
mod verify;

use std::sync::{Mutex, PoisonError};

use nalgebra::Point3;
use slotmap::SecondaryMap;

use crate::config::Config;
use crate::context::Context;
use crate::geometry::{Pose, Similarity, rigid, unscaled};
use crate::map::{KeyFrame, KeyFrameId, Map};
use crate::tracking::{Match, TrackedFrame};
pub(crate) use global_bundle::GlobalBundle;
use place_recognition::Candidate;
pub(crate) use place_recognition::PlaceRecogniser;
use verify::Support;

/// A loop closure.
#[derive(Clone, Copy, Debug)]
pub struct LoopClosure {
    /// The keyframe that closed the loop.
    pub keyframe: KeyFrameId,
    /// The earlier keyframe that shows the same place: of the candidate's keyframes the one with most matches.
    pub to: KeyFrameId,
    /// Number of the candidate's landmarks that are inliers of the keyframe's pose.
    pub inliers: usize,
    /// Correction `s_estimated_localised`: from the pose that verification gave the keyframe to the pose it had, in the camera
    /// frame. Its scale is 1 where depth is measured; else it is the unit of length around the keyframe in that around `to`.
    pub drift: Similarity,
    /// Measured relative pose of the two keyframes: maps points of `to` into `keyframe`, m.
    pub t_keyframe_to: Pose,
    /// Whether the loop joined two submaps: `drift` is then the motion between their worlds.
    pub merged_submaps: bool,
}

/// The region in which a lost camera can be.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SearchRegion {
    /// Reference keyframe of the last tracked frame.
    pub reference: KeyFrameId,
    /// Position of the camera then, in the world of that keyframe, m.
    pub center_world: Point3<f64>,
    /// Distance that it can have moved since then, m.
    pub radius_m: f64,
    /// Match ratio that a candidate inside the region needs.
    pub min_match_ratio: f64,
}

impl SearchRegion {
    /// Returns whether a pose found at a keyframe lies in the region.
    fn includes(&self, map: &Map, candidate: KeyFrameId, t_cam_world: &Pose) -> bool {
        let center = t_cam_world.inverse_transform_point(&Point3::origin());
        (center - self.center_world).norm() <= self.radius_m && map.root(candidate) == map.root(self.reference)
    }
}

/// Relocalises a frame in the whole map. Returns whether that succeeded: its pose and matches are set then. Of several candidates
/// the one with the highest match ratio is taken; a candidate outside `region` needs a higher ratio.
pub(crate) fn relocalise(
    recogniser: &mut PlaceRecogniser,
    context: &Context,
    map: &Map,
    frame: &mut TrackedFrame,
    region: Option<&SearchRegion>,
) -> bool {
    let config = &context.config;
    let c = &config.place_recognition;
    let candidates = recogniser.candidates(c, map, &frame.features, |_| true);
    let needed = Support { inliers: c.relocalise_min_inliers, match_ratio: c.relocalise_min_match_ratio };
    let mut best: Option<(f64, Pose, Vec<Option<Match>>)> = None;
    for candidate in &candidates {
        let Some(support) = verify::localise(context, map, candidate, frame, &needed) else { continue };
        let within = region.is_some_and(|region| region.includes(map, candidate.keyframe, &frame.t_cam_world));
        tracing::debug!(?support, within, "relocalisation candidate");
        let limit = region.filter(|_| within).map_or(c.relocalise_min_match_ratio_far, |region| region.min_match_ratio);
        if support.match_ratio < limit {
            continue;
        }
        if best.as_ref().is_none_or(|(match_ratio, ..)| support.match_ratio > *match_ratio) {
            best = Some((support.match_ratio, frame.t_cam_world, frame.matches.clone()));
        }
    }
    let Some((_, t_cam_world, matches)) = best else { return false };
    (frame.t_cam_world, frame.matches) = (t_cam_world, matches);
    true
}

/// Detects and closes loops.
#[derive(Clone, Debug, Default)]
pub(crate) struct LoopCloser {
    /// Candidate groups of the last keyframe, each with the number of consecutive keyframes that agree on it.
    consistent: Vec<(Vec<KeyFrameId>, usize)>,
    /// Sequence number of the keyframe that closed the last loop.
    last_loop: Option<u64>,
    /// The keyframe as a frame, for verification.
    frame: TrackedFrame,
}

impl LoopCloser {
    /// Removes all candidates and loops.
    pub(crate) fn reset(&mut self) {
        self.consistent.clear();
        self.last_loop = None;
    }

    /// Searches a loop for a new keyframe, and closes it. Global bundle adjustment is left to the caller.
    pub(crate) fn close(
        &mut self,
        context: &Context,
        recogniser: &Mutex<PlaceRecogniser>,
        map: &mut Map,
        keyframe: KeyFrameId,
    ) -> Option<LoopClosure> {
        let config = &context.config;
        let k = map.keyframe(keyframe)?;
        let (sequence, estimated) = (k.sequence, k.t_cam_world);
        if self.last_loop.is_some_and(|last| sequence < last + config.loops.min_keyframes_between) {
            self.consistent.clear();
            return None;
        }
        self.frame.features.clone_from(&k.features);
        let candidates =
            loop_candidates(&mut recogniser.lock().unwrap_or_else(PoisonError::into_inner), config, map, keyframe);
        for candidate in self.consistent_candidates(config, candidates) {
            let c = &config.loops;
            let needed = Support { inliers: c.min_inliers, match_ratio: c.min_match_ratio };
            let verified = verify::localise(context, map, &candidate, &mut self.frame, &needed);
            let Some(support) = verified else { continue };
            let Some(s_cam_candidate) = self.similarity_to(context, map, keyframe, &candidate) else { continue };
            let drift = estimated * s_cam_candidate.inverse();
            let plausible = drift_gate::is_plausible(c, map, keyframe, candidate.keyframe, &drift);
            tracing::debug!(?support, %drift, plausible, "loop candidate");
            if !plausible && support.match_ratio < c.min_match_ratio_large_drift {
                continue;
            }
            let t_keyframe_to = rigid(&s_cam_candidate) * map.keyframe(candidate.keyframe)?.t_cam_world.inverse();
            let merged_submaps = map.root(keyframe) != map.root(candidate.keyframe);
            correct::close(context, map, keyframe, &candidate, &self.frame, &s_cam_candidate);
            self.last_loop = Some(sequence);
            self.consistent.clear();
            return Some(LoopClosure {
                keyframe,
                to: candidate.keyframe,
                inliers: support.inliers,
                drift,
                t_keyframe_to,
                merged_submaps,
            });
        }
        None
    }

    /// Returns the similarity from the candidate's world into the camera of the keyframe, in the unit of the keyframe.
    fn similarity_to(
        &self,
        context: &Context,
        map: &Map,
        keyframe: KeyFrameId,
        candidate: &Candidate,
    ) -> Option<Similarity> {
        let sensor = &context.sensor;
        if sensor.measures_depth {
            return Some(unscaled(&self.frame.t_cam_world));
        }
        similarity::measure(context, map, keyframe, candidate, &self.frame)
    }

    /// Returns the candidates on which enough consecutive keyframes agree: candidates agree if their groups share a keyframe.
    fn consistent_candidates(&mut self, config: &Config, candidates: Vec<Candidate>) -> Vec<Candidate> {
        let previous = std::mem::take(&mut self.consistent);
        let mut chosen = Vec::new();
        for candidate in candidates {
            let agree = |group: &[KeyFrameId]| group.iter().any(|id| candidate.group.contains(id));
            let count = previous.iter().filter(|(group, _)| agree(group)).map(|(_, count)| *count).max();
            let count = 1 + count.unwrap_or(0);
            self.consistent.push((candidate.group.clone(), count));
            if count >= config.loops.min_consistent {
                chosen.push(candidate);
            }
        }
        chosen
    }
}

/// Returns candidates for a loop: keyframes that are not within two steps of covisibility, where tracking and mapping match
/// landmarks anyway.
fn loop_candidates(
    recogniser: &mut PlaceRecogniser,
    config: &Config,
    map: &Map,
    keyframe: KeyFrameId,
) -> Vec<Candidate> {
    let Some(k) = map.keyframe(keyframe) else { return Vec::new() };
    let covisible = |k: &KeyFrame| k.covisible.iter().map(|(id, _)| (*id, ())).collect::<Vec<_>>();
    let mut near: SecondaryMap<KeyFrameId, ()> = covisible(k).into_iter().chain([(keyframe, ())]).collect();
    let first: Vec<KeyFrameId> = near.keys().collect();
    near.extend(first.into_iter().filter_map(|id| map.keyframe(id)).flat_map(covisible));
    let mut local = SecondaryMap::new();
    for (_, landmark) in near.keys().filter_map(|id| map.keyframe(id)).flat_map(|k| k.observed()) {
        local.insert(landmark, ());
    }
    let mut candidates =
        recogniser.candidates(&config.place_recognition, map, &k.features, |id| !local.contains_key(id));
    candidates.retain(|candidate| !near.contains_key(candidate.keyframe));
    candidates
}

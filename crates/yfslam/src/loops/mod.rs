//! Places seen before: finding the way back when lost, and closing loops (ORB-SLAM, IEEE T-RO 2015, sections V-C and VII; ORB-SLAM2,
//! IEEE T-RO 2017, section III-C), without a vocabulary.
//!
//! ```text
//! features ─► recognise ─► verify ─► similarity ─► correct
//!             which place?  P3P      without depth  join, pose graph ─► whole: bundle adjustment
//! ```
//!
//! In: keyframes, and frames whose pose is unknown. Out: poses, and a map without the drift of a way that led back.

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
use verify::Evidence;

/// A loop that was closed.
#[derive(Clone, Copy, Debug)]
pub struct LoopClosure {
    /// The keyframe that came back.
    pub keyframe: KeyFrameId,
    /// The keyframe of the old place that shares most with it.
    pub to: KeyFrameId,
    /// Landmarks of the old place that fit.
    pub inliers: usize,
    /// How the keyframe's estimate differed from the old place's: `s_estimated_located`, in the camera's frame. Its scale is 1 where depth
    /// is measured; else it is the unit of length around the keyframe in that of the old place.
    pub drift: Similarity,
    /// The motion between the two, as measured.
    pub t_keyframe_to: Pose,
    /// Whether the old place was of another submap, so that two became one: `drift` is then the motion between their worlds.
    pub merged_submaps: bool,
}

/// Where a camera that is lost can be at most.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SearchRegion {
    /// The keyframe that it was last seen from.
    pub reference: KeyFrameId,
    /// Where it was then, in the world of that keyframe, m.
    pub center_world: Point3<f64>,
    /// How far it can have come since, m.
    pub radius_m: f64,
    /// Likeness that a place within reach must have.
    pub min_match_ratio: f64,
}

impl SearchRegion {
    fn includes(&self, map: &Map, place: KeyFrameId, t_cam_world: &Pose) -> bool {
        let center = t_cam_world.inverse_transform_point(&Point3::origin());
        (center - self.center_world).norm() <= self.radius_m && map.root(place) == map.root(self.reference)
    }
}

/// Seeks a frame in the whole map. Returns whether it was found: its pose and matches are set then. Of several places that it may show
/// the likeliest is taken; one beyond `reach` has to be likelier.
pub(crate) fn relocalise(
    recogniser: &mut PlaceRecogniser,
    context: &Context,
    map: &Map,
    frame: &mut TrackedFrame,
    reach: Option<&SearchRegion>,
) -> bool {
    let Context { sensor: _, config } = context;
    let c = &config.place_recognition;
    let candidates = recogniser.candidates(c, map, &frame.features, |_| true);
    let needed = Evidence { inliers: c.relocalise_min_inliers, match_ratio: c.relocalise_min_match_ratio };
    let mut best: Option<(f64, Pose, Vec<Option<Match>>)> = None;
    for place in &candidates {
        let Some(evidence) = verify::locate(context, map, place, frame, &needed) else { continue };
        let within = reach.is_some_and(|reach| reach.includes(map, place.keyframe, &frame.t_cam_world));
        tracing::debug!(?evidence, within, "a place to be found at");
        let limit = reach.filter(|_| within).map_or(c.relocalise_min_match_ratio_far, |reach| reach.min_match_ratio);
        if evidence.match_ratio < limit {
            continue;
        }
        if best.as_ref().is_none_or(|(match_ratio, ..)| evidence.match_ratio > *match_ratio) {
            best = Some((evidence.match_ratio, frame.t_cam_world, frame.matches.clone()));
        }
    }
    let Some((_, t_cam_world, matches)) = best else { return false };
    (frame.t_cam_world, frame.matches) = (t_cam_world, matches);
    true
}

/// Closes loops.
#[derive(Clone, Debug, Default)]
pub(crate) struct LoopCloser {
    /// Places that the last keyframe resembled, with the number of keyframes in a row that agreed.
    consistent: Vec<(Vec<KeyFrameId>, usize)>,
    /// Sequence number of the keyframe that closed the last loop.
    last_loop: Option<u64>,
    frame: TrackedFrame,
}

impl LoopCloser {
    /// Forgets all places and loops.
    pub(crate) fn reset(&mut self) {
        self.consistent.clear();
        self.last_loop = None;
    }

    /// Looks whether a new keyframe shows an old place, and closes the loop if so; the map is then to be adjusted as a whole.
    pub(crate) fn close(
        &mut self,
        context: &Context,
        recogniser: &Mutex<PlaceRecogniser>,
        map: &mut Map,
        keyframe: KeyFrameId,
    ) -> Option<LoopClosure> {
        let Context { sensor: _, config } = context;
        let k = map.keyframe(keyframe)?;
        let (sequence, estimated) = (k.sequence, k.t_cam_world);
        if self.last_loop.is_some_and(|last| sequence < last + config.loops.min_keyframes_between) {
            self.consistent.clear();
            return None;
        }
        self.frame.features.clone_from(&k.features);
        let candidates =
            old_places(&mut recogniser.lock().unwrap_or_else(PoisonError::into_inner), config, map, keyframe);
        for place in self.consistent_ones(config, candidates) {
            let c = &config.loops;
            let needed = Evidence { inliers: c.min_inliers, match_ratio: c.min_match_ratio };
            let found = verify::locate(context, map, &place, &mut self.frame, &needed);
            let Some(evidence) = found else { continue };
            let Some(s_cam_place) = self.place_seen_from(context, map, keyframe, &place) else { continue };
            let drift = estimated * s_cam_place.inverse();
            let plausible = drift_gate::is_plausible(c, map, keyframe, place.keyframe, &drift);
            tracing::debug!(?evidence, %drift, plausible, "an old place");
            if !plausible && evidence.match_ratio < c.min_match_ratio_large_drift {
                continue;
            }
            let t_keyframe_to = rigid(&s_cam_place) * map.keyframe(place.keyframe)?.t_cam_world.inverse();
            let merged_submaps = map.root(keyframe) != map.root(place.keyframe);
            correct::close(context, map, keyframe, &place, &self.frame, &s_cam_place);
            self.last_loop = Some(sequence);
            self.consistent.clear();
            return Some(LoopClosure {
                keyframe,
                to: place.keyframe,
                inliers: evidence.inliers,
                drift,
                t_keyframe_to,
                merged_submaps,
            });
        }
        None
    }

    /// Where the world of the old place is in the camera that was located there, in the unit of the keyframe.
    fn place_seen_from(
        &self,
        context: &Context,
        map: &Map,
        keyframe: KeyFrameId,
        place: &Candidate,
    ) -> Option<Similarity> {
        let Context { sensor, config: _ } = context;
        if sensor.measures_depth {
            return Some(unscaled(&self.frame.t_cam_world));
        }
        similarity::measure(context, map, keyframe, place, &self.frame)
    }

    /// Those candidates that the last keyframes agreed on: a candidate agrees with an earlier one if their groups overlap.
    fn consistent_ones(&mut self, config: &Config, candidates: Vec<Candidate>) -> Vec<Candidate> {
        let previous = std::mem::take(&mut self.consistent);
        let mut chosen = Vec::new();
        for place in candidates {
            let agree = |group: &[KeyFrameId]| group.iter().any(|id| place.group.contains(id));
            let times = previous.iter().filter(|(group, _)| agree(group)).map(|(_, times)| *times).max();
            let times = 1 + times.unwrap_or(0);
            self.consistent.push((place.group.clone(), times));
            if times >= config.loops.min_consistent {
                chosen.push(place);
            }
        }
        chosen
    }
}

/// Places that resemble the keyframe and are not within two steps of covisibility, where tracking and mapping look anyway.
fn old_places(recogniser: &mut PlaceRecogniser, config: &Config, map: &Map, keyframe: KeyFrameId) -> Vec<Candidate> {
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
    candidates.retain(|place| !near.contains_key(place.keyframe));
    candidates
}

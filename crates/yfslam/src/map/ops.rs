//! Changes of the map. Each operation preserves the invariants of [`crate::map`] and ignores ids of removed items.

use fearless_simd::{Level, Simd, dispatch};
use nalgebra::{Point3, Vector3};
use slotmap::SecondaryMap;
use std::sync::Arc;

use crate::features::rolling_shutter::{FrameTimes, Velocity};
use crate::features::{Descriptor, FrameFeatures};
use crate::geometry::{Pinhole, Pose, Similarity, rigid};
use crate::map::{KeyFrame, KeyFrameId, Landmark, LandmarkId, Map};

/// Number of shared landmarks from which two keyframes are covisible. Source: ORB-SLAM2.
pub(crate) const COVISIBLE_MIN_SHARED: usize = 15;

impl Map {
    /// Inserts a keyframe without observations and without parent; [`Map::update_covisibility`] connects it.
    pub(crate) fn insert_keyframe(
        &mut self,
        timestamp_ns: i64,
        t_cam_world: Pose,
        features: FrameFeatures,
    ) -> KeyFrameId {
        let sequence = self.keyframes_ever;
        self.keyframes_ever += 1;
        let landmarks = vec![None; features.len()];
        self.keyframes.insert(KeyFrame {
            timestamp_ns,
            sequence,
            t_cam_world,
            unit: 1.0,
            features: Arc::new(features),
            landmarks,
            covisible: Vec::new(),
            parent: None,
            children: Vec::new(),
            loop_edges: Vec::new(),
        })
    }

    /// Inserts a landmark at `position` (world, m) that feature `feature` of `keyframe` observes; an earlier observation by the feature is
    /// removed.
    pub(crate) fn insert_landmark(
        &mut self,
        position: Point3<f64>,
        keyframe: KeyFrameId,
        feature: usize,
        color: [u8; 3],
        scale_factors: &[f32],
    ) -> Option<LandmarkId> {
        let source = self.keyframes.get(keyframe)?;
        let descriptor = *source.features.descriptors.get(feature)?;
        let born = source.sequence;
        let id = self.landmarks.insert(Landmark {
            position,
            descriptor,
            normal: Vector3::zeros(),
            max_distance_m: 0.0,
            min_distance_m: 0.0,
            observations: Vec::with_capacity(4),
            reference: keyframe,
            born,
            visible: 1,
            found: 1,
            existence_log_odds: Landmark::MAX_EXISTENCE_LOG_ODDS,
            color,
        });
        self.add_observation(id, keyframe, feature);
        self.update_landmark(id, scale_factors);
        Some(id)
    }

    /// Adds the observation of `landmark` by `feature` of `keyframe`; an earlier observation by the feature is removed. Does nothing if the
    /// keyframe observes the landmark already.
    pub(crate) fn add_observation(&mut self, landmark: LandmarkId, keyframe: KeyFrameId, feature: usize) {
        let Some(slot) = self.keyframes.get(keyframe).and_then(|k| k.landmarks.get(feature)) else { return };
        let previous = *slot;
        if previous == Some(landmark) || self.landmarks.get(landmark).is_none_or(|l| l.feature_in(keyframe).is_some()) {
            return;
        }
        if let Some(previous) = previous {
            self.remove_observation(previous, keyframe);
        }
        self.landmarks[landmark].observations.push((keyframe, feature as u32));
        self.keyframes[keyframe].landmarks[feature] = Some(landmark);
    }

    /// Removes the observation of `landmark` by `keyframe`; a landmark without observations is removed.
    pub(crate) fn remove_observation(&mut self, landmark: LandmarkId, keyframe: KeyFrameId) {
        let Some(l) = self.landmarks.get_mut(landmark) else { return };
        let Some(at) = l.observations.iter().position(|(k, _)| *k == keyframe) else { return };
        let (_, feature) = l.observations.remove(at);
        self.keyframes[keyframe].landmarks[feature as usize] = None;
        match l.observations.first() {
            None => {
                self.landmarks.remove(landmark);
            }
            Some(&(oldest, _)) if l.reference == keyframe => l.reference = oldest,
            Some(_) => {}
        }
    }

    /// Removes a landmark from the map and from all keyframes.
    pub(crate) fn remove_landmark(&mut self, landmark: LandmarkId) {
        if let Some(l) = self.landmarks.remove(landmark) {
            for (keyframe, feature) in l.observations {
                self.keyframes[keyframe].landmarks[feature as usize] = None;
            }
        }
    }

    /// Moves the observations of `removed` to `kept` and removes `removed`. In a keyframe that observes both, `kept` keeps its feature.
    pub(crate) fn merge_landmarks(&mut self, kept: LandmarkId, removed: LandmarkId) {
        if kept == removed || !self.landmarks.contains_key(kept) {
            return;
        }
        let Some(l) = self.landmarks.get(removed) else { return };
        let (observations, visible, found) = (l.observations.clone(), l.visible, l.found);
        self.remove_landmark(removed);
        for (keyframe, feature) in observations {
            self.add_observation(kept, keyframe, feature as usize);
        }
        let l = &mut self.landmarks[kept];
        l.visible += visible;
        l.found += found;
    }

    /// Updates descriptor, normal and distance range of a landmark from its observations.
    pub(crate) fn update_landmark(&mut self, landmark: LandmarkId, scale_factors: &[f32]) {
        self.update_view_range(landmark, scale_factors);
        let Some(l) = self.landmarks.get(landmark) else { return };
        let best = if let [only] = l.observations[..] {
            Some(self.descriptor(only))
        } else {
            let descriptors: Vec<Descriptor> = l.observations.iter().map(|seen| self.descriptor(*seen)).collect();
            most_typical(&descriptors).map(|i| descriptors[i])
        };
        if let Some(best) = best {
            self.landmarks[landmark].descriptor = best;
        }
    }

    fn descriptor(&self, (keyframe, feature): (KeyFrameId, u32)) -> Descriptor {
        self.keyframes[keyframe].features.descriptors[feature as usize]
    }

    /// Updates normal and distance range of a landmark whose position, or the pose of an observing keyframe, has changed.
    pub(crate) fn update_view_range(&mut self, landmark: LandmarkId, scale_factors: &[f32]) {
        let Some(l) = self.landmarks.get(landmark) else { return };
        let mut normal = Vector3::zeros();
        for &(k, _) in &l.observations {
            let center = self.keyframes[k].t_cam_world.inverse_transform_point(&Point3::origin());
            normal += (l.position - center).normalize();
        }
        // `remove_observation` replaces a reference that is removed, so both exist unless the map is inconsistent.
        let (Some(reference), Some(feature)) = (self.keyframes.get(l.reference), l.feature_in(l.reference)) else {
            return;
        };
        let octave = usize::from(reference.features.features[feature].octave);
        let center = reference.t_cam_world.inverse_transform_point(&Point3::origin());
        let distance = (l.position - center).norm();
        let scale = |level: usize| f64::from(scale_factors.get(level).copied().unwrap_or(1.0));
        let l = &mut self.landmarks[landmark];
        l.normal = normal.try_normalize(1e-12).unwrap_or_else(Vector3::zeros);
        l.max_distance_m = distance * scale(octave);
        l.min_distance_m = l.max_distance_m / scale(scale_factors.len().saturating_sub(1));
    }

    /// Sets the position of a landmark (world, m).
    pub(crate) fn set_position(&mut self, landmark: LandmarkId, position: Point3<f64>) {
        if let Some(l) = self.landmarks.get_mut(landmark) {
            l.position = position;
        }
    }

    /// Sets how the rows of the images of a keyframe were read.
    pub(crate) fn set_row_times(&mut self, keyframe: KeyFrameId, times: &FrameTimes) {
        if let Some(k) = self.keyframes.get_mut(keyframe) {
            Arc::make_mut(&mut k.features).set_row_times(times);
        }
    }

    /// Brings the features of a keyframe to the time of their middle row; see [`FrameFeatures::move_to_middle_row`].
    pub(crate) fn retime_features(
        &mut self,
        keyframe: KeyFrameId,
        velocity: &Velocity,
        pinhole: &Pinhole,
        depth_of: impl Fn(usize) -> f64,
    ) {
        if let Some(k) = self.keyframes.get_mut(keyframe) {
            let features = Arc::make_mut(&mut k.features);
            features.move_to_middle_row(velocity, pinhole, depth_of);
            features.build_grid();
        }
    }

    /// Sets the pose of a keyframe.
    pub(crate) fn set_pose(&mut self, keyframe: KeyFrameId, t_cam_world: Pose) {
        if let Some(k) = self.keyframes.get_mut(keyframe) {
            k.t_cam_world = t_cam_world;
        }
    }

    /// Sets the pose of a keyframe to that of a similarity and divides its unit of length by the scale.
    pub(crate) fn set_scaled_pose(&mut self, keyframe: KeyFrameId, s_cam_world: &Similarity) {
        if let Some(k) = self.keyframes.get_mut(keyframe) {
            k.t_cam_world = rigid(s_cam_world);
            k.unit /= s_cam_world.scaling();
        }
    }

    /// Counts a frame in which the landmark was expected to be visible.
    pub(crate) fn count_visible(&mut self, landmark: LandmarkId) {
        if let Some(l) = self.landmarks.get_mut(landmark) {
            l.visible += 1;
        }
    }

    /// Counts a frame that matched the landmark as an inlier.
    pub(crate) fn count_found(&mut self, landmark: LandmarkId) {
        if let Some(l) = self.landmarks.get_mut(landmark) {
            l.found += 1;
            l.existence_log_odds =
                (l.existence_log_odds + Landmark::MATCHED_LOG_ODDS).min(Landmark::MAX_EXISTENCE_LOG_ODDS);
        }
    }

    /// Counts a frame that measured free space at the landmark, and removes the landmark if it probably does not exist any more.
    pub(crate) fn count_free_space(&mut self, landmark: LandmarkId) {
        let Some(l) = self.landmarks.get_mut(landmark) else { return };
        l.existence_log_odds += Landmark::FREE_SPACE_LOG_ODDS;
        if l.existence_log_odds < Landmark::MIN_EXISTENCE_LOG_ODDS {
            self.remove_landmark(landmark);
        }
    }

    /// Recomputes the covisible keyframes of `keyframe` and updates both sides. A keyframe without parent becomes a child of the one with
    /// which it shares most landmarks.
    pub(crate) fn update_covisibility(&mut self, keyframe: KeyFrameId) {
        let Some(k) = self.keyframes.get(keyframe) else { return };
        let mut observers: Vec<KeyFrameId> = k
            .observed()
            .filter_map(|(_, l)| self.landmarks.get(l))
            .flat_map(|l| l.observations.iter().map(|(other, _)| *other))
            .filter(|other| *other != keyframe)
            .collect();
        observers.sort_unstable();
        let mut counts: Vec<(KeyFrameId, usize)> =
            observers.chunk_by(|a, b| a == b).map(|same| (same[0], same.len())).collect();
        counts.sort_by_key(|&(id, count)| (std::cmp::Reverse(count), id));
        // The first one is always covisible, so that the graph stays connected.
        let keep = counts.partition_point(|&(_, count)| count >= COVISIBLE_MIN_SHARED).max(1).min(counts.len());
        counts.truncate(keep);
        let before = std::mem::take(&mut self.keyframes[keyframe].covisible);
        for (other, _) in before {
            if let Some(o) = self.keyframes.get_mut(other) {
                o.covisible.retain(|(id, _)| *id != keyframe);
            }
        }
        for &(other, count) in &counts {
            let list = &mut self.keyframes[other].covisible;
            let at = list.partition_point(|&(id, c)| (std::cmp::Reverse(c), id) < (std::cmp::Reverse(count), keyframe));
            list.insert(at, (keyframe, count));
        }
        // The root of a submap has no parent: its covisible keyframes are its descendants.
        let parent = counts.first().map(|(id, _)| *id).filter(|parent| self.root(*parent) != Some(keyframe));
        let k = &mut self.keyframes[keyframe];
        k.covisible = counts;
        if let (None, Some(parent)) = (k.parent, parent) {
            k.parent = Some(parent);
            self.keyframes[parent].children.push(keyframe);
        }
    }

    /// Adds a loop edge between two keyframes.
    pub(crate) fn add_loop_edge(&mut self, a: KeyFrameId, b: KeyFrameId) {
        if a == b || !self.keyframes.contains_key(a) || !self.keyframes.contains_key(b) {
            return;
        }
        for (from, to) in [(a, b), (b, a)] {
            let edges = &mut self.keyframes[from].loop_edges;
            if !edges.contains(&to) {
                edges.push(to);
            }
        }
    }

    /// Removes a keyframe with its observations; its children become children of its parent. Keyframes without parent and keyframes with
    /// loop edges are not removed. Returns whether the keyframe was removed.
    pub(crate) fn remove_keyframe(&mut self, keyframe: KeyFrameId) -> bool {
        let removable = self.keyframes.get(keyframe).filter(|k| k.loop_edges.is_empty());
        let Some(parent) = removable.and_then(|k| k.parent) else { return false };
        let landmarks: Vec<LandmarkId> = self.keyframes[keyframe].observed().map(|(_, l)| l).collect();
        for landmark in landmarks {
            self.remove_observation(landmark, keyframe);
        }
        let (Some(own), Some(of_parent)) = (self.own_pose(keyframe), self.own_pose(parent)) else { return false };
        let Some(k) = self.keyframes.remove(keyframe) else { return false };
        for (other, _) in &k.covisible {
            self.keyframes[*other].covisible.retain(|(id, _)| *id != keyframe);
        }
        self.keyframes[parent].children.retain(|c| *c != keyframe);
        for child in k.children {
            self.keyframes[child].parent = Some(parent);
            self.keyframes[parent].children.push(child);
        }
        self.removed.insert(keyframe, (parent, own * of_parent.inverse()));
        true
    }

    /// Checks the invariants, for tests and for maps that were read from files. The error describes the first violation.
    pub(crate) fn validate(&self) -> Result<(), String> {
        let roots = self.keyframes.iter().filter(|(_, k)| k.parent.is_none()).map(|(id, _)| id);
        let mut submap_of = SecondaryMap::new();
        for root in roots {
            submap_of.extend(self.submap(root).into_iter().map(|member| (member, root)));
        }
        if submap_of.len() != self.keyframes.len() {
            return Err("a keyframe is its own ancestor".to_owned());
        }
        for (id, l) in &self.landmarks {
            if l.observations.windows(2).any(|pair| submap_of.get(pair[0].0) != submap_of.get(pair[1].0)) {
                return Err(format!("landmark {id:?} is observed from two submaps"));
            }
            if l.observations.is_empty() {
                return Err(format!("landmark {id:?} has no observation"));
            }
            for &(k, f) in &l.observations {
                let listed = self.keyframes.get(k).and_then(|k| k.landmarks.get(f as usize)).copied().flatten();
                if listed != Some(id) {
                    return Err(format!(
                        "landmark {id:?} is observed by feature {f} of {k:?}, but that feature observes {listed:?}"
                    ));
                }
            }
        }
        for (id, k) in &self.keyframes {
            for (f, l) in k.observed() {
                if self.landmarks.get(l).and_then(|l| l.feature_in(id)) != Some(f) {
                    return Err(format!(
                        "feature {f} of {id:?} observes {l:?}, but that landmark does not list the observation"
                    ));
                }
            }
            for &(other, count) in &k.covisible {
                let back = self.keyframes.get(other).and_then(|o| o.covisible.iter().find(|(i, _)| *i == id));
                if back != Some(&(id, count)) {
                    return Err(format!("covisibility of {id:?} and {other:?} is not mutual"));
                }
            }
            if k.loop_edges.iter().any(|e| self.keyframes.get(*e).is_none_or(|e| !e.loop_edges.contains(&id))) {
                return Err(format!("a loop edge of {id:?} is not mutual"));
            }
            if k.parent.is_some_and(|p| self.keyframes.get(p).is_none_or(|p| !p.children.contains(&id))) {
                return Err(format!("the parent of {id:?} does not list it as a child"));
            }
            if k.children.iter().any(|c| self.keyframes.get(*c).is_none_or(|c| c.parent != Some(id))) {
                return Err(format!("a child of {id:?} has another parent"));
            }
        }
        Ok(())
    }
}

/// Returns the index of the descriptor with the least median distance to all of them, the first of several; `None` if there are none.
fn most_typical(descriptors: &[Descriptor]) -> Option<usize> {
    dispatch!(Level::new(), simd => least_median(simd, descriptors))
}

#[inline(always)]
fn least_median<S: Simd>(_: S, descriptors: &[Descriptor]) -> Option<usize> {
    let mut counts = [0u16; 257];
    let mut best = None;
    for (i, d) in descriptors.iter().enumerate() {
        // The median by counting: distances are at most 256.
        counts.fill(0);
        descriptors.iter().for_each(|e| counts[d.distance(e) as usize] += 1);
        let middle = (descriptors.len() - 1) / 2;
        let mut below = 0;
        let median = counts.iter().position(|n| {
            below += usize::from(*n);
            below > middle
        });
        if best.is_none_or(|(least, _)| median < least) {
            best = Some((median, i));
        }
    }
    best.map(|(_, i)| i)
}

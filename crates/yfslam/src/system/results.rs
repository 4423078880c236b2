//! What can be asked of the system between frames.

use super::{Readout, Slam};
use crate::dense::{DenseError, DenseView, MapFrame};
use crate::detect::Detection;
use crate::dynamic::Region;
use crate::features::Feature;
use crate::geometry::Pose;
use crate::loops::LoopClosure;
use crate::map::{KeyFrameId, Map};
#[cfg(feature = "persist")]
use crate::map::{MapError, persist::encode};

/// Counts over all frames of a session.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Statistics {
    /// Frames that were not rejected.
    pub frames: usize,
    /// Frames that should have become keyframes while the mapping thread was busy.
    pub keyframes_skipped: usize,
    /// Times that the map was begun anew because tracking was lost soon after the start. Earlier poses belong to another world.
    pub resets: usize,
    /// Frames on which the detector failed.
    pub detector_failures: usize,
    /// Frames in which nothing searched for people although the filter needs that.
    pub frames_without_detector: usize,
    /// Sequence number of the first keyframe of this session; those of a map from an earlier one are lower.
    pub first_keyframe: u64,
    /// Whether mapping on its own thread has ended by a panic, so that the map can no longer grow.
    pub mapping_has_ended: bool,
    /// The map frame of the saved map that the session continues.
    pub saved_frame: Option<MapFrame>,
    /// How the readout time of the rows of an image is known.
    pub readout: Readout,
    /// Keyframe patches of the dense map.
    pub dense_patches: usize,
    /// Keyframe patches that were left out because the thread of the dense map was busy.
    pub dense_patches_skipped: usize,
    /// Memory of the keyframe patches, bytes.
    pub dense_bytes: usize,
}

impl Slam {
    /// Waits for mapping that is under way on its own thread, so that [`Slam::map`] and [`Slam::trajectory`] are complete. Returns the
    /// loop that it closed.
    pub fn finish_mapping(&mut self) -> Option<LoopClosure> {
        self.owner.finish()?.loop_closure
    }

    /// Returns the counts of this session.
    pub fn statistics(&self) -> Statistics {
        let mut statistics = self.statistics;
        statistics.first_keyframe = self.first_keyframe;
        statistics.saved_frame = self.saved_frame;
        statistics.readout = self.readout;
        statistics.mapping_has_ended = !self.owner.is_alive();
        if let Some(dense) = &self.dense {
            statistics.dense_patches = dense.len();
            statistics.dense_patches_skipped = dense.patches_skipped();
            statistics.dense_bytes = dense.bytes();
        }
        statistics
    }

    /// Returns the poses of the tracked frames (time stamp in ns, world from camera) as the map has them now: of all frames, once every
    /// submap has been merged; else of those in the submap that has most frames.
    pub fn trajectory(&self) -> Vec<(i64, Pose)> {
        self.trajectories().into_iter().max_by_key(Vec::len).unwrap_or_default()
    }

    /// Returns the poses of the tracked frames for each submap, each in its own world, in the order in which they were begun.
    pub fn trajectories(&self) -> Vec<Vec<(i64, Pose)>> {
        let map = self.owner.map();
        let mut of_submaps: Vec<(KeyFrameId, Vec<(i64, Pose)>)> = Vec::new();
        // Most frames have the reference keyframe of the frame before.
        let mut last: Option<(KeyFrameId, usize)> = None;
        for a in &self.anchors {
            let Some(t_cam_world) = map.absolute_pose(a.reference, &a.t_cam_reference) else { continue };
            let at = match last.filter(|(reference, _)| *reference == a.reference) {
                Some((_, at)) => at,
                None => {
                    let Some(root) = map.root(a.reference) else { continue };
                    let known = of_submaps.iter().position(|(other, _)| *other == root);
                    known.unwrap_or_else(|| {
                        of_submaps.push((root, Vec::new()));
                        of_submaps.len() - 1
                    })
                }
            };
            last = Some((a.reference, at));
            of_submaps[at].1.push((a.timestamp_ns, t_cam_world.inverse()));
        }
        of_submaps.into_iter().map(|(_, poses)| poses).collect()
    }

    /// Returns the features of the last frame, with their depth and static probability.
    pub fn features(&self) -> &[Feature] {
        &self.tracker.current.features.features
    }

    /// Returns whether a feature of the last frame, by its index in [`Slam::features`], is matched to a landmark.
    pub fn is_matched(&self, feature: usize) -> bool {
        self.tracker.current.matches.get(feature).is_some_and(Option::is_some)
    }

    /// Returns the detections of movable objects in the last frame, at any score.
    pub fn detections(&self) -> &[Detection] {
        &self.detections.movable
    }

    /// Returns the parts of the last frame that were found to move.
    pub fn moving_regions(&self) -> &[Region] {
        self.filter.regions()
    }

    /// Returns the map: with mapping on its own thread, as it was after the last keyframe that is finished.
    pub fn map(&self) -> &Map {
        self.owner.map()
    }

    /// Returns the map as bytes, with the dense map if there is one, for [`SavedMap::from_bytes`](crate::SavedMap::from_bytes); with the
    /// feature `persist`.
    ///
    /// # Errors
    /// If it cannot be written, which would be a fault of this program.
    #[cfg(feature = "persist")]
    pub fn save_map(&mut self) -> Result<Vec<u8>, MapError> {
        let mut bytes = match &mut self.dense {
            Some(dense) => DenseView::new(dense, self.owner.map(), self.saved_frame).snapshot().to_bytes()?,
            None => self.saved_frame.unwrap_or_default().to_bytes()?,
        };
        bytes.extend(encode(self.map(), &self.context.sensor.camera, &self.context.config.features)?);
        Ok(bytes)
    }

    /// Returns the dense map as it is now.
    ///
    /// # Errors
    /// If the system was built without one.
    pub fn dense(&mut self) -> Result<DenseView<'_>, DenseError> {
        let mapper = self.dense.as_mut().ok_or(DenseError::Disabled)?;
        Ok(DenseView::new(mapper, self.owner.map(), self.saved_frame))
    }
}

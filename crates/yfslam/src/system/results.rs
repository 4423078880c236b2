//! What can be asked of the system between frames.

use super::Slam;
use crate::detection::Detection;
use crate::dynamic::{MovingMask, Region, Things};
use crate::geometry::Pose;
use crate::image::DepthImage;
use crate::loops::LoopClosed;
use crate::map::persist::{MapError, encode};
use crate::map::{KeyFrameId, Map};
use crate::tracking::TrackedFrame;

impl Slam {
    /// Waits for mapping that is under way on its own thread, so that [`Slam::map`] and [`Slam::trajectory`] tell all. Returns the loop
    /// that it closed.
    pub fn settle(&mut self) -> Option<LoopClosed> {
        self.owner.settle()?.loop_closed
    }

    /// Frames that were worth a keyframe while mapping was busy on its own thread.
    pub fn passed_over(&self) -> usize {
        self.passed_over
    }

    /// Poses of the tracked frames (world from camera) as the map has them now: of all frames, once every submap has been joined; else
    /// of those in the submap that most of them are in.
    pub fn trajectory(&self) -> Vec<(i64, Pose)> {
        self.trajectories().into_iter().max_by_key(Vec::len).unwrap_or_default()
    }

    /// Poses of the tracked frames for each submap, each in its own world, in the order in which they were begun.
    pub fn trajectories(&self) -> Vec<Vec<(i64, Pose)>> {
        let map = self.owner.map();
        let mut of_submaps: Vec<(KeyFrameId, Vec<(i64, Pose)>)> = Vec::new();
        // Most frames hang on the keyframe that the one before hangs on.
        let mut last: Option<(KeyFrameId, usize)> = None;
        for a in &self.anchors {
            let Some(t_cam_world) = map.tied_pose(a.reference, &a.t_cam_reference) else { continue };
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

    /// Whether the map can still grow: false once mapping on its own thread has ended by a panic.
    pub fn is_mapping_alive(&self) -> bool {
        self.owner.is_alive()
    }

    /// How often the map was begun anew because tracking was lost soon after the start. Poses given out before belong to another world.
    pub fn resets(&self) -> usize {
        self.resets
    }

    /// Frames on which the detector failed.
    pub fn detector_failures(&self) -> usize {
        self.detector_failures
    }

    /// The last frame: features with their trust, matches, pose.
    pub fn last_frame(&self) -> &TrackedFrame {
        &self.tracker.current
    }

    /// The boxes of movable objects in the last frame, at any score.
    pub fn last_boxes(&self) -> &[Detection] {
        &self.found.movable
    }

    /// The parts of the last frame that were found to move.
    pub fn moving_regions(&self) -> &[Region] {
        self.filter.regions()
    }

    /// What moves in the last frame, whose depth image is given, pixel by pixel.
    pub fn moving_mask(&self, depth: &DepthImage) -> MovingMask {
        self.filter.moving_mask(&self.config.dynamic, depth)
    }

    /// Names of the detector's classes, in the order of [`Detection::class`]; none without one.
    pub fn class_names(&self) -> &[String] {
        &self.found.class_names
    }

    /// Whether the detector knows more than what can move.
    pub fn knows_things(&self) -> bool {
        self.found.knows_things()
    }

    /// Outlines of what the detector found in the last frame and cannot move, beside what does, as [`Slam::moving_mask`] has it of the
    /// same depth image. `None` where no detector that knows such things looked.
    pub fn things(&self, depth: &DepthImage, moving: &MovingMask) -> Option<Things> {
        self.found.things().map(|boxes| Things::outline(&self.config.dynamic, boxes, depth, moving))
    }

    /// Sequence number of the first keyframe of this session; those of a map from an earlier one are lower.
    pub fn first_keyframe(&self) -> u64 {
        self.first_keyframe
    }

    /// The map as bytes, for [`crate::map::persist::decode`].
    ///
    /// # Errors
    /// If it cannot be written, which would be a fault of this program.
    pub fn save_map(&self) -> Result<Vec<u8>, MapError> {
        encode(self.map(), &self.sensor.camera, &self.config.features)
    }

    /// The map: with mapping on its own thread, as it was after the last keyframe that is finished.
    pub fn map(&self) -> &Map {
        self.owner.map()
    }
}

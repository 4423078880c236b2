//! The dense map while the system runs: keyframe patches with poses relative to keyframes, and the volume that follows them.
//!
//! In: patches with the keyframe that each belongs to, and the map whenever it was corrected. Out: a volume that is consistent with
//! the trajectory at any time. With [`Execution::Inline`] a patch is integrated at once; with [`Execution::Threaded`] on a thread
//! of its own, for which tracking never waits: a patch is left out if two others are still in the queue.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::camera::Camera;
use crate::config::{DenseConfig, DynamicConfig};
use crate::dense::fusion::FusionOwner;
use crate::dense::keyframe_patch::{CellGrid, KeyframePatch};
use crate::dense::object_masks::ObjectMasks;
use crate::dense::volume::Volume;
use crate::dense::{DenseError, DenseMap, MapFrame, PlacedPatch, RowShift};
use crate::detect::Detection;
use crate::dynamic::MovingMask;
use crate::geometry::Pose;
use crate::image::{DepthImage, RgbImage};
use crate::map::{KeyFrameId, KeyframeRelativePose, Map};
use crate::worker::Execution;

/// The patches of keyframes, and the volume that follows their poses in the map.
pub(crate) struct DenseMapper {
    config: DenseConfig,
    grid: CellGrid,
    poses: Vec<KeyframeRelativePose>,
    /// Time and pose, camera to world, of the last patch when it was extracted.
    last: Option<(i64, Pose)>,
    fusion: FusionOwner,
    /// Memory of the patches, bytes.
    bytes: usize,
    class_names: Vec<String>,
    /// The class in patches of each class of the detector; `None` where patches have no classes.
    class_ids: Option<Vec<u8>>,
    patches_skipped: usize,
}

/// The data of a frame from which a patch is extracted.
pub(crate) struct Source<'a> {
    /// The colour image.
    pub color: &'a RgbImage,
    /// The depth image.
    pub depth: &'a DepthImage,
    /// How a rolling shutter has shifted the rows of both.
    pub shift: Option<&'a RowShift>,
    /// The pixels that move, in the images as they were read.
    pub moving: &'a MovingMask,
    /// Detections of objects that cannot move; `None` if no detector searched for them.
    pub objects: Option<&'a [Detection]>,
}

impl DenseMapper {
    /// Returns a dense map for one camera, whose volume is in the map frame.
    ///
    /// # Errors
    /// For a value of the configuration out of range, or if a thread cannot be started.
    pub(crate) fn new(
        config: &DenseConfig,
        camera: &Camera,
        execution: Execution,
        frame: &MapFrame,
    ) -> Result<Self, DenseError> {
        config.validate()?;
        let grid = CellGrid::new(camera, config.stride_px);
        let fusion = FusionOwner::new(config, &grid, execution, frame)?;
        Ok(Self {
            config: config.clone(),
            grid,
            poses: Vec::new(),
            last: None,
            fusion,
            bytes: 0,
            class_names: Vec::new(),
            class_ids: None,
            patches_skipped: 0,
        })
    }

    /// Adds the patches of an earlier session, whose `map` this session continues; they come before its own.
    ///
    /// # Errors
    /// If the patches have other cells or belong to another map.
    pub(crate) fn with_earlier(mut self, earlier: DenseMap, map: &Map) -> Result<Self, DenseError> {
        let DenseMap { grid, mut patches, unmerged, class_names, frame: _ } = earlier;
        if grid != self.grid {
            let (found, wanted) = (grid.stride_px(), self.grid.stride_px());
            let (width, height) = (grid.camera().width, grid.camera().height);
            return Err(DenseError::Cells { found, wanted, width, height });
        }
        for (at, placed) in unmerged {
            patches.insert(at.min(patches.len()), placed);
        }
        let keyframes: BTreeMap<u64, (KeyFrameId, Pose)> =
            map.keyframes().map(|(id, k)| (k.sequence, (id, k.t_cam_world))).collect();
        let mut known = Vec::with_capacity(patches.len());
        for PlacedPatch { timestamp_ns, keyframe, t_world_cam, patch } in patches {
            let (id, t_reference_world) = keyframes.get(&keyframe).ok_or(DenseError::Keyframe(keyframe))?;
            self.poses.push((*id, (t_reference_world * t_world_cam).inverse()));
            self.bytes += patch.bytes();
            known.push((timestamp_ns, Arc::new(patch)));
        }
        self.class_names = class_names;
        let poses = self.world_poses(map);
        self.fusion.integrate(known, poses);
        Ok(self)
    }

    /// Returns whether a keyframe becomes a patch: the camera has moved or turned far enough since the last one, or enough time has
    /// passed.
    pub(crate) fn is_due(&self, timestamp_ns: i64, t_world_cam: &Pose) -> bool {
        let Some((last_ns, last)) = &self.last else { return true };
        let moved = last.inverse() * t_world_cam;
        let config = &self.config;
        moved.translation.vector.norm() >= config.min_move_m
            || moved.rotation.angle().to_degrees() >= config.min_turn_deg
            || timestamp_ns.saturating_sub(*last_ns) as f64 * 1e-9 >= config.min_gap_s
    }

    /// Extracts the patch of a frame, with the classes of static objects where they are known.
    pub(crate) fn extract(&self, dynamic: &DynamicConfig, source: &Source<'_>) -> KeyframePatch {
        let Source { color, depth, shift, moving, objects } = source;
        let as_read = |at| shift.map_or(at, |shift| shift.in_color(at));
        let moves = |at, edge| moving.covers(depth, as_read(at), edge);
        let patch = match shift {
            None => KeyframePatch::extract(&self.config, &self.grid, color, depth, moves),
            Some(shift) => {
                let (color, depth) = (shift.corrected_color(color), shift.corrected_depth(depth));
                KeyframePatch::extract(&self.config, &self.grid, &color, &depth, moves)
            }
        };
        let Some((ids, objects)) = self.class_ids.as_ref().zip(*objects) else { return patch };
        let masks = ObjectMasks::segment(dynamic, objects, depth, moving);
        let id = |at| masks.class_at(as_read(at)).and_then(|class| ids.get(class).copied()).unwrap_or_default();
        patch.with_classes(&self.grid, id)
    }

    /// Assigns numbers in the patches to the classes of a detector, by name: the same numbers as in patches of an earlier session.
    /// Of more than 255 classes in all, the last ones are unknown (0).
    pub(crate) fn name_classes(&mut self, names: &[String]) {
        if !self.config.classes {
            return;
        }
        let known = &mut self.class_names;
        let class = |name: &String| {
            let at = known.iter().position(|other| other == name).unwrap_or(known.len());
            if at == known.len() && at < usize::from(u8::MAX) {
                known.push(name.clone());
            }
            u8::try_from(at + 1).unwrap_or(0)
        };
        self.class_ids = Some(names.iter().map(class).collect());
    }

    /// Inserts a patch with its pose relative to a keyframe, and moves all patches to their present poses in the map.
    pub(crate) fn insert(&mut self, timestamp_ns: i64, pose: KeyframeRelativePose, patch: KeyframePatch, map: &Map) {
        self.poses.push(pose);
        let poses = self.world_poses(map);
        let pose = poses.last().copied().flatten();
        let bytes = patch.bytes();
        if !self.fusion.integrate(vec![(timestamp_ns, Arc::new(patch))], poses) {
            self.poses.pop();
            self.patches_skipped += 1;
            return;
        }
        self.bytes += bytes;
        if let Some(pose) = pose {
            self.last = Some((timestamp_ns, pose));
        }
    }

    /// Returns the number of patches that were left out because the thread was busy.
    pub(crate) fn patches_skipped(&self) -> usize {
        self.patches_skipped
    }

    /// Returns the number of patches.
    pub(crate) fn len(&self) -> usize {
        self.poses.len()
    }

    /// Memory of the patches, bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.bytes
    }

    /// Returns the present poses of the patches, camera to world, each with the root of its submap, which defines the world; `None`
    /// for patches whose submap was removed.
    fn rooted_poses(&self, map: &Map) -> Vec<Option<(KeyFrameId, Pose)>> {
        let rooted = |(keyframe, t_cam_reference): &KeyframeRelativePose| {
            let (root, t_reference_world) = (map.root(*keyframe)?, map.keyframe_pose(*keyframe)?);
            Some((root, (t_cam_reference * t_reference_world).inverse()))
        };
        self.poses.iter().map(rooted).collect()
    }

    /// Returns the poses, camera to world, of the patches in the submap that has most of them; `None` for the others.
    fn world_poses(&self, map: &Map) -> Vec<Option<Pose>> {
        let poses = self.rooted_poses(map);
        let largest = largest(&poses);
        poses.into_iter().map(|pose| pose.filter(|(root, _)| Some(*root) == largest).map(|(_, pose)| pose)).collect()
    }

    /// Returns the volume with the patches at their present poses; waits for the thread, if there is one.
    pub(crate) fn volume(&mut self, map: &Map) -> Volume {
        let poses = self.world_poses(map);
        self.fusion.volume(poses).unwrap_or_else(|| Volume::new(&self.config))
    }

    /// Removes all patches, because the map was reset.
    pub(crate) fn clear(&mut self) {
        self.poses.clear();
        self.last = None;
        self.bytes = 0;
        self.fusion.clear();
    }

    /// Returns the patches with their poses, for products and files; waits for the thread, if there is one.
    pub(crate) fn snapshot(&mut self, map: &Map) -> DenseMap {
        let poses = self.rooted_poses(map);
        let largest = largest(&poses);
        let (grid, class_names) = (self.grid.clone(), self.class_names.clone());
        let mut dense_map = DenseMap { patches: Vec::new(), unmerged: Vec::new(), grid, class_names, frame: None };
        for (((keyframe, _), pose), (timestamp_ns, patch)) in self.poses.iter().zip(poses).zip(self.fusion.patches()) {
            let surviving = map.surviving_ancestor(*keyframe);
            let Some(((root, t_world_cam), (keyframe, _))) = pose.zip(surviving) else { continue };
            let patch = Arc::unwrap_or_clone(patch);
            let placed = PlacedPatch { timestamp_ns, keyframe: keyframe.sequence, t_world_cam, patch };
            if Some(root) == largest {
                dense_map.patches.push(placed);
            } else {
                dense_map.unmerged.push((dense_map.patches.len() + dense_map.unmerged.len(), placed));
            }
        }
        dense_map
    }
}

/// Returns the root of the submap with most patches; of equals the one that comes first.
fn largest(poses: &[Option<(KeyFrameId, Pose)>]) -> Option<KeyFrameId> {
    let mut counts: Vec<(usize, KeyFrameId)> = Vec::new();
    for (root, _) in poses.iter().flatten() {
        match counts.iter_mut().find(|(_, other)| other == root) {
            Some((count, _)) => *count += 1,
            None => counts.push((1, *root)),
        }
    }
    counts.iter().rev().max_by_key(|(count, _)| *count).map(|(_, root)| *root)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense::scene;
    use crate::features::FrameFeatures;

    /// Returns a map of separate keyframes, 0.3 m apart, with a relative pose to each.
    fn map() -> (Map, Vec<KeyframeRelativePose>) {
        let mut map = Map::default();
        let relative_pose = |k: i64| {
            let id = map.insert_keyframe(k, Pose::translation(-0.3 * k as f64, 0.0, 0.0), FrameFeatures::default());
            (id, Pose::translation(0.0, 0.01, 0.0))
        };
        let relative_poses = (0..4).map(relative_pose).collect::<Vec<_>>();
        (map, relative_poses)
    }

    fn mapper(execution: Execution) -> DenseMapper {
        DenseMapper::new(&DenseConfig::default(), &scene::camera(), execution, &MapFrame::default()).unwrap()
    }

    #[test]
    fn on_its_own_thread_the_map_is_the_same() {
        let (map, relative_poses) = map();
        let mut volumes = Vec::new();
        for execution in [Execution::Inline, Execution::Threaded] {
            let mut mapper = mapper(execution);
            let patch = scene::wall(&CellGrid::new(&scene::camera(), 2), 2.0, Some(1.1));
            // The submaps have one keyframe each, because no keyframe has a parent: the one with all patches is the largest.
            for k in 0..3 {
                mapper.insert(k, relative_poses[0], patch.clone(), &map);
                // No patch is left out when the thread has time.
                volumes.push(mapper.volume(&map));
            }
            assert_eq!((mapper.len(), mapper.patches_skipped()), (3, 0));
            assert_eq!(mapper.snapshot(&map).patches.len(), 3);
        }
        let voxels = |volume: &Volume| volume.voxels().collect::<Vec<_>>();
        for k in 0..3 {
            assert_eq!(voxels(&volumes[k]), voxels(&volumes[k + 3]));
        }
        assert!(voxels(&volumes[2]).len() > 1000);
    }

    #[test]
    fn a_keyframe_with_the_view_of_the_last_patch_is_not_due() {
        let (map, relative_poses) = map();
        let mut mapper = mapper(Execution::Inline);
        let at = |x: f64, turn: f64| Pose::new(nalgebra::Vector3::new(x, -0.01, 0.0), nalgebra::Vector3::y() * turn);
        assert!(mapper.is_due(0, &at(0.0, 0.0)));
        mapper.insert(0, relative_poses[0], scene::wall(&CellGrid::new(&scene::camera(), 2), 2.0, None), &map);
        assert!(!mapper.is_due(100_000_000, &at(0.1, 0.05)));
        for (time_ns, pose) in [(600_000_000, at(0.0, 0.0)), (1, at(0.3, 0.0)), (1, at(0.0, 0.2))] {
            assert!(mapper.is_due(time_ns, &pose));
        }
    }

    #[test]
    fn patches_of_another_submap_are_left_out_until_it_is_merged() {
        let (map, relative_poses) = map();
        let mut mapper = mapper(Execution::Inline);
        let patch = scene::wall(&CellGrid::new(&scene::camera(), 2), 2.0, None);
        for (k, relative_pose) in [relative_poses[0], relative_poses[1], relative_poses[1]].into_iter().enumerate() {
            mapper.insert(k as i64, relative_pose, patch.clone(), &map);
        }
        let dense_map = mapper.snapshot(&map);
        assert_eq!(dense_map.patches.iter().map(|placed| placed.timestamp_ns).collect::<Vec<_>>(), [1, 2]);
        // Its pose is that of its keyframe combined with the relative pose.
        let t = dense_map.patches[0].t_world_cam.translation.vector;
        assert!((t - nalgebra::Vector3::new(0.3, -0.01, 0.0)).norm() < 1e-9, "{t}");
        assert_eq!(dense_map.unmerged.iter().map(|(at, placed)| (*at, placed.keyframe)).collect::<Vec<_>>(), [(0, 0)]);
    }

    #[test]
    fn patches_of_an_earlier_session_follow_the_corrections_of_the_next_one() {
        let (mut map, relative_poses) = map();
        let patch = scene::wall(&CellGrid::new(&scene::camera(), 2), 2.0, None);
        for execution in [Execution::Inline, Execution::Threaded] {
            let mut first = mapper(execution);
            for (k, relative_pose) in
                [relative_poses[0], relative_poses[1], relative_poses[0], relative_poses[1], relative_poses[1]]
                    .into_iter()
                    .enumerate()
            {
                first.insert(k as i64, relative_pose, patch.clone(), &map);
                first.volume(&map);
            }
            let dense_map = first.snapshot(&map);
            assert_eq!((dense_map.patches.len(), dense_map.unmerged.len()), (3, 2));
            // Two more patches of the other submap make it the larger one.
            let mut second = mapper(execution).with_earlier(dense_map.clone(), &map).unwrap();
            second.insert(10, relative_poses[0], patch.clone(), &map);
            second.volume(&map);
            second.insert(11, relative_poses[0], patch.clone(), &map);
            let after = second.snapshot(&map);
            assert_eq!(after.patches.iter().map(|placed| placed.timestamp_ns).collect::<Vec<_>>(), [0, 2, 10, 11]);
            assert_eq!(
                after.unmerged.iter().map(|(at, placed)| (*at, placed.timestamp_ns)).collect::<Vec<_>>(),
                [(1, 1), (3, 3), (4, 4)]
            );
            // A correction of the map moves the loaded patches.
            let (mut moved, by) = (mapper(execution).with_earlier(dense_map.clone(), &map).unwrap(), 0.5);
            let pose = map.keyframe(relative_poses[1].0).unwrap().t_cam_world;
            map.set_pose(relative_poses[1].0, pose * Pose::translation(0.0, -by, 0.0));
            for (before, after) in dense_map.patches.iter().zip(&moved.snapshot(&map).patches) {
                let step = after.t_world_cam.translation.vector - before.t_world_cam.translation.vector;
                assert!((step - nalgebra::Vector3::y() * by).norm() < 1e-9, "{step}");
            }
            map.set_pose(relative_poses[1].0, pose);
        }
    }

    #[test]
    fn classes_keep_their_numbers_when_a_later_session_has_another_detector() {
        let (map, _) = map();
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let mut first = mapper(Execution::Inline);
        first.name_classes(&names(&["person", "chair"]));
        assert_eq!(first.class_ids, Some(vec![1, 2]));
        let mut second = mapper(Execution::Inline).with_earlier(first.snapshot(&map), &map).unwrap();
        second.name_classes(&names(&["chair", "tv", "person"]));
        assert_eq!(second.class_ids, Some(vec![2, 3, 1]));
        assert_eq!(second.snapshot(&map).class_names, ["person", "chair", "tv"]);
        let many: Vec<String> = (0..300).map(|class| class.to_string()).collect();
        let mut third = mapper(Execution::Inline);
        third.name_classes(&many);
        assert_eq!(third.class_ids.unwrap()[253..257], [254, 255, 0, 0]);
    }

    #[test]
    fn patches_with_other_cells_or_of_another_map_are_refused() {
        let (map, relative_poses) = map();
        let mut first = mapper(Execution::Inline);
        first.insert(0, relative_poses[2], scene::wall(&CellGrid::new(&scene::camera(), 2), 2.0, None), &map);
        let dense_map = first.snapshot(&map);
        let error = mapper(Execution::Inline).with_earlier(dense_map.clone(), &Map::default()).err().unwrap();
        assert!(error.to_string().contains("keyframe 2"), "{error}");
        let other = DenseConfig { stride_px: 4, ..Default::default() };
        let other = DenseMapper::new(&other, &scene::camera(), Execution::Inline, &MapFrame::default()).unwrap();
        let error = other.with_earlier(dense_map, &map).err().unwrap().to_string();
        assert!(error.contains("cells of 2 px") && error.contains("dense.stride_px = 2"), "{error}");
    }
}

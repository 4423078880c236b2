//! The dense map beside the SLAM system: pieces that hang on keyframes, and the volume that follows them.
//!
//! In: pieces with the keyframe that each hangs on, and the map whenever it was corrected. Out: a volume that is consistent with the
//! trajectory at any time. With [`Execution::Inline`] it is entered at once; with [`Execution::Threaded`] on a thread of its own, which
//! tracking never waits for: a piece that comes while two are waiting is passed over.

use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;

use nalgebra::UnitQuaternion;

use crate::backend::Execution;
use crate::camera::Camera;
use crate::dense::piece::{CellGrid, Piece};
use crate::dense::volume::Volume;
use crate::dense::{DenseConfig, DenseError, Survey, SurveyPiece};
use crate::dynamic::Tie;
use crate::geometry::Pose;
use crate::image::{DepthImage, RgbImage};
use crate::map::{KeyFrameId, Map};

/// Pieces that may wait for the thread.
const WAITING: usize = 2;

/// Keeps the pieces of keyframes where the map has them.
pub struct DenseMapper {
    config: DenseConfig,
    grid: CellGrid,
    ties: Vec<Tie>,
    /// Time and pose, world from camera, of the last piece as it was cut.
    last: Option<(i64, Pose)>,
    keeper: Keeper,
    /// Memory of the pieces.
    bytes: usize,
    class_names: Vec<String>,
    passed_over: usize,
}

/// Where the pieces are kept and entered.
enum Keeper {
    Inline(Box<Store>),
    Threaded {
        sender: SyncSender<Order>,
        thread: JoinHandle<Store>,
    },
    /// The thread has ended by a panic.
    Gone,
}

/// What the thread is told.
enum Order {
    Follow(Vec<(i64, Piece)>, Vec<Option<Pose>>),
    Show(SyncSender<Volume>),
    Clear,
}

/// Pieces and volume.
#[derive(Clone, Debug)]
struct Store {
    grid: CellGrid,
    /// Turns the world so that the z-axis points up.
    up: UnitQuaternion<f64>,
    pieces: Vec<(i64, Piece)>,
    volume: Volume,
}

impl DenseMapper {
    /// A mapper for one camera. Its volume's z-axis points up in the first picture, as in ROS (REP 103).
    ///
    /// # Errors
    /// For a value of the configuration that cannot work, or if a thread cannot be started.
    pub fn new(config: &DenseConfig, camera: &Camera, execution: Execution) -> Result<Self, DenseError> {
        config.validate()?;
        let grid = CellGrid::new(camera, config.stride_px);
        let store =
            Store { grid: grid.clone(), up: super::up::of_camera(), pieces: Vec::new(), volume: Volume::new(config) };
        let keeper = match execution {
            Execution::Inline => Keeper::Inline(Box::new(store)),
            Execution::Threaded => {
                let (sender, orders) = sync_channel(WAITING);
                let builder = std::thread::Builder::new().name("yfslam-dense".into());
                Keeper::Threaded { sender, thread: builder.spawn(move || store.obey(&orders))? }
            }
        };
        let (ties, class_names) = (Vec::new(), Vec::new());
        Ok(Self { config: config.clone(), grid, ties, last: None, keeper, bytes: 0, class_names, passed_over: 0 })
    }

    /// The mapper with the pieces of an earlier session, whose `map` this session goes on with; they come before its own.
    ///
    /// # Errors
    /// If the pieces are of other cells or another map.
    pub fn with_pieces(mut self, survey: Survey, map: &Map) -> Result<Self, DenseError> {
        let Survey { grid, mut pieces, apart, class_names } = survey;
        if grid != self.grid {
            let (found, wanted) = (grid.stride_px(), self.grid.stride_px());
            let (width, height) = (grid.camera().width, grid.camera().height);
            return Err(DenseError::Cells { found, wanted, width, height });
        }
        for (at, one) in apart {
            pieces.insert(at.min(pieces.len()), one);
        }
        let keyframes: BTreeMap<u64, (KeyFrameId, Pose)> =
            map.keyframes().map(|(id, k)| (k.sequence, (id, k.t_cam_world))).collect();
        let mut known = Vec::with_capacity(pieces.len());
        for SurveyPiece { timestamp_ns, keyframe, t_world_cam, piece } in pieces {
            let (id, t_reference_world) = keyframes.get(&keyframe).ok_or(DenseError::Keyframe(keyframe))?;
            self.ties.push((*id, (t_reference_world * t_world_cam).inverse()));
            self.bytes += piece.bytes();
            known.push((timestamp_ns, piece));
        }
        self.class_names = class_names;
        let poses = self.poses(map);
        self.keeper.follow(known, poses);
        Ok(self)
    }

    /// The cells of its pieces.
    pub fn grid(&self) -> &CellGrid {
        &self.grid
    }

    /// Whether a keyframe tells enough beyond the last piece to become one.
    pub fn is_due(&self, timestamp_ns: i64, t_world_cam: &Pose) -> bool {
        let Some((last_ns, last)) = &self.last else { return true };
        let moved = last.inverse() * t_world_cam;
        let config = &self.config;
        moved.translation.vector.norm() >= config.min_move_m
            || moved.rotation.angle().to_degrees() >= config.min_turn_deg
            || timestamp_ns.saturating_sub(*last_ns) as f64 * 1e-9 >= config.min_gap_s
    }

    /// Cuts the piece of a frame: `moves(position, edge)` tells whether a position of the image, px, is within `edge` px of what moves.
    pub fn cut(&self, color: &RgbImage, depth: &DepthImage, moves: impl Fn([f32; 2], f32) -> bool) -> Piece {
        Piece::cut(&self.config, &self.grid, color, depth, moves)
    }

    /// What classes are in pieces of this mapper, by their place in `names`, those of a detector: as in those of an earlier session. Of
    /// more than 255 in all, the last are unknown.
    pub fn name_classes(&mut self, names: &[String]) -> Vec<u8> {
        let known = &mut self.class_names;
        let class = |name: &String| {
            let at = known.iter().position(|other| other == name).unwrap_or(known.len());
            if at == known.len() && at < usize::from(u8::MAX) {
                known.push(name.clone());
            }
            u8::try_from(at + 1).unwrap_or(0)
        };
        names.iter().map(class).collect()
    }

    /// Hangs a piece on a keyframe, and brings the volume to where the map has all pieces now.
    pub fn hang(&mut self, timestamp_ns: i64, tie: Tie, piece: Piece, map: &Map) {
        self.ties.push(tie);
        let poses = self.poses(map);
        let pose = poses.last().copied().flatten();
        let bytes = piece.bytes();
        if !self.keeper.follow(vec![(timestamp_ns, piece)], poses) {
            self.ties.pop();
            self.passed_over += 1;
            return;
        }
        self.bytes += bytes;
        if let Some(pose) = pose {
            self.last = Some((timestamp_ns, pose));
        }
    }

    /// Pieces that came when the thread was busy, and were left out.
    pub fn passed_over(&self) -> usize {
        self.passed_over
    }

    /// Number of pieces.
    pub fn len(&self) -> usize {
        self.ties.len()
    }

    /// Whether there are no pieces.
    pub fn is_empty(&self) -> bool {
        self.ties.is_empty()
    }

    /// Where the map has the pieces now, world from camera, and the root of the submap that defines this world; `None` for those of a
    /// submap that was given up.
    fn places(&self, map: &Map) -> Vec<Option<(KeyFrameId, Pose)>> {
        let place = |(keyframe, t_cam_reference): &Tie| {
            let (root, t_reference_world) = (map.root(*keyframe)?, map.keyframe_pose(*keyframe)?);
            Some((root, (t_cam_reference * t_reference_world).inverse()))
        };
        self.ties.iter().map(place).collect()
    }

    /// Where the map has the pieces of the submap that most of them are in, world from camera; `None` for the others.
    fn poses(&self, map: &Map) -> Vec<Option<Pose>> {
        let places = self.places(map);
        let largest = largest(&places);
        places.into_iter().map(|place| place.filter(|(root, _)| Some(*root) == largest).map(|(_, pose)| pose)).collect()
    }

    /// The volume as the map has the pieces now; waits for the thread, if there is one.
    pub fn volume(&mut self, map: &Map) -> Volume {
        let poses = self.poses(map);
        match &mut self.keeper {
            Keeper::Inline(store) => {
                store.follow(&poses);
                store.volume.settle();
                store.volume.clone()
            }
            Keeper::Threaded { sender, .. } => {
                let (reply, volume) = sync_channel(1);
                let asked =
                    sender.send(Order::Follow(Vec::new(), poses)).and_then(|()| sender.send(Order::Show(reply)));
                asked.ok().and_then(|()| volume.recv().ok()).unwrap_or_else(|| Volume::new(&self.config))
            }
            Keeper::Gone => Volume::new(&self.config),
        }
    }

    /// Bytes of memory that the pieces take.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// Forgets all: the map was begun anew.
    pub fn clear(&mut self) {
        self.ties.clear();
        self.last = None;
        self.bytes = 0;
        match &mut self.keeper {
            Keeper::Inline(store) => store.clear(),
            Keeper::Threaded { sender, .. } => {
                // A thread that has ended has nothing to forget.
                let _ = sender.send(Order::Clear);
            }
            Keeper::Gone => {}
        }
    }

    /// The pieces with their poses, for products and files. Waits for the thread, if there is one.
    pub fn into_survey(self, map: &Map) -> Survey {
        let places = self.places(map);
        let largest = largest(&places);
        let pieces = match self.keeper {
            Keeper::Inline(store) => store.pieces,
            Keeper::Threaded { sender, thread } => {
                drop(sender);
                // A panic was reported by its thread already.
                thread.join().map(|store| store.pieces).unwrap_or_default()
            }
            Keeper::Gone => Vec::new(),
        };
        let (grid, class_names) = (self.grid, self.class_names);
        let mut survey = Survey { pieces: Vec::new(), apart: Vec::new(), grid, class_names };
        for (((keyframe, _), place), (timestamp_ns, piece)) in self.ties.iter().zip(places).zip(pieces) {
            let Some(((root, t_world_cam), (keyframe, _))) = place.zip(map.standing(*keyframe)) else { continue };
            let one = SurveyPiece { timestamp_ns, keyframe: keyframe.sequence, t_world_cam, piece };
            if Some(root) == largest {
                survey.pieces.push(one);
            } else {
                survey.apart.push((survey.pieces.len() + survey.apart.len(), one));
            }
        }
        survey
    }
}

/// The root of the submap that most pieces are in; of equals the one begun first.
fn largest(places: &[Option<(KeyFrameId, Pose)>]) -> Option<KeyFrameId> {
    let mut counts: Vec<(usize, KeyFrameId)> = Vec::new();
    for (root, _) in places.iter().flatten() {
        match counts.iter_mut().find(|(_, other)| other == root) {
            Some((count, _)) => *count += 1,
            None => counts.push((1, *root)),
        }
    }
    counts.iter().rev().max_by_key(|(count, _)| *count).map(|(_, root)| *root)
}

impl Keeper {
    /// Returns whether the pieces were taken.
    fn follow(&mut self, pieces: Vec<(i64, Piece)>, poses: Vec<Option<Pose>>) -> bool {
        match self {
            Self::Inline(store) => {
                store.pieces.extend(pieces);
                store.follow(&poses);
                true
            }
            Self::Threaded { sender, .. } => match sender.try_send(Order::Follow(pieces, poses)) {
                Ok(()) => true,
                Err(TrySendError::Full(_)) => false,
                Err(TrySendError::Disconnected(_)) => {
                    *self = Self::Gone;
                    false
                }
            },
            Self::Gone => false,
        }
    }
}

impl Store {
    /// Works until nobody gives orders any more.
    fn obey(mut self, orders: &Receiver<Order>) -> Self {
        for order in orders {
            match order {
                Order::Follow(pieces, poses) => {
                    self.pieces.extend(pieces);
                    self.follow(&poses);
                }
                Order::Show(reply) => {
                    self.volume.settle();
                    // Whoever asked may have stopped waiting.
                    let _ = reply.send(self.volume.clone());
                }
                Order::Clear => self.clear(),
            }
        }
        self
    }

    /// Brings the volume to where the pieces hang.
    fn follow(&mut self, poses: &[Option<Pose>]) {
        for (number, ((_, piece), pose)) in self.pieces.iter().zip(poses).enumerate() {
            let pose = pose.map(|t_world_cam| self.up * t_world_cam);
            self.volume.place(number, &self.grid, piece, pose.as_ref());
        }
    }

    fn clear(&mut self) {
        self.pieces.clear();
        self.volume = Volume::new(self.volume.config());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense::scene;
    use crate::features::FrameFeatures;

    /// A map of three keyframes, 0.3 m apart, and one that stands alone.
    fn map() -> (Map, Vec<Tie>) {
        let mut map = Map::default();
        let tie = |k: i64| {
            let id = map.insert_keyframe(k, Pose::translation(-0.3 * k as f64, 0.0, 0.0), FrameFeatures::default());
            (id, Pose::translation(0.0, 0.01, 0.0))
        };
        let ties = (0..4).map(tie).collect::<Vec<_>>();
        (map, ties)
    }

    fn mapper(execution: Execution) -> DenseMapper {
        DenseMapper::new(&DenseConfig::default(), &scene::camera(), execution).unwrap()
    }

    #[test]
    fn on_its_own_thread_it_makes_the_same_map() {
        let (map, ties) = map();
        let mut volumes = Vec::new();
        for execution in [Execution::Inline, Execution::Threaded] {
            let mut mapper = mapper(execution);
            let piece = scene::wall(&CellGrid::new(&scene::camera(), 2), 2.0, Some(1.1));
            // One submap of one keyframe: the others have no parent either, so that the first is the largest.
            for k in 0..3 {
                mapper.hang(k, ties[0], piece.clone(), &map);
                // Nothing is passed over when the thread has time.
                volumes.push(mapper.volume(&map));
            }
            assert_eq!((mapper.len(), mapper.passed_over()), (3, 0));
            assert_eq!(mapper.into_survey(&map).pieces.len(), 3);
        }
        let voxels = |volume: &Volume| volume.voxels().collect::<Vec<_>>();
        for k in 0..3 {
            assert_eq!(voxels(&volumes[k]), voxels(&volumes[k + 3]));
        }
        assert!(voxels(&volumes[2]).len() > 1000);
    }

    #[test]
    fn a_keyframe_that_shows_the_same_as_the_last_piece_is_not_due() {
        let (map, ties) = map();
        let mut mapper = mapper(Execution::Inline);
        let at = |x: f64, turn: f64| Pose::new(nalgebra::Vector3::new(x, -0.01, 0.0), nalgebra::Vector3::y() * turn);
        assert!(mapper.is_due(0, &at(0.0, 0.0)));
        mapper.hang(0, ties[0], scene::wall(&CellGrid::new(&scene::camera(), 2), 2.0, None), &map);
        assert!(!mapper.is_due(100_000_000, &at(0.1, 0.05)));
        for (time_ns, pose) in [(600_000_000, at(0.0, 0.0)), (1, at(0.3, 0.0)), (1, at(0.0, 0.2))] {
            assert!(mapper.is_due(time_ns, &pose));
        }
    }

    #[test]
    fn pieces_of_another_submap_are_left_out_until_it_is_joined() {
        let (map, ties) = map();
        let mut mapper = mapper(Execution::Inline);
        let piece = scene::wall(&CellGrid::new(&scene::camera(), 2), 2.0, None);
        for (k, tie) in [ties[0], ties[1], ties[1]].into_iter().enumerate() {
            mapper.hang(k as i64, tie, piece.clone(), &map);
        }
        let survey = mapper.into_survey(&map);
        assert_eq!(survey.pieces.iter().map(|one| one.timestamp_ns).collect::<Vec<_>>(), [1, 2]);
        // It hangs where its keyframe is, seen from where it was.
        let t = survey.pieces[0].t_world_cam.translation.vector;
        assert!((t - nalgebra::Vector3::new(0.3, -0.01, 0.0)).norm() < 1e-9, "{t}");
        assert_eq!(survey.apart.iter().map(|(at, one)| (*at, one.keyframe)).collect::<Vec<_>>(), [(0, 0)]);
    }

    #[test]
    fn pieces_of_an_earlier_session_follow_its_map_in_the_next_one() {
        let (mut map, ties) = map();
        let piece = scene::wall(&CellGrid::new(&scene::camera(), 2), 2.0, None);
        for execution in [Execution::Inline, Execution::Threaded] {
            let mut first = mapper(execution);
            for (k, tie) in [ties[0], ties[1], ties[0], ties[1], ties[1]].into_iter().enumerate() {
                first.hang(k as i64, tie, piece.clone(), &map);
                first.volume(&map);
            }
            let survey = first.into_survey(&map);
            assert_eq!((survey.pieces.len(), survey.apart.len()), (3, 2));
            // Two more of the other submap make it the larger one.
            let mut second = mapper(execution).with_pieces(survey.clone(), &map).unwrap();
            second.hang(10, ties[0], piece.clone(), &map);
            second.volume(&map);
            second.hang(11, ties[0], piece.clone(), &map);
            let after = second.into_survey(&map);
            assert_eq!(after.pieces.iter().map(|one| one.timestamp_ns).collect::<Vec<_>>(), [0, 2, 10, 11]);
            assert_eq!(
                after.apart.iter().map(|(at, one)| (*at, one.timestamp_ns)).collect::<Vec<_>>(),
                [(1, 1), (3, 3), (4, 4)]
            );
            // A correction moves what was loaded.
            let (moved, by) = (mapper(execution).with_pieces(survey.clone(), &map).unwrap(), 0.5);
            let pose = map.keyframe(ties[1].0).unwrap().t_cam_world;
            map.set_pose(ties[1].0, pose * Pose::translation(0.0, -by, 0.0));
            for (before, after) in survey.pieces.iter().zip(&moved.into_survey(&map).pieces) {
                let step = after.t_world_cam.translation.vector - before.t_world_cam.translation.vector;
                assert!((step - nalgebra::Vector3::y() * by).norm() < 1e-9, "{step}");
            }
            map.set_pose(ties[1].0, pose);
        }
    }

    #[test]
    fn classes_keep_their_numbers_when_a_later_session_has_another_detector() {
        let (map, _) = map();
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let mut first = mapper(Execution::Inline);
        assert_eq!(first.name_classes(&names(&["person", "chair"])), [1, 2]);
        let mut second = mapper(Execution::Inline).with_pieces(first.into_survey(&map), &map).unwrap();
        assert_eq!(second.name_classes(&names(&["chair", "tv", "person"])), [2, 3, 1]);
        assert_eq!(second.into_survey(&map).class_names, ["person", "chair", "tv"]);
        let many: Vec<String> = (0..300).map(|class| class.to_string()).collect();
        assert_eq!(mapper(Execution::Inline).name_classes(&many)[253..257], [254, 255, 0, 0]);
    }

    #[test]
    fn pieces_of_other_cells_or_of_another_map_are_refused() {
        let (map, ties) = map();
        let mut first = mapper(Execution::Inline);
        first.hang(0, ties[2], scene::wall(&CellGrid::new(&scene::camera(), 2), 2.0, None), &map);
        let survey = first.into_survey(&map);
        let error = mapper(Execution::Inline).with_pieces(survey.clone(), &Map::default()).err().unwrap();
        assert!(error.to_string().contains("keyframe 2"), "{error}");
        let coarse = DenseConfig { stride_px: 4, ..Default::default() };
        let coarse = DenseMapper::new(&coarse, &scene::camera(), Execution::Inline).unwrap();
        let error = coarse.with_pieces(survey, &map).err().unwrap().to_string();
        assert!(error.contains("cells of 2 px") && error.contains("dense.stride_px = 2"), "{error}");
    }
}

//! Comparison of a depth image with the depth history: depth images of the last seconds.
//!
//! In: coarse depth of the frame and its first pose. Out: cells that something has moved into, and cells that are unchanged. The
//! test is that of DynaSLAM (IEEE RA-L 2018, section III-C), on the whole image instead of key points: a cell has moved if its
//! depth is clearly less than the history predicts for its direction.

use std::collections::VecDeque;

use nalgebra::{Isometry3, Point3};

use crate::config::FullConfig;
use crate::context::SensorModel;
use crate::dynamic::FirstPose;
use crate::geometry::Pose;
use crate::map::KeyframeRelativePose;

/// Side of a cell of the depth history, px.
const CELL_PX: usize = 8;

/// Depth of an earlier frame, without what moved in it.
#[derive(Clone, Debug)]
struct Entry {
    timestamp_ns: i64,
    relative_pose: KeyframeRelativePose,
    depth_m: Vec<f32>,
}

/// The depth history and the comparison with it. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub(super) struct DepthHistory {
    columns: usize,
    rows: usize,
    /// Viewing ray of each cell, x and y at depth 1, undistorted.
    rays: Vec<[f32; 2]>,
    entries: VecDeque<Entry>,
    /// Buffers for future entries, allocated at the start so that later frames allocate nothing.
    spare: Vec<Vec<f32>>,
    /// Depth that an entry predicts for each cell, m; infinite where it predicts none.
    predicted_m: Vec<f32>,
    /// Number of entries for which the frame is nearer than predicted, by cell.
    nearer: Vec<u8>,
    /// Number of entries that predict the measured depth within the tolerance, by cell.
    similar: Vec<u8>,
    /// Number of entries that predict the measured depth within half the tolerance, by cell.
    same: Vec<u8>,
    /// Cells of the connected component that is being collected.
    component: Vec<u32>,
}

impl DepthHistory {
    /// Returns whether a frame at this time is to be inserted.
    pub(super) fn is_due(&self, config: &FullConfig, timestamp_ns: i64) -> bool {
        let since_s = |entry: &Entry| timestamp_ns.saturating_sub(entry.timestamp_ns) as f64 * 1e-9;
        self.entries.back().is_none_or(|entry| since_s(entry) >= config.history_spacing_s)
    }

    /// Inserts a frame: depths of its cells, m; 0 where unknown or moving. The oldest entry is removed if there are too many.
    pub(super) fn insert(
        &mut self,
        config: &FullConfig,
        timestamp_ns: i64,
        relative_pose: KeyframeRelativePose,
        depth_m: &[f32],
    ) {
        let oldest = if self.entries.len() >= config.history_frames { self.entries.pop_front() } else { None };
        let mut buffer = oldest.map(|entry| entry.depth_m).or_else(|| self.spare.pop()).unwrap_or_default();
        buffer.clear();
        buffer.extend_from_slice(depth_m);
        self.entries.push_back(Entry { timestamp_ns, relative_pose, depth_m: buffer });
    }

    /// Removes all entries.
    pub(super) fn clear(&mut self) {
        self.spare.extend(self.entries.drain(..).map(|entry| entry.depth_m));
    }

    /// Compares the depths of the frame's cells with all entries whose camera was near enough.
    pub(super) fn compare(&mut self, config: &FullConfig, first: &FirstPose<'_>, depth_m: &[f32]) {
        let FirstPose { sensor, map, t_cam_world, .. } = *first;
        self.prepare(config, sensor);
        self.nearer.clear();
        self.nearer.resize(depth_m.len(), 0);
        self.similar.clear();
        self.similar.resize(depth_m.len(), 0);
        self.same.clear();
        self.same.resize(depth_m.len(), 0);
        for index in 0..self.entries.len() {
            let entry = &self.entries[index];
            let (reference, t_entry_reference) = entry.relative_pose;
            let Some(t_reference_world) = map.keyframe_pose(reference) else { continue };
            let t_cam_entry = t_cam_world * (t_entry_reference * t_reference_world).inverse();
            if t_cam_entry.translation.vector.norm() > config.history_max_distance_m
                || t_cam_entry.rotation.angle() > config.history_max_angle_deg.to_radians()
            {
                continue;
            }
            self.predict(index, sensor, &t_cam_entry);
            self.compare_with_prediction(config, depth_m);
        }
    }

    /// Returns whether a cell is unchanged with respect to the history; `None` if too few entries observe it.
    pub(super) fn is_static(&self, cell: usize) -> Option<bool> {
        let (same, nearer) = (self.same[cell], self.nearer[cell]);
        (same.max(nearer) >= 2).then_some(same > nearer)
    }

    fn prepare(&mut self, config: &FullConfig, sensor: &SensorModel) {
        if !self.rays.is_empty() {
            return;
        }
        let camera = &sensor.camera;
        (self.columns, self.rows) = (camera.width / CELL_PX, camera.height / CELL_PX);
        for row in 0..self.rows {
            for column in 0..self.columns {
                let middle = |k: usize| (k * CELL_PX) as f64 + 2.0;
                let [x, y] = camera.undistort(middle(column), middle(row));
                self.rays.push([x as f32, y as f32]);
            }
        }
        let missing = config.history_frames.saturating_sub(self.entries.len() + self.spare.len());
        self.entries.reserve(missing);
        self.component.reserve(self.rays.len());
        self.spare.reserve(config.history_frames);
        self.spare.extend((0..missing).map(|_| Vec::with_capacity(self.rays.len())));
    }

    /// Returns the cell of a direction, `None` outside the image.
    #[inline]
    fn cell_of(&self, sensor: &SensorModel, x: f32, y: f32) -> Option<usize> {
        let p = &sensor.pinhole;
        let u = (p.fx as f32 * x + p.cx as f32) / CELL_PX as f32;
        let v = (p.fy as f32 * y + p.cy as f32) / CELL_PX as f32;
        let inside = u >= 0.0 && v >= 0.0 && u < self.columns as f32 && v < self.rows as f32;
        inside.then(|| v as usize * self.columns + u as usize)
    }

    /// Predicts the depth of each cell from an entry.
    fn predict(&mut self, index: usize, sensor: &SensorModel, t_cam_entry: &Pose) {
        let t: Isometry3<f32> = t_cam_entry.cast();
        self.predicted_m.clear();
        self.predicted_m.resize(self.columns * self.rows, f32::INFINITY);
        for cell in 0..self.rays.len() {
            let z = self.entries[index].depth_m[cell];
            if z <= 0.0 {
                continue;
            }
            let [x, y] = self.rays[cell];
            let p = t * Point3::new(x * z, y * z, z);
            if p.z > 0.1
                && let Some(target) = self.cell_of(sensor, p.x / p.z, p.y / p.z)
            {
                self.predicted_m[target] = self.predicted_m[target].min(p.z);
            }
        }
    }

    /// Counts for each cell whether the measured depth agrees with the prediction or is nearer.
    fn compare_with_prediction(&mut self, config: &FullConfig, depth_m: &[f32]) {
        for row in 1..self.rows.saturating_sub(1) {
            for column in 1..self.columns.saturating_sub(1) {
                let cell = row * self.columns + column;
                let z = depth_m[cell];
                if z <= 0.0 {
                    continue;
                }
                let tolerance = config.history_tolerance_m + config.history_tolerance_share * z;
                let (mut known, mut least, mut error) = (0, f32::INFINITY, f32::INFINITY);
                for r in row - 1..=row + 1 {
                    for &p in &self.predicted_m[r * self.columns + column - 1..=r * self.columns + column + 1] {
                        known += usize::from(p.is_finite());
                        least = least.min(p);
                        error = error.min((p - z).abs());
                    }
                }
                if error <= tolerance {
                    self.similar[cell] = self.similar[cell].saturating_add(1);
                    self.same[cell] = self.same[cell].saturating_add(u8::from(error <= 0.5 * tolerance));
                } else if known >= 3 && z < least - tolerance {
                    self.nearer[cell] = self.nearer[cell].saturating_add(1);
                }
            }
        }
    }

    /// Calls `moving` with each cell (column, row) of the connected components that are nearer than the history predicts; `depth_m`
    /// are the compared depths, but 0 where motion is already known.
    pub(super) fn for_each_moving_cell(
        &mut self,
        config: &FullConfig,
        depth_m: &[f32],
        mut moving: impl FnMut(usize, usize),
    ) {
        let columns = self.columns;
        for seed in 0..depth_m.len() {
            if !self.is_moving(seed, depth_m) {
                continue;
            }
            self.component.clear();
            self.component.push(seed as u32);
            self.nearer[seed] = 0;
            let mut next = 0;
            while let Some(&cell) = self.component.get(next) {
                next += 1;
                let cell = cell as usize;
                for neighbour in [cell.wrapping_sub(columns), cell + columns, cell.wrapping_sub(1), cell + 1] {
                    if neighbour < depth_m.len()
                        && self.is_moving(neighbour, depth_m)
                        && (depth_m[neighbour] - depth_m[cell]).abs() <= config.history_cluster_step_m
                    {
                        self.nearer[neighbour] = 0;
                        self.component.push(neighbour as u32);
                    }
                }
            }
            if self.component.len() >= config.history_min_cells {
                for &cell in &self.component {
                    moving(cell as usize % columns, cell as usize / columns);
                }
            }
        }
    }

    fn is_moving(&self, cell: usize, depth_m: &[f32]) -> bool {
        depth_m[cell] > 0.0
            && self.nearer[cell] >= 2
            && u16::from(self.nearer[cell]) > 2 * u16::from(self.similar[cell])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::config::Config;
    use crate::features::FrameFeatures;
    use crate::map::Map;

    /// Returns the moving cells of a frame that shows `shown` after a history of `before`, with the camera moved by `moved`.
    fn moving_cells(before: impl Fn(usize) -> f32, shown: impl Fn(usize) -> f32, moved: Pose) -> Vec<(usize, usize)> {
        let distortion = [0.2, -0.4, 0.001, 0.0, 0.0];
        let (fx, fy, cx, cy) = (520.0, 520.0, 320.0, 240.0);
        let camera = Camera::pinhole(640, 480, fx, fy, cx, cy).with_distortion(distortion);
        let config = Config::default();
        let sensor = SensorModel::new(&camera, &config, &[1.0]);
        let mut map = Map::default();
        let reference = map.insert_keyframe(0, Pose::identity(), FrameFeatures::default());
        let mut history = DepthHistory::default();
        let depths = |rule: &dyn Fn(usize) -> f32| (0..80 * 60).map(|cell| rule(cell % 80)).collect::<Vec<f32>>();
        for _ in 0..3 {
            history.insert(&config.dynamic.full, 0, (reference, Pose::identity()), &depths(&before));
        }
        let first = FirstPose { timestamp_ns: 0, sensor: &sensor, map: &map, t_cam_world: &moved };
        let mut cells = Vec::new();
        history.compare(&config.dynamic.full, &first, &depths(&shown));
        history.for_each_moving_cell(&config.dynamic.full, &depths(&shown), |column, row| cells.push((column, row)));
        cells
    }

    #[test]
    fn an_object_that_appears_before_a_wall_moves_and_one_that_leaves_does_not() {
        let wall = |_: usize| 3.0;
        let person = |column: usize| if (30..40).contains(&column) { 1.5 } else { 3.0 };
        let moved = Pose::translation(0.02, 0.01, 0.03);
        let cells = moving_cells(wall, person, moved);
        assert!(cells.len() > 400 && cells.iter().all(|(column, _)| (30..40).contains(column)), "{cells:?}");
        assert_eq!(moving_cells(person, wall, moved), []);
    }

    #[test]
    fn a_static_object_does_not_move_while_the_camera_does() {
        let desk = |column: usize| if (30..40).contains(&column) { 1.5 } else { 3.0 };
        // From 10 cm farther left, an object 1.5 m away appears 35 px farther right: 4 cells.
        let shifted = |column: usize| if (34..44).contains(&column) { 1.5 } else { 3.0 };
        assert_eq!(moving_cells(desk, shifted, Pose::translation(0.1, 0.0, 0.0)), []);
    }

    #[test]
    fn an_entry_from_too_far_away_is_ignored() {
        assert_eq!(moving_cells(|_| 3.0, |_| 1.0, Pose::translation(1.5, 0.0, 0.0)), []);
    }
}

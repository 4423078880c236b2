//! What has moved since it was last seen, whatever it is: the depth image against those of a few earlier frames.
//!
//! In: coarse depth of the frame, its first pose, earlier views. Out: cells where something stands that was not there before, and cells
//! where all is as it was. The test is that of DynaSLAM (IEEE RA-L 2018, section III-C), on all of the image instead of key points: a depth that is clearly less than
//! what earlier views say about that direction.

use std::collections::VecDeque;

use nalgebra::{Isometry3, Point3};

use crate::config::FullConfig;
use crate::context::SensorModel;
use crate::dynamic::FirstPose;
use crate::geometry::Pose;
use crate::map::KeyframeRelativePose;

/// Side of a cell, px.
pub(super) const VIEW_CELL_PX: usize = 8;

/// Depth of an earlier frame, without what moved in it.
#[derive(Clone, Debug)]
struct View {
    timestamp_ns: i64,
    relative_pose: KeyframeRelativePose,
    depth_m: Vec<f32>,
}

/// Earlier views, and the comparison with them. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub(super) struct DepthHistory {
    columns: usize,
    rows: usize,
    /// Direction of each cell, x and y at depth 1, lens distortion removed.
    rays: Vec<[f32; 2]>,
    ring: VecDeque<View>,
    /// Buffers for views to come: made at the start, so that no later frame has to.
    spare: Vec<Vec<f32>>,
    /// Depth that a view predicts for each cell, m; infinite where it says nothing.
    predicted_m: Vec<f32>,
    nearer: Vec<u8>,
    alike: Vec<u8>,
    /// DepthHistory that predict what the frame sees, within half the tolerance.
    same: Vec<u8>,
    component: Vec<u32>,
}

impl DepthHistory {
    /// Whether a frame at this time should be kept.
    pub(super) fn is_due(&self, config: &FullConfig, timestamp_ns: i64) -> bool {
        let since_s = |view: &View| timestamp_ns.saturating_sub(view.timestamp_ns) as f64 * 1e-9;
        self.ring.back().is_none_or(|view| since_s(view) >= config.history_spacing_s)
    }

    /// Keeps a frame: depths of its cells, 0 where it is unknown or moves.
    pub(super) fn keep(
        &mut self,
        config: &FullConfig,
        timestamp_ns: i64,
        relative_pose: KeyframeRelativePose,
        depth_m: &[f32],
    ) {
        let oldest = if self.ring.len() >= config.history_frames { self.ring.pop_front() } else { None };
        let mut buffer = oldest.map(|view| view.depth_m).or_else(|| self.spare.pop()).unwrap_or_default();
        buffer.clear();
        buffer.extend_from_slice(depth_m);
        self.ring.push_back(View { timestamp_ns, relative_pose, depth_m: buffer });
    }

    /// Forgets all.
    pub(super) fn clear(&mut self) {
        self.spare.extend(self.ring.drain(..).map(|view| view.depth_m));
    }

    /// Compares the depths of the frame's cells with all views that tell something about them.
    pub(super) fn compare_all(&mut self, config: &FullConfig, first: &FirstPose<'_>, depth_m: &[f32]) {
        let FirstPose { sensor, map, t_cam_world } = *first;
        self.prepare(config, sensor);
        self.nearer.clear();
        self.nearer.resize(depth_m.len(), 0);
        self.alike.clear();
        self.alike.resize(depth_m.len(), 0);
        self.same.clear();
        self.same.resize(depth_m.len(), 0);
        for index in 0..self.ring.len() {
            let view = &self.ring[index];
            let (reference, t_view_reference) = view.relative_pose;
            let Some(t_reference_world) = map.keyframe_pose(reference) else { continue };
            let t_cam_view = t_cam_world * (t_view_reference * t_reference_world).inverse();
            if t_cam_view.translation.vector.norm() > config.history_max_distance_m
                || t_cam_view.rotation.angle() > config.history_max_angle_deg.to_radians()
            {
                continue;
            }
            self.predict(index, sensor, &t_cam_view);
            self.compare(config, depth_m);
        }
    }

    /// Whether a cell shows what stood there in earlier views; `None` if they do not tell.
    pub(super) fn is_as_before(&self, cell: usize) -> Option<bool> {
        let (same, nearer) = (self.same[cell], self.nearer[cell]);
        (same.max(nearer) >= 2).then_some(same > nearer)
    }

    fn prepare(&mut self, config: &FullConfig, sensor: &SensorModel) {
        if !self.rays.is_empty() {
            return;
        }
        let camera = &sensor.camera;
        (self.columns, self.rows) = (camera.width / VIEW_CELL_PX, camera.height / VIEW_CELL_PX);
        for row in 0..self.rows {
            for column in 0..self.columns {
                let middle = |k: usize| (k * VIEW_CELL_PX) as f64 + 2.0;
                let [x, y] = camera.undistort(middle(column), middle(row));
                self.rays.push([x as f32, y as f32]);
            }
        }
        let missing = config.history_frames.saturating_sub(self.ring.len() + self.spare.len());
        self.ring.reserve(missing);
        self.component.reserve(self.rays.len());
        self.spare.reserve(config.history_frames);
        self.spare.extend((0..missing).map(|_| Vec::with_capacity(self.rays.len())));
    }

    /// The cell of a direction, if it is in the picture.
    #[inline]
    fn cell_of(&self, sensor: &SensorModel, x: f32, y: f32) -> Option<usize> {
        let p = &sensor.pinhole;
        let u = (p.fx as f32 * x + p.cx as f32) / VIEW_CELL_PX as f32;
        let v = (p.fy as f32 * y + p.cy as f32) / VIEW_CELL_PX as f32;
        let inside = u >= 0.0 && v >= 0.0 && u < self.columns as f32 && v < self.rows as f32;
        inside.then(|| v as usize * self.columns + u as usize)
    }

    /// The depth of each cell as a view has it.
    fn predict(&mut self, index: usize, sensor: &SensorModel, t_cam_view: &Pose) {
        let t: Isometry3<f32> = t_cam_view.cast();
        self.predicted_m.clear();
        self.predicted_m.resize(self.columns * self.rows, f32::INFINITY);
        for cell in 0..self.rays.len() {
            let z = self.ring[index].depth_m[cell];
            if z <= 0.0 {
                continue;
            }
            let [x, y] = self.rays[cell];
            let p = t * Point3::new(x * z, y * z, z);
            if p.z > 0.1
                && let Some(place) = self.cell_of(sensor, p.x / p.z, p.y / p.z)
            {
                self.predicted_m[place] = self.predicted_m[place].min(p.z);
            }
        }
    }

    /// Counts, for each cell, whether the frame sees what the view predicts, or something nearer.
    fn compare(&mut self, config: &FullConfig, depth_m: &[f32]) {
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
                    self.alike[cell] = self.alike[cell].saturating_add(1);
                    self.same[cell] = self.same[cell].saturating_add(u8::from(error <= 0.5 * tolerance));
                } else if known >= 3 && z < least - tolerance {
                    self.nearer[cell] = self.nearer[cell].saturating_add(1);
                }
            }
        }
    }

    /// Calls `moving` with each cell (column, row) of what stands nearer than earlier views allow; `depth_m` are those compared, 0 where
    /// it is known already that something moves.
    pub(super) fn clusters(&mut self, config: &FullConfig, depth_m: &[f32], mut moving: impl FnMut(usize, usize)) {
        let columns = self.columns;
        for seed in 0..depth_m.len() {
            if !self.is_new(seed, depth_m) {
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
                        && self.is_new(neighbour, depth_m)
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

    fn is_new(&self, cell: usize, depth_m: &[f32]) -> bool {
        depth_m[cell] > 0.0 && self.nearer[cell] >= 2 && u16::from(self.nearer[cell]) > 2 * u16::from(self.alike[cell])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::config::Config;
    use crate::features::FrameFeatures;
    use crate::map::Map;

    /// Cells that are reported when `shown` comes after a few views of `before`, the camera having moved by `moved`.
    fn reported(before: impl Fn(usize) -> f32, shown: impl Fn(usize) -> f32, moved: Pose) -> Vec<(usize, usize)> {
        let distortion = [0.2, -0.4, 0.001, 0.0, 0.0];
        let (fx, fy, cx, cy) = (520.0, 520.0, 320.0, 240.0);
        let camera = Camera::pinhole(640, 480, fx, fy, cx, cy).with_distortion(distortion);
        let config = Config::default();
        let sensor = SensorModel::new(&camera, &config, &[1.0]);
        let mut map = Map::default();
        let reference = map.insert_keyframe(0, Pose::identity(), FrameFeatures::default());
        let mut views = DepthHistory::default();
        let depths = |rule: &dyn Fn(usize) -> f32| (0..80 * 60).map(|cell| rule(cell % 80)).collect::<Vec<f32>>();
        for _ in 0..3 {
            views.keep(&config.dynamic.full, 0, (reference, Pose::identity()), &depths(&before));
        }
        let first = FirstPose { sensor: &sensor, map: &map, t_cam_world: &moved };
        let mut cells = Vec::new();
        views.compare_all(&config.dynamic.full, &first, &depths(&shown));
        views.clusters(&config.dynamic.full, &depths(&shown), |column, row| cells.push((column, row)));
        cells
    }

    #[test]
    fn what_came_between_camera_and_wall_is_found_and_what_left_is_not() {
        let wall = |_: usize| 3.0;
        let somebody = |column: usize| if (30..40).contains(&column) { 1.5 } else { 3.0 };
        let moved = Pose::translation(0.02, 0.01, 0.03);
        let cells = reported(wall, somebody, moved);
        assert!(cells.len() > 400 && cells.iter().all(|(column, _)| (30..40).contains(column)), "{cells:?}");
        assert_eq!(reported(somebody, wall, moved), []);
    }

    #[test]
    fn what_stands_still_is_not_found_while_the_camera_moves() {
        let desk = |column: usize| if (30..40).contains(&column) { 1.5 } else { 3.0 };
        // Seen from 10 cm farther left, what is 1.5 m away lies 35 px farther right: 4 cells.
        let shifted = |column: usize| if (34..44).contains(&column) { 1.5 } else { 3.0 };
        assert_eq!(reported(desk, shifted, Pose::translation(0.1, 0.0, 0.0)), []);
    }

    #[test]
    fn a_view_from_far_away_tells_nothing() {
        assert_eq!(reported(|_| 3.0, |_| 1.0, Pose::translation(1.5, 0.0, 0.0)), []);
    }
}

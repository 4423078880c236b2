//! Bundle adjustment of hundreds of poses, by Levenberg–Marquardt with the Schur complement (Triggs et al., Bundle Adjustment: a Modern
//! Synthesis, 2000, section 6.1).
//!
//! In: a copy of a part of the map: poses, points and the views of the points. Out: refined poses and points. The reduced system couples only
//! poses that share points; it is held as sparse blocks, so that time and memory grow about as the number of poses. [`schur`](super::schur)
//! solves small windows, in which nearly all poses share points.

use nalgebra::{Matrix3, Matrix6, Point3, SMatrix, Vector3, Vector6};

use super::block_cholesky::BlockSystem;
use crate::config::BundleConfig;
use crate::geometry::{Pinhole, Pose, perturbed, skew};
use crate::optimize::residual::{Measurement, huber, projection_jacobian};

type Matrix6x3 = SMatrix<f64, 6, 3>;

/// Least depth of a point with a usable projection, m.
const MIN_DEPTH_M: f64 = 1e-3;

/// A view of a point from a pose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    /// Index into [`LargeBundle::poses`].
    pub pose: usize,
    /// Measured position and disparity.
    pub measurement: Measurement,
    /// Static probability, in [0, 1]; a view with 0 is ignored.
    pub trust: f64,
}

/// A copy of a part of the map.
#[derive(Clone, Debug)]
pub(crate) struct LargeBundle {
    /// Camera of all poses.
    pub camera: Pinhole,
    /// `t_cam_world` of each keyframe; the first `free_poses` are adjusted, the others are fixed.
    pub poses: Vec<Pose>,
    /// Number of poses that are adjusted.
    pub free_poses: usize,
    /// Landmarks in the world, m.
    pub points: Vec<Point3<f64>>,
    /// Views, those of the same point one after another.
    pub views: Vec<View>,
    /// Start of the views of each point: those of point i are `start[i]..start[i + 1]`.
    pub start: Vec<usize>,
}

impl LargeBundle {
    /// Adjusts for as long as `go_on` returns true: some steps with Huber loss, removal of outliers, then more steps without it.
    pub(crate) fn adjust(&mut self, config: &BundleConfig, go_on: &dyn Fn() -> bool) {
        if self.free_poses == 0 || !go_on() {
            return;
        }
        let mut equations = Equations::new(self);
        self.solve(&mut equations, config, config.first_iterations, true, go_on);
        self.drop_outliers();
        self.solve(&mut equations, config, config.second_iterations, false, go_on);
        self.drop_outliers();
    }

    /// Minimises the cost by at most `iterations` steps, with Huber loss if `robust`.
    fn solve(
        &mut self,
        equations: &mut Equations,
        config: &BundleConfig,
        iterations: usize,
        robust: bool,
        go_on: &dyn Fn() -> bool,
    ) {
        let mut cost = self.cost(robust);
        let mut lambda = config.initial_damping;
        let mut stale = true;
        for _ in 0..iterations {
            if !go_on() {
                return;
            }
            if stale {
                equations.linearise(self, robust);
                stale = false;
            }
            if !go_on() {
                return;
            }
            let Some((poses, points)) = equations.step(self, lambda) else {
                lambda *= 10.0;
                continue;
            };
            let before = (std::mem::replace(&mut self.poses, poses), std::mem::replace(&mut self.points, points));
            let new_cost = self.cost(robust);
            // A comparison with NaN is false, so that a step to an invalid cost is rejected.
            if new_cost <= cost {
                let gain = cost - new_cost;
                cost = new_cost;
                lambda *= 0.2;
                stale = true;
                if gain < config.relative_tolerance * cost {
                    return;
                }
            } else {
                (self.poses, self.points) = before;
                lambda *= 10.0;
            }
        }
    }

    /// Returns the views of a point.
    fn views_of(&self, point: usize) -> std::ops::Range<usize> {
        self.start[point]..self.start[point + 1]
    }

    /// Returns the sum of the losses. A point behind its camera costs its χ² limit.
    fn cost(&self, robust: bool) -> f64 {
        let mut sum = 0.0;
        for (i, point) in self.points.iter().enumerate() {
            for view in self.views[self.views_of(i)].iter().filter(|view| view.trust > 0.0) {
                let p = (self.poses[view.pose] * point).coords;
                let limit = view.measurement.chi2_limit();
                if p.z <= MIN_DEPTH_M {
                    sum += view.trust * limit;
                    continue;
                }
                let chi2 = view.measurement.chi2(&view.measurement.residual(&self.camera, &p));
                sum += view.trust * if robust { huber(chi2, limit).0 } else { chi2 };
            }
        }
        sum
    }

    /// Sets the trust of views to 0 if they fail the χ² test or lie behind their camera.
    fn drop_outliers(&mut self) {
        for i in 0..self.points.len() {
            for view in self.start[i]..self.start[i + 1] {
                let view = &mut self.views[view];
                let p = (self.poses[view.pose] * self.points[i]).coords;
                let m = &view.measurement;
                if p.z <= MIN_DEPTH_M || m.chi2(&m.residual(&self.camera, &p)) > m.chi2_limit() {
                    view.trust = 0.0;
                }
            }
        }
    }
}

/// The normal equations, and the reduced system of the poses.
struct Equations {
    pose_blocks: Vec<Matrix6<f64>>,
    pose_rhs: Vec<Vector6<f64>>,
    point_blocks: Vec<Matrix3<f64>>,
    point_rhs: Vec<Vector3<f64>>,
    /// Block of pose and point of each view; zero for fixed poses.
    coupling: Vec<Matrix6x3>,
    /// Point and view of each view of a free pose, by the place of the pose in the reduced system.
    by_place: Vec<Vec<(u32, u32)>>,
    /// Free pose at each place.
    pose_at: Vec<usize>,
    reduced: BlockSystem<6>,
}

impl Equations {
    fn new(bundle: &LargeBundle) -> Self {
        let n = bundle.free_poses;
        let mut pairs: Vec<(u32, u32)> = Vec::new();
        let mut free: Vec<u32> = Vec::new();
        for point in 0..bundle.points.len() {
            free.clear();
            free.extend(bundle.views[bundle.views_of(point)].iter().map(|view| view.pose as u32));
            free.retain(|pose| (*pose as usize) < n);
            free.sort_unstable();
            for (i, a) in free.iter().enumerate() {
                pairs.extend(free[i + 1..].iter().map(|b| (*a, *b)));
            }
            // The list of all pairs would be many times as long as that of different ones.
            if pairs.len() > 1 << 20 && pairs.len() > pairs.capacity() / 2 {
                pairs.sort_unstable();
                pairs.dedup();
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        let reduced = BlockSystem::new(n, pairs.into_iter().map(|(a, b)| (a as usize, b as usize)));
        let mut by_place = vec![Vec::new(); n];
        let mut pose_at = vec![0; n];
        for point in 0..bundle.points.len() {
            for i in bundle.views_of(point) {
                let pose = bundle.views[i].pose;
                if pose < n {
                    by_place[reduced.place(pose)].push((point as u32, i as u32));
                }
            }
        }
        (0..n).for_each(|pose| pose_at[reduced.place(pose)] = pose);
        Self {
            pose_blocks: vec![Matrix6::zeros(); n],
            pose_rhs: vec![Vector6::zeros(); n],
            point_blocks: vec![Matrix3::zeros(); bundle.points.len()],
            point_rhs: vec![Vector3::zeros(); bundle.points.len()],
            coupling: vec![Matrix6x3::zeros(); bundle.views.len()],
            by_place,
            pose_at,
            reduced,
        }
    }

    /// Computes all blocks at the current poses and points.
    fn linearise(&mut self, bundle: &LargeBundle, robust: bool) {
        self.pose_blocks.fill(Matrix6::zeros());
        self.pose_rhs.fill(Vector6::zeros());
        let rotations: Vec<Matrix3<f64>> =
            bundle.poses.iter().map(|p| *p.rotation.to_rotation_matrix().matrix()).collect();
        for (i, point) in bundle.points.iter().enumerate() {
            let mut h = Matrix3::zeros();
            let mut b = Vector3::zeros();
            for view_index in bundle.views_of(i) {
                let view = &bundle.views[view_index];
                let coupling = &mut self.coupling[view_index];
                *coupling = Matrix6x3::zeros();
                let rotation = &rotations[view.pose];
                let p = rotation * point.coords + bundle.poses[view.pose].translation.vector;
                if view.trust <= 0.0 || p.z <= MIN_DEPTH_M {
                    continue;
                }
                let m = &view.measurement;
                let r = m.residual(&bundle.camera, &p);
                let weight = if robust { huber(m.chi2(&r), m.chi2_limit()).1 } else { 1.0 };
                let info = m.information() * (weight * view.trust);
                let jacobian = projection_jacobian(&bundle.camera, &p);
                let weighted = Matrix3::from_diagonal(&info) * jacobian;
                // In the camera frame a point has the block a; moving the camera by (ρ, φ) moves the point by ρ − [p]φ.
                let a = jacobian.tr_mul(&weighted);
                let force = weighted.tr_mul(&r);
                let of_point = a * rotation;
                h += rotation.tr_mul(&of_point);
                b += rotation.tr_mul(&force);
                if view.pose < bundle.free_poses {
                    let arm = skew(&p);
                    let turned = arm * a;
                    let block = &mut self.pose_blocks[view.pose];
                    let mut part = block.fixed_view_mut::<3, 3>(0, 0);
                    part += a;
                    let mut part = block.fixed_view_mut::<3, 3>(3, 0);
                    part += turned;
                    let mut part = block.fixed_view_mut::<3, 3>(0, 3);
                    part += turned.transpose();
                    let mut part = block.fixed_view_mut::<3, 3>(3, 3);
                    part -= turned * arm;
                    let rhs = &mut self.pose_rhs[view.pose];
                    let mut part = rhs.fixed_rows_mut::<3>(0);
                    part += force;
                    let mut part = rhs.fixed_rows_mut::<3>(3);
                    part += p.cross(&force);
                    coupling.fixed_rows_mut::<3>(0).copy_from(&of_point);
                    coupling.fixed_rows_mut::<3>(3).copy_from(&(turned * rotation));
                }
            }
            self.point_blocks[i] = h;
            self.point_rhs[i] = b;
        }
    }

    /// Eliminates the points from the damped system. Returns the inverses of their blocks, and the right-hand side of the poses.
    fn reduce(&mut self, bundle: &LargeBundle, lambda: f64) -> (Vec<Matrix3<f64>>, Vec<Vector6<f64>>) {
        let invert = |block: &Matrix3<f64>| {
            let mut h = *block;
            for i in 0..3 {
                h[(i, i)] += lambda * h[(i, i)] + 1e-9;
            }
            // A point that is not determined by its views is not moved.
            h.try_inverse().unwrap_or_else(Matrix3::zeros)
        };
        let inverses: Vec<Matrix3<f64>> = self.point_blocks.iter().map(invert).collect();
        let mut rhs = self.pose_rhs.clone();
        let n = bundle.free_poses;
        self.reduced.clear();
        let places: Vec<u32> = (0..n).map(|pose| self.reduced.place(pose) as u32).collect();
        let mut position = vec![0u32; n];
        for place in 0..n {
            let pose = self.pose_at[place];
            let (rows, blocks) = self.reduced.column_mut(place);
            for (i, row) in rows.iter().enumerate() {
                position[*row as usize] = i as u32;
            }
            let mut h = self.pose_blocks[pose];
            for i in 0..6 {
                h[(i, i)] += lambda * h[(i, i)].max(1e-6) + 1e-9;
            }
            blocks[0] = h;
            for &(point, view) in &self.by_place[place] {
                let (point, own) = (point as usize, &self.coupling[view as usize]);
                let y = own * inverses[point];
                rhs[pose] -= y * self.point_rhs[point];
                for other in bundle.views_of(point) {
                    let other_pose = bundle.views[other].pose;
                    if other_pose < n && places[other_pose] as usize >= place {
                        let block = &mut blocks[position[places[other_pose] as usize] as usize];
                        subtract_product(block, &self.coupling[other], &y);
                    }
                }
            }
        }
        (inverses, rhs)
    }

    /// Returns poses and points after a damped step; `None` if the system is not positive definite.
    fn step(&mut self, bundle: &LargeBundle, lambda: f64) -> Option<(Vec<Pose>, Vec<Point3<f64>>)> {
        let (inverses, mut solution) = self.reduce(bundle, lambda);
        if !self.reduced.factorise() {
            return None;
        }
        self.reduced.solve(&mut solution);
        let mut poses = bundle.poses.clone();
        for (pose, step) in poses.iter_mut().zip(&solution) {
            *pose = perturbed(step, pose);
        }
        let mut points = bundle.points.clone();
        for (i, position) in points.iter_mut().enumerate() {
            let mut b = self.point_rhs[i];
            for view in bundle.views_of(i) {
                if let Some(step) = solution.get(bundle.views[view].pose) {
                    b -= self.coupling[view].tr_mul(step);
                }
            }
            *position += inverses[i] * b;
        }
        Some((poses, points))
    }
}

/// Computes `c -= a bᵀ`.
#[inline(always)]
fn subtract_product(c: &mut Matrix6<f64>, a: &Matrix6x3, b: &Matrix6x3) {
    let (c, a, b) = (&mut c.data.0, &a.data.0, &b.data.0);
    for (j, column) in c.iter_mut().enumerate() {
        for i in 0..6 {
            column[i] -= a[0][i] * b[0][j] + a[1][i] * b[1][j] + a[2][i] * b[2][j];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::se3_exp;
    use crate::optimize::schur::{BundleProblem, Observation};

    /// Returns a problem with exact poses and points, and the same with perturbed ones. The first four of six poses are free.
    fn scene(noise: f64) -> (LargeBundle, LargeBundle) {
        let camera = Pinhole { fx: 520.0, fy: 520.0, cx: 320.0, cy: 240.0, bf: 40.0 };
        let pose = |i: f64| se3_exp(&Vector6::new(0.1 * i, 0.02 * i, 0.0, 0.0, 0.03 * i, 0.01));
        let poses: Vec<Pose> = (0..6).map(|i| pose(f64::from(i))).collect();
        let (mut points, mut views, mut start) = (Vec::new(), Vec::new(), vec![0]);
        for i in 0..80 {
            let (a, b) = (f64::from(i % 10), f64::from(i / 10));
            let point = Point3::new(0.2 * a - 1.0, 0.2 * b - 0.8, 2.0 + 0.1 * ((a * 3.0 + b * 7.0) % 11.0));
            points.push(point);
            for (k, pose) in poses.iter().enumerate() {
                let p = (pose * point).coords;
                let [u, v] = camera.project(&p);
                let weight_disparity = if i % 3 == 0 { 0.0 } else { 4.0 };
                let measurement = Measurement { u, v, disparity: camera.bf / p.z, weight_px: 1.0, weight_disparity };
                views.push(View {
                    pose: k,
                    measurement,
                    trust: if (i as usize + k).is_multiple_of(7) { 0.0 } else { 1.0 },
                });
            }
            start.push(views.len());
        }
        let truth = LargeBundle { camera, poses, free_poses: 4, points, views, start };
        let mut moved = truth.clone();
        for (k, pose) in moved.poses.iter_mut().take(4).enumerate() {
            let s = noise * if k % 2 == 0 { 1.0 } else { -1.0 };
            *pose = se3_exp(&Vector6::new(s, -s, 0.5 * s, 0.3 * s, s, -0.2 * s)) * *pose;
        }
        for (i, p) in moved.points.iter_mut().enumerate() {
            p.x += noise * ((i * 7 % 5) as f64 - 2.0);
            p.z += noise * ((i * 3 % 7) as f64 - 3.0);
        }
        (truth, moved)
    }

    #[test]
    fn exact_poses_and_points_are_recovered_although_some_views_are_wrong() {
        let (truth, mut bundle) = scene(0.01);
        for view in bundle.views.iter_mut().step_by(41) {
            view.measurement.u += 60.0;
        }
        let config = BundleConfig { first_iterations: 10, second_iterations: 20, ..Default::default() };
        bundle.adjust(&config, &|| true);
        for (a, b) in truth.poses.iter().zip(&bundle.poses) {
            assert!((a.inverse() * b).translation.vector.norm() < 1e-6);
        }
        for (a, b) in truth.points.iter().zip(&bundle.points) {
            assert!((a - b).norm() < 1e-5);
        }
        assert_eq!(truth.poses[4..], bundle.poses[4..], "fixed poses are not changed");
        assert!(bundle.views.iter().step_by(41).all(|view| view.trust == 0.0));
    }

    #[test]
    fn the_result_is_that_of_the_dense_solver() {
        let (_, mut bundle) = scene(0.01);
        let point_of = |view| bundle.start.partition_point(|start| *start <= view) - 1;
        let observations = bundle.views.iter().enumerate().map(|(i, view)| Observation {
            pose: view.pose,
            point: point_of(i),
            measurement: view.measurement,
            trust: view.trust,
        });
        let mut dense = BundleProblem {
            camera: bundle.camera,
            poses: bundle.poses.clone(),
            free_poses: bundle.free_poses,
            points: bundle.points.clone(),
            observations: observations.collect(),
        };
        let config = BundleConfig { first_iterations: 2, second_iterations: 0, ..Default::default() };
        dense.solve(&config, 2, true);
        bundle.adjust(&config, &|| true);
        for (a, b) in dense.poses.iter().zip(&bundle.poses) {
            assert!((a.inverse() * b).translation.vector.norm() < 1e-9);
        }
    }
}

//! Normal equations of many poses, of which each shares points with few others (Triggs et al., Bundle Adjustment: a Modern Synthesis, 2000,
//! section 6.1).
//!
//! In: the problem. Out: damped steps. The points are eliminated first; the reduced system is held as sparse blocks, so that time and memory
//! grow about as the number of poses.

use std::ops::Range;

use nalgebra::{Matrix3, Matrix6, Point3, SMatrix, Vector3, Vector6};

use super::block_cholesky::BlockSystem;
use super::bundle_problem::{BundleProblem, MIN_DEPTH_M};
use super::normal_equations::NormalEquations;
use crate::geometry::{Pose, perturbed, skew};
use crate::optimize::residual::{huber, projection_jacobian};

type Matrix6x3 = SMatrix<f64, 6, 3>;

/// Blocks of the normal equations, and the reduced system of the poses.
pub(super) struct SparseEquations {
    /// Start of the observations of each point: those of point i are `point_start[i]..point_start[i + 1]`.
    point_start: Vec<usize>,
    pose_blocks: Vec<Matrix6<f64>>,
    pose_rhs: Vec<Vector6<f64>>,
    point_blocks: Vec<Matrix3<f64>>,
    point_rhs: Vec<Vector3<f64>>,
    /// Block of pose and point of each observation; zero for fixed poses.
    coupling: Vec<Matrix6x3>,
    /// Point and observation of each observation from a free pose, by the place of the pose in the reduced system.
    by_place: Vec<Vec<(u32, u32)>>,
    /// Free pose at each place.
    pose_at: Vec<usize>,
    reduced: BlockSystem<6>,
}

impl SparseEquations {
    /// Returns equations for the poses and points of a problem.
    pub(super) fn new(problem: &BundleProblem) -> Self {
        let n = problem.free_poses;
        let point_start = problem.point_starts();
        let mut pairs: Vec<(u32, u32)> = Vec::new();
        let mut free: Vec<u32> = Vec::new();
        for point in 0..problem.points.len() {
            free.clear();
            let seen = &problem.observations[point_start[point]..point_start[point + 1]];
            free.extend(seen.iter().map(|o| o.pose as u32));
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
        for (i, o) in problem.observations.iter().enumerate().filter(|(_, o)| o.pose < n) {
            by_place[reduced.place(o.pose)].push((o.point as u32, i as u32));
        }
        (0..n).for_each(|pose| pose_at[reduced.place(pose)] = pose);
        Self {
            point_start,
            pose_blocks: vec![Matrix6::zeros(); n],
            pose_rhs: vec![Vector6::zeros(); n],
            point_blocks: vec![Matrix3::zeros(); problem.points.len()],
            point_rhs: vec![Vector3::zeros(); problem.points.len()],
            coupling: vec![Matrix6x3::zeros(); problem.observations.len()],
            by_place,
            pose_at,
            reduced,
        }
    }

    /// Returns the numbers of the observations of a point.
    fn observations_of(&self, point: usize) -> Range<usize> {
        self.point_start[point]..self.point_start[point + 1]
    }

    /// Eliminates the points from the damped system. Returns the inverses of their blocks, and the right-hand side of the poses.
    fn reduce(&mut self, problem: &BundleProblem, lambda: f64) -> (Vec<Matrix3<f64>>, Vec<Vector6<f64>>) {
        let invert = |block: &Matrix3<f64>| {
            let mut h = *block;
            for i in 0..3 {
                h[(i, i)] += lambda * h[(i, i)] + 1e-9;
            }
            // A point that is not determined by its observations is not moved.
            h.try_inverse().unwrap_or_else(Matrix3::zeros)
        };
        let inverses: Vec<Matrix3<f64>> = self.point_blocks.iter().map(invert).collect();
        let mut rhs = self.pose_rhs.clone();
        let n = problem.free_poses;
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
            for &(point, own) in &self.by_place[place] {
                let (point, own) = (point as usize, &self.coupling[own as usize]);
                let y = own * inverses[point];
                rhs[pose] -= y * self.point_rhs[point];
                for other in self.point_start[point]..self.point_start[point + 1] {
                    let other_pose = problem.observations[other].pose;
                    if other_pose < n && places[other_pose] as usize >= place {
                        let block = &mut blocks[position[places[other_pose] as usize] as usize];
                        subtract_product(block, &self.coupling[other], &y);
                    }
                }
            }
        }
        (inverses, rhs)
    }
}

impl NormalEquations for SparseEquations {
    fn linearise(&mut self, problem: &BundleProblem, robust: bool) {
        self.pose_blocks.fill(Matrix6::zeros());
        self.pose_rhs.fill(Vector6::zeros());
        let rotations = problem.rotations();
        for (i, point) in problem.points.iter().enumerate() {
            let mut h = Matrix3::zeros();
            let mut b = Vector3::zeros();
            for index in self.observations_of(i) {
                let o = &problem.observations[index];
                let coupling = &mut self.coupling[index];
                *coupling = Matrix6x3::zeros();
                let rotation = &rotations[o.pose];
                let p = rotation * point.coords + problem.poses[o.pose].translation.vector;
                if o.trust <= 0.0 || p.z <= MIN_DEPTH_M {
                    continue;
                }
                let m = &o.measurement;
                let r = m.residual(&problem.camera, &p);
                let weight = if robust { huber(m.chi2(&r), m.chi2_limit()).1 } else { 1.0 };
                let info = m.information() * (weight * o.trust);
                let jacobian = projection_jacobian(&problem.camera, &p);
                let weighted = Matrix3::from_diagonal(&info) * jacobian;
                // In the camera frame a point has the block a; moving the camera by (ρ, φ) moves the point by ρ − [p]φ.
                let a = jacobian.tr_mul(&weighted);
                let force = weighted.tr_mul(&r);
                let of_point = a * rotation;
                h += rotation.tr_mul(&of_point);
                b += rotation.tr_mul(&force);
                if o.pose < problem.free_poses {
                    let arm = skew(&p);
                    let turned = arm * a;
                    let block = &mut self.pose_blocks[o.pose];
                    let mut part = block.fixed_view_mut::<3, 3>(0, 0);
                    part += a;
                    let mut part = block.fixed_view_mut::<3, 3>(3, 0);
                    part += turned;
                    let mut part = block.fixed_view_mut::<3, 3>(0, 3);
                    part += turned.transpose();
                    let mut part = block.fixed_view_mut::<3, 3>(3, 3);
                    part -= turned * arm;
                    let rhs = &mut self.pose_rhs[o.pose];
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

    fn step(&mut self, problem: &BundleProblem, lambda: f64) -> Option<(Vec<Pose>, Vec<Point3<f64>>)> {
        let (inverses, mut solution) = self.reduce(problem, lambda);
        if !self.reduced.factorise() {
            return None;
        }
        self.reduced.solve(&mut solution);
        let mut poses = problem.poses.clone();
        for (pose, step) in poses.iter_mut().zip(&solution) {
            *pose = perturbed(step, pose);
        }
        let mut points = problem.points.clone();
        for (i, position) in points.iter_mut().enumerate() {
            let mut b = self.point_rhs[i];
            for index in self.observations_of(i) {
                if let Some(step) = solution.get(problem.observations[index].pose) {
                    b -= self.coupling[index].tr_mul(step);
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

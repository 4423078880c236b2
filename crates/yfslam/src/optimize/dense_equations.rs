//! Normal equations of a window, in which almost all poses share points (Triggs et al., Bundle Adjustment: a Modern Synthesis, 2000, section
//! 6.1).
//!
//! In: the problem. Out: damped steps. The points are eliminated first; the reduced symmetric system has six unknowns for each free pose, and
//! is solved by dense Cholesky factorisation.

use fearless_simd::{Level, dispatch, f64x8, prelude::*};
use nalgebra::{Matrix6, Point3, Vector6};

use super::bundle_problem::{BundleProblem, MIN_DEPTH_M};
use super::normal_equations::NormalEquations;
use crate::geometry::{Pinhole, Pose, perturbed};
use crate::optimize::residual::huber;

/// A column of six numbers, filled up with zeros to a whole number of vectors.
type Column = [f64; 8];

/// The lower triangle and diagonal of a symmetric block of two poses, or a whole block, column by column.
type PoseBlock = [Column; 6];

const NO_COLUMN: Column = [0.0; 8];

/// Blocks of JᵀWJ and JᵀWr, and buffers for the reduced system. All sums have the same order for every instruction set, so that each of them
/// gives the same bits: vectors hold the elements of a block, never parts of a sum.
pub(super) struct DenseEquations {
    /// Lower triangles of the blocks of the free poses.
    pose_blocks: Vec<PoseBlock>,
    pose_rhs: Vec<Column>,
    /// Elements 00, 10, 11, 20, 21, 22 of the block of each point.
    point_blocks: Vec<[f64; 6]>,
    point_rhs: Vec<[f64; 3]>,
    /// Block of pose and point of each observation: the column of each coordinate of the point.
    coupling: Vec<[Column; 3]>,
    /// Start of the observations of each point: those of point i are `point_start[i]..point_start[i + 1]`.
    point_start: Vec<usize>,
    /// The inverse of the Cholesky factor of each damped block of a point; zero if the point is not determined.
    inverse_factors: Vec<[f64; 6]>,
    /// Lower triangle of the reduced system: the block of poses a ≥ c is at a (a + 1) / 2 + c.
    reduced: Vec<PoseBlock>,
    reduced_rhs: Vec<f64>,
    /// The free poses that observe a point, and their coupling with it times the transposed inverse factor.
    eliminated: Vec<(usize, [Column; 3])>,
}

impl DenseEquations {
    /// Returns equations for the poses and points of a problem.
    pub(super) fn new(problem: &BundleProblem) -> Self {
        let (n, points) = (problem.free_poses, problem.points.len());
        Self {
            pose_blocks: vec![[NO_COLUMN; 6]; n],
            pose_rhs: vec![NO_COLUMN; n],
            point_blocks: vec![[0.0; 6]; points],
            point_rhs: vec![[0.0; 3]; points],
            coupling: vec![[NO_COLUMN; 3]; problem.observations.len()],
            point_start: problem.point_starts(),
            inverse_factors: vec![[0.0; 6]; points],
            reduced: vec![[NO_COLUMN; 6]; n * (n + 1) / 2],
            reduced_rhs: vec![0.0; 6 * n],
            eliminated: Vec::new(),
        }
    }

    #[inline(always)]
    fn linearise_all<S: Simd>(&mut self, _: S, problem: &BundleProblem, robust: bool) {
        self.pose_blocks.fill([NO_COLUMN; 6]);
        self.pose_rhs.fill(NO_COLUMN);
        let rotations = problem.rotations();
        let Pinhole { fx, fy, bf, .. } = problem.camera;
        for point in 0..problem.points.len() {
            let mut h = [0.0; 6];
            let mut b = [0.0; 3];
            for i in self.point_start[point]..self.point_start[point + 1] {
                let o = &problem.observations[i];
                let r = &rotations[o.pose];
                let p = r * problem.points[point].coords + problem.poses[o.pose].translation.vector;
                let coupling = &mut self.coupling[i];
                *coupling = [NO_COLUMN; 3];
                if o.trust <= 0.0 || p.z <= MIN_DEPTH_M {
                    continue;
                }
                let m = &o.measurement;
                let e = m.residual(&problem.camera, &p);
                let weight = if robust { huber(m.chi2(&e), m.chi2_limit()).1 } else { 1.0 } * o.trust;
                let (w_px, w_disparity) = (m.weight_px * weight, m.weight_disparity * weight);
                // The derivatives of u, v and the disparity by the point in the camera frame that are not zero.
                let iz = 1.0 / p.z;
                let iz2 = iz * iz;
                let (ux, uz, vy, vz, dz) = (fx * iz, -fx * p.x * iz2, fy * iz, -fy * p.y * iz2, -bf * iz2);
                // JᵀWJ and JᵀWr of that point.
                let (h00, h02, h11, h12) = (w_px * ux * ux, w_px * ux * uz, w_px * vy * vy, w_px * vy * vz);
                let h22 = w_px * (uz * uz + vz * vz) + w_disparity * dz * dz;
                let g = [w_px * ux * e.x, w_px * vy * e.y, w_px * (uz * e.x + vz * e.y) + w_disparity * dz * e.z];
                for c in 0..3 {
                    b[c] += r[(0, c)] * g[0] + r[(1, c)] * g[1] + r[(2, c)] * g[2];
                    let (r0, r1, r2) = (r[(0, c)], r[(1, c)], r[(2, c)]);
                    let (m0, m1, m2) = (h00 * r0 + h02 * r2, h11 * r1 + h12 * r2, h02 * r0 + h12 * r1 + h22 * r2);
                    coupling[c] = [m0, m1, m2, p.y * m2 - p.z * m1, p.z * m0 - p.x * m2, p.x * m1 - p.y * m0, 0.0, 0.0];
                }
                for (k, (row, column)) in LOWER.into_iter().enumerate() {
                    let m = &coupling[column];
                    h[k] += r[(0, row)] * m[0] + r[(1, row)] * m[1] + r[(2, row)] * m[2];
                }
                if o.pose < problem.free_poses {
                    // The columns of JᵀWJ of the point, and their cross products with it below.
                    let x = [[h00, 0.0, h02], [0.0, h11, h12], [h02, h12, h22]]
                        .map(|[a, b, c]| [a, b, c, p.y * c - p.z * b, p.z * a - p.x * c, p.x * b - p.y * a, 0.0, 0.0]);
                    let block = &mut self.pose_blocks[o.pose];
                    for k in 0..8 {
                        block[0][k] += x[0][k];
                        block[1][k] += x[1][k];
                        block[2][k] += x[2][k];
                        block[3][k] += p.y * x[2][k] - p.z * x[1][k];
                        block[4][k] += p.z * x[0][k] - p.x * x[2][k];
                        block[5][k] += p.x * x[1][k] - p.y * x[0][k];
                    }
                    let [gx, gy, gz] = g;
                    let rhs = [gx, gy, gz, p.y * gz - p.z * gy, p.z * gx - p.x * gz, p.x * gy - p.y * gx, 0.0, 0.0];
                    for (sum, one) in self.pose_rhs[o.pose].iter_mut().zip(rhs) {
                        *sum += one;
                    }
                }
            }
            self.point_blocks[point] = h;
            self.point_rhs[point] = b;
        }
    }

    /// Solves the reduced system for the step of the poses; `None` if it is not positive definite.
    fn solve_reduced(&self) -> Option<Vec<f64>> {
        let size = self.reduced_rhs.len();
        let (mut matrix, mut solution) = (vec![0.0; size * size], self.reduced_rhs.clone());
        let places = (0..self.pose_blocks.len()).flat_map(|a| (0..=a).map(move |c| (a, c)));
        for ((a, c), block) in places.zip(&self.reduced) {
            for (column, values) in block.iter().enumerate() {
                let start = (6 * c + column) * size + 6 * a;
                matrix[start..start + 6].copy_from_slice(&values[..6]);
            }
        }
        let is_solved = dispatch!(Level::new(), simd => solve_dense(simd, &mut matrix, &mut solution));
        is_solved.then_some(solution)
    }

    /// Returns JᵀWJ of the first free pose at the current poses, after the points are eliminated; `None` if no pose is free.
    pub(super) fn information_of_first_pose(&mut self, problem: &BundleProblem) -> Option<Matrix6<f64>> {
        self.linearise(problem, false);
        self.reduce(problem, 0.0);
        let block = self.reduced.first()?;
        Some(Matrix6::from_fn(|row, column| block[row.min(column)][row.max(column)]))
    }

    /// Eliminates the points from the damped system (Schur complement).
    fn reduce(&mut self, problem: &BundleProblem, lambda: f64) {
        dispatch!(Level::new(), simd => self.eliminate_points(simd, problem, lambda));
    }

    #[inline(always)]
    fn eliminate_points<S: Simd>(&mut self, simd: S, problem: &BundleProblem, lambda: f64) {
        let n = problem.free_poses;
        self.reduced.fill([NO_COLUMN; 6]);
        for (k, (h, b)) in self.pose_blocks.iter().zip(&self.pose_rhs).enumerate() {
            let block = &mut self.reduced[k * (k + 1) / 2 + k];
            *block = *h;
            for i in 0..6 {
                block[i][i] += lambda * h[i][i].max(1e-6) + 1e-9;
            }
            self.reduced_rhs[6 * k..6 * k + 6].copy_from_slice(&b[..6]);
        }
        for point in 0..problem.points.len() {
            // A point that is not determined by its observations is not moved: its inverse factor is zero.
            let f = inverse_factor(&self.point_blocks[point], lambda).unwrap_or_default();
            self.inverse_factors[point] = f;
            let b = &self.point_rhs[point];
            let rhs = [f[0] * b[0], f[1] * b[0] + f[2] * b[1], f[3] * b[0] + f[4] * b[1] + f[5] * b[2]];
            self.eliminated.clear();
            for i in self.point_start[point]..self.point_start[point + 1] {
                let o = &problem.observations[i];
                if o.pose >= n || o.trust <= 0.0 {
                    continue;
                }
                let e = &self.coupling[i];
                let mut z = [NO_COLUMN; 3];
                for k in 0..8 {
                    z[0][k] = f[0] * e[0][k];
                    z[1][k] = f[1] * e[0][k] + f[2] * e[1][k];
                    z[2][k] = f[3] * e[0][k] + f[4] * e[1][k] + f[5] * e[2][k];
                }
                for (k, sum) in self.reduced_rhs[6 * o.pose..][..6].iter_mut().enumerate() {
                    *sum -= z[0][k] * rhs[0] + z[1][k] * rhs[1] + z[2][k] * rhs[2];
                }
                self.eliminated.push((o.pose, z));
            }
            for (i, (a, z_a)) in self.eliminated.iter().enumerate() {
                for (c, z_c) in &self.eliminated[..=i] {
                    let ((a, z_a), (c, z_c)) = if a >= c { ((a, z_a), (c, z_c)) } else { ((c, z_c), (a, z_a)) };
                    // As a loop over the elements it is not compiled to vectors.
                    let [z0, z1, z2] = z_a.map(|column| f64x8::from_slice(simd, &column));
                    let block = &mut self.reduced[a * (a + 1) / 2 + c];
                    for (j, column) in block.iter_mut().enumerate() {
                        let product = z0 * z_c[0][j] + z1 * z_c[1][j] + z2 * z_c[2][j];
                        (f64x8::from_slice(simd, column) - product).store_slice(column);
                    }
                }
            }
        }
    }
}

impl NormalEquations for DenseEquations {
    fn linearise(&mut self, problem: &BundleProblem, robust: bool) {
        dispatch!(Level::new(), simd => self.linearise_all(simd, problem, robust));
    }

    fn step(&mut self, problem: &BundleProblem, lambda: f64) -> Option<(Vec<Pose>, Vec<Point3<f64>>)> {
        let n = problem.free_poses;
        self.reduce(problem, lambda);
        let solution = self.solve_reduced()?;
        let mut poses = problem.poses.clone();
        for (pose, step) in poses.iter_mut().take(n).zip(solution.chunks_exact(6)) {
            *pose = perturbed(&Vector6::from_column_slice(step), pose);
        }
        let mut points = problem.points.clone();
        for (point, position) in points.iter_mut().enumerate() {
            let mut b = self.point_rhs[point];
            for i in self.point_start[point]..self.point_start[point + 1] {
                let o = &problem.observations[i];
                if o.pose < n && o.trust > 0.0 {
                    let step = &solution[6 * o.pose..6 * o.pose + 6];
                    for (b, column) in b.iter_mut().zip(&self.coupling[i]) {
                        *b -= column.iter().zip(step).map(|(e, x)| e * x).sum::<f64>();
                    }
                }
            }
            let f = &self.inverse_factors[point];
            let y = [f[0] * b[0], f[1] * b[0] + f[2] * b[1], f[3] * b[0] + f[4] * b[1] + f[5] * b[2]];
            position.x += f[0] * y[0] + f[1] * y[1] + f[3] * y[2];
            position.y += f[2] * y[1] + f[4] * y[2];
            position.z += f[5] * y[2];
        }
        Some((poses, points))
    }
}

/// Rows and columns of the elements of the lower triangle of a matrix of 3 × 3.
const LOWER: [(usize, usize); 6] = [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)];

/// Returns the inverse of the Cholesky factor of the damped block of a point, row by row; `None` if the block is not positive definite.
#[inline(always)]
fn inverse_factor(h: &[f64; 6], lambda: f64) -> Option<[f64; 6]> {
    let damped = |k: usize| h[k] + (lambda * h[k] + 1e-9);
    let positive = |v: f64| (v > 0.0).then(|| v.sqrt());
    let l00 = positive(damped(0))?;
    let (l10, l20) = (h[1] / l00, h[3] / l00);
    let l11 = positive(damped(2) - l10 * l10)?;
    let l21 = (h[4] - l20 * l10) / l11;
    let l22 = positive(damped(5) - l20 * l20 - l21 * l21)?;
    let (i00, i11, i22) = (1.0 / l00, 1.0 / l11, 1.0 / l22);
    let i10 = -l10 * i00 * i11;
    let i21 = -l21 * i11 * i22;
    let i20 = -(l20 * i00 + l21 * i10) * i22;
    Some([i00, i10, i11, i20, i21, i22])
}

/// Solves a dense system of which the lower triangle is given, column by column, by Cholesky factorisation in place. Returns whether it is
/// positive definite.
#[inline(always)]
fn solve_dense<S: Simd>(_: S, matrix: &mut [f64], x: &mut [f64]) -> bool {
    let size = x.len();
    for j in 0..size {
        let (before, rest) = matrix.split_at_mut((j + 1) * size);
        let column = &mut before[j * size + j..];
        if column[0].is_nan() || column[0] <= 0.0 {
            return false;
        }
        let pivot = column[0].sqrt();
        let inverse = 1.0 / pivot;
        column[0] = pivot;
        column[1..].iter_mut().for_each(|v| *v *= inverse);
        for (k, other) in rest.chunks_exact_mut(size).enumerate() {
            let factor = column[k + 1];
            for (value, l) in other[j + 1 + k..].iter_mut().zip(&column[k + 1..]) {
                *value -= factor * l;
            }
        }
    }
    for j in 0..size {
        let column = &matrix[j * size..(j + 1) * size];
        x[j] /= column[j];
        let known = x[j];
        for (value, l) in x[j + 1..].iter_mut().zip(&column[j + 1..]) {
            *value -= known * l;
        }
    }
    for j in (0..size).rev() {
        let column = &matrix[j * size..(j + 1) * size];
        let sum: f64 = column[j + 1..].iter().zip(&x[j + 1..]).map(|(l, v)| l * v).sum();
        x[j] = (x[j] - sum) / column[j];
    }
    true
}

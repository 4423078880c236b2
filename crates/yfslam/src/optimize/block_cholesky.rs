//! Cholesky factorisation of sparse symmetric systems that are made of square blocks (Davis, Direct Methods for Sparse Linear Systems,
//! 2006, chapters 4 and 7).
//!
//! In: which unknowns are coupled, then the blocks. Out: the solution. The unknowns are eliminated by approximate minimum degree (Amestoy,
//! Davis and Duff, SIAM J. Matrix Anal. Appl. 1996), which keeps the factor sparse for paths with many loops. All sums have a fixed order and
//! no operation depends on the processor, so that the solution has the same bits on every machine.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use nalgebra::{SMatrix, SVector};

/// The order of elimination and the columns of the factor.
#[derive(Clone, Debug)]
struct Pattern {
    /// Place of each unknown in the order of elimination.
    place: Vec<u32>,
    /// Unknown at each place.
    order: Vec<u32>,
    /// Start of each column in `rows`.
    start: Vec<usize>,
    /// Rows of the blocks of each column at and below the diagonal, ascending.
    rows: Vec<u32>,
}

/// A symmetric positive definite system with blocks of `D` × `D`, and its factor.
#[derive(Clone, Debug)]
pub(crate) struct BlockSystem<const D: usize> {
    pattern: Pattern,
    /// Blocks of the lower triangle, then those of the factor.
    blocks: Vec<SMatrix<f64, D, D>>,
}

impl<const D: usize> BlockSystem<D> {
    /// Makes a system of `size` unknowns, of which those of each pair are coupled.
    pub(crate) fn new(size: usize, pairs: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut neighbours = vec![Vec::new(); size];
        for (a, b) in pairs.filter(|(a, b)| a != b && *a < size && *b < size) {
            neighbours[a].push(b as u32);
            neighbours[b].push(a as u32);
        }
        for list in &mut neighbours {
            list.sort_unstable();
            list.dedup();
        }
        let pattern = eliminate(neighbours);
        let blocks = vec![SMatrix::zeros(); pattern.rows.len()];
        Self { pattern, blocks }
    }

    /// Sets all blocks to zero.
    pub(crate) fn clear(&mut self) {
        self.blocks.fill(SMatrix::zeros());
    }

    /// Returns the place of an unknown in the order of elimination. The lower triangle has the block of `(a, b)` in column `b` if the place of
    /// `a` is not before that of `b`.
    pub(crate) fn place(&self, unknown: usize) -> usize {
        self.pattern.place[unknown] as usize
    }

    /// Returns the rows of a column of the lower triangle, as places, and its blocks.
    pub(crate) fn column_mut(&mut self, place: usize) -> (&[u32], &mut [SMatrix<f64, D, D>]) {
        let range = self.pattern.start[place]..self.pattern.start[place + 1];
        (&self.pattern.rows[range.clone()], &mut self.blocks[range])
    }

    /// Adds a block in the rows of unknown `a` and the columns of `b`, and its transpose on the other side. The two must be coupled or equal.
    pub(crate) fn add(&mut self, a: usize, b: usize, block: &SMatrix<f64, D, D>) {
        let (row, column) = (self.place(a), self.place(b));
        let is_lower = row >= column;
        let (row, column) = if is_lower { (row, column) } else { (column, row) };
        let (rows, blocks) = self.column_mut(column);
        if let Ok(at) = rows.binary_search(&(row as u32)) {
            if is_lower { blocks[at] += block } else { blocks[at] += block.transpose() }
        }
    }

    /// Replaces the blocks by those of the factor. Returns false if the matrix is not positive definite.
    pub(crate) fn factorise(&mut self) -> bool {
        let Pattern { start, rows, .. } = &self.pattern;
        let size = self.pattern.order.len();
        // Index of the block in the present column, for each row.
        let mut position = vec![0u32; size];
        // Columns whose next block is in the present row, as a list for each row; `next_block` is that block.
        let mut first = vec![u32::MAX; size];
        let mut following = vec![u32::MAX; size];
        let mut next_block = vec![0usize; size];
        for column in 0..size {
            let range = start[column]..start[column + 1];
            let (before, rest) = self.blocks.split_at_mut(range.start);
            let own = &mut rest[..range.len()];
            let own_rows = &rows[range.clone()];
            for (i, row) in own_rows.iter().enumerate() {
                position[*row as usize] = i as u32;
            }
            let mut k = first[column];
            while k != u32::MAX {
                let earlier = k as usize;
                k = following[earlier];
                let (from, to) = (next_block[earlier], start[earlier + 1]);
                let pivot = before[from];
                for at in from..to {
                    subtract_product(&mut own[position[rows[at] as usize] as usize], &before[at], &pivot);
                }
                enqueue(earlier, from + 1, to, rows, &mut first, &mut following, &mut next_block);
            }
            let Some(inverse) = factorise_block(&mut own[0]) else { return false };
            for block in &mut own[1..] {
                *block = times_transposed(block, &inverse);
            }
            enqueue(column, range.start + 1, range.end, rows, &mut first, &mut following, &mut next_block);
        }
        true
    }

    /// Solves the factorised system; `rhs` has the right-hand side, then the solution, of each unknown.
    pub(crate) fn solve(&self, rhs: &mut [SVector<f64, D>]) {
        let Pattern { start, rows, order, .. } = &self.pattern;
        let mut x: Vec<SVector<f64, D>> = order.iter().map(|unknown| rhs[*unknown as usize]).collect();
        for column in 0..x.len() {
            let (from, to) = (start[column], start[column + 1]);
            let own = solve_lower(&self.blocks[from], &x[column]);
            x[column] = own;
            for at in from + 1..to {
                x[rows[at] as usize] -= self.blocks[at] * own;
            }
        }
        for column in (0..x.len()).rev() {
            let (from, to) = (start[column], start[column + 1]);
            let mut own = x[column];
            for at in from + 1..to {
                own -= self.blocks[at].tr_mul(&x[rows[at] as usize]);
            }
            x[column] = solve_upper(&self.blocks[from], &own);
        }
        for (unknown, x) in order.iter().zip(x) {
            rhs[*unknown as usize] = x;
        }
    }
}

/// Enters a column into the list of the row of its block `at`, unless that is beyond its end.
fn enqueue(
    column: usize,
    at: usize,
    end: usize,
    rows: &[u32],
    first: &mut [u32],
    following: &mut [u32],
    next_block: &mut [usize],
) {
    if at < end {
        let row = rows[at] as usize;
        next_block[column] = at;
        following[column] = std::mem::replace(&mut first[row], column as u32);
    }
}

/// Computes `c -= a bᵀ`.
#[inline(always)]
fn subtract_product<const D: usize>(c: &mut SMatrix<f64, D, D>, a: &SMatrix<f64, D, D>, b: &SMatrix<f64, D, D>) {
    let (c, a, b) = (&mut c.data.0, &a.data.0, &b.data.0);
    for (j, column) in c.iter_mut().enumerate() {
        for k in 0..D {
            let factor = b[k][j];
            for i in 0..D {
                column[i] -= a[k][i] * factor;
            }
        }
    }
}

/// Computes `a bᵀ`.
#[inline(always)]
fn times_transposed<const D: usize>(a: &SMatrix<f64, D, D>, b: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    let mut c = SMatrix::zeros();
    subtract_product(&mut c, a, b);
    -c
}

/// Replaces a block by its Cholesky factor, and returns the inverse of the factor; `None` if the block is not positive definite.
fn factorise_block<const D: usize>(block: &mut SMatrix<f64, D, D>) -> Option<SMatrix<f64, D, D>> {
    for j in 0..D {
        let mut pivot = block[(j, j)];
        for k in 0..j {
            pivot -= block[(j, k)] * block[(j, k)];
        }
        // A comparison with NaN is false.
        if !(pivot > 0.0 && pivot < f64::INFINITY) {
            return None;
        }
        let pivot = pivot.sqrt();
        block[(j, j)] = pivot;
        for i in j + 1..D {
            let mut value = block[(i, j)];
            for k in 0..j {
                value -= block[(i, k)] * block[(j, k)];
            }
            block[(i, j)] = value / pivot;
            block[(j, i)] = 0.0;
        }
    }
    let mut inverse = SMatrix::<f64, D, D>::zeros();
    for j in 0..D {
        let mut unit = SVector::<f64, D>::zeros();
        unit[j] = 1.0;
        inverse.set_column(j, &solve_lower(block, &unit));
    }
    Some(inverse)
}

/// Solves `l x = b`.
#[inline(always)]
fn solve_lower<const D: usize>(l: &SMatrix<f64, D, D>, b: &SVector<f64, D>) -> SVector<f64, D> {
    let mut x = *b;
    for i in 0..D {
        for k in 0..i {
            x[i] -= l[(i, k)] * x[k];
        }
        x[i] /= l[(i, i)];
    }
    x
}

/// Solves `lᵀ x = b`.
#[inline(always)]
fn solve_upper<const D: usize>(l: &SMatrix<f64, D, D>, b: &SVector<f64, D>) -> SVector<f64, D> {
    let mut x = *b;
    for i in (0..D).rev() {
        for k in i + 1..D {
            x[i] -= l[(k, i)] * x[k];
        }
        x[i] /= l[(i, i)];
    }
    x
}

/// Orders the unknowns by approximate minimum degree, on a quotient graph: each eliminated unknown leaves an element, the set of unknowns
/// that it couples. Returns the order with the columns of the factor.
fn eliminate(mut neighbours: Vec<Vec<u32>>) -> Pattern {
    let size = neighbours.len();
    let mut elements_of: Vec<Vec<u32>> = vec![Vec::new(); size];
    let mut elements: Vec<Vec<u32>> = vec![Vec::new(); size];
    let mut degree: Vec<usize> = neighbours.iter().map(Vec::len).collect();
    let mut queue: BinaryHeap<Reverse<(usize, u32)>> =
        degree.iter().enumerate().map(|(i, d)| Reverse((*d, i as u32))).collect();
    let mut place = vec![u32::MAX; size];
    let mut order = Vec::with_capacity(size);
    let mut columns: Vec<Vec<u32>> = vec![Vec::new(); size];
    // The number of the elimination in which each unknown was last collected, and of each element the part outside the new one.
    let mut collected = vec![u32::MAX; size];
    let mut outside = vec![(u32::MAX, 0usize); size];
    while let Some(Reverse((d, pivot))) = queue.pop() {
        let p = pivot as usize;
        // An entry of an earlier degree is stale.
        if place[p] != u32::MAX || d != degree[p] {
            continue;
        }
        let step = order.len() as u32;
        place[p] = step;
        order.push(pivot);
        collected[p] = step;
        let absorbed = std::mem::take(&mut elements_of[p]);
        let mut element = Vec::with_capacity(d);
        let own = std::mem::take(&mut neighbours[p]);
        let lists = absorbed.iter().map(|e| std::mem::take(&mut elements[*e as usize]));
        for v in lists.chain([own]).flatten() {
            if place[v as usize] == u32::MAX && collected[v as usize] != step {
                collected[v as usize] = step;
                element.push(v);
            }
        }
        // The element is the column of the factor, in terms of unknowns.
        for &v in &element {
            for &e in &elements_of[v as usize] {
                let entry = &mut outside[e as usize];
                if entry.0 != step {
                    *entry = (step, elements[e as usize].iter().filter(|v| place[**v as usize] == u32::MAX).count());
                }
                entry.1 = entry.1.saturating_sub(1);
            }
        }
        for &v in &element {
            let i = v as usize;
            neighbours[i].retain(|other| collected[*other as usize] != step && place[*other as usize] == u32::MAX);
            // Absorbed elements are empty; one within the new element is absorbed, too.
            elements_of[i].retain(|e| !elements[*e as usize].is_empty() && outside[*e as usize].1 > 0);
            let others: usize = elements_of[i].iter().map(|e| outside[*e as usize].1).sum();
            elements_of[i].push(pivot);
            degree[i] = (neighbours[i].len() + element.len() - 1 + others).min(size - order.len());
            queue.push(Reverse((degree[i], v)));
        }
        columns[step as usize].clone_from(&element);
        elements[p] = element;
    }
    let mut start = Vec::with_capacity(size + 1);
    let mut rows = Vec::new();
    for (column, unknowns) in columns.into_iter().enumerate() {
        start.push(rows.len());
        rows.push(column as u32);
        let from = rows.len();
        rows.extend(unknowns.into_iter().map(|v| place[v as usize]));
        rows[from..].sort_unstable();
    }
    start.push(rows.len());
    Pattern { place, order, start, rows }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;
    use proptest::prelude::*;
    use rand_pcg::Pcg64Mcg;
    use rand_pcg::rand_core::{Rng, SeedableRng};

    /// Returns a positive definite system, its dense matrix and a right-hand side.
    fn system(
        size: usize,
        pairs: &[(usize, usize)],
        seed: u64,
    ) -> (BlockSystem<3>, DMatrix<f64>, Vec<SVector<f64, 3>>) {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let mut number = || f64::from(rng.next_u32()) / f64::from(u32::MAX) - 0.5;
        let mut system = BlockSystem::<3>::new(size, pairs.iter().copied());
        let mut dense = DMatrix::zeros(3 * size, 3 * size);
        for &(a, b) in pairs {
            let block = SMatrix::<f64, 3, 3>::from_fn(|_, _| number());
            if a != b {
                system.add(a, b, &block);
                let mut view = dense.fixed_view_mut::<3, 3>(3 * a, 3 * b);
                view += block;
                let mut view = dense.fixed_view_mut::<3, 3>(3 * b, 3 * a);
                view += block.transpose();
            }
        }
        for a in 0..size {
            let block = SMatrix::<f64, 3, 3>::identity() * (3.0 * size as f64 + 3.0 * pairs.len() as f64);
            system.add(a, a, &block);
            let mut view = dense.fixed_view_mut::<3, 3>(3 * a, 3 * a);
            view += block;
        }
        let rhs = (0..size).map(|_| SVector::from_fn(|_, _| number())).collect();
        (system, dense, rhs)
    }

    proptest! {
        #[test]
        fn the_solution_fulfils_the_equations(
            size in 1usize..30,
            pairs in prop::collection::vec((0usize..30, 0usize..30), 0..90),
            seed in 0u64..1000,
        ) {
            let pairs: Vec<(usize, usize)> = pairs.into_iter().map(|(a, b)| (a % size, b % size)).collect();
            let (mut system, dense, rhs) = system(size, &pairs, seed);
            prop_assert!(system.factorise());
            let mut x = rhs.clone();
            system.solve(&mut x);
            let flat = |list: &[SVector<f64, 3>]| nalgebra::DVector::from_iterator(3 * size, list.iter().flat_map(|v| [v.x, v.y, v.z]));
            prop_assert!((dense * flat(&x) - flat(&rhs)).amax() < 1e-10);
        }
    }

    #[test]
    fn the_factor_of_a_path_with_loops_stays_sparse() {
        // Three rounds of 300: each unknown is coupled with the next three, and with the same place of the other rounds.
        let size = 900;
        let pairs = (0..size).flat_map(|a| [a + 1, a + 2, a + 3, a + 300, a + 600].map(|b| (a, b)));
        let system = BlockSystem::<6>::new(size, pairs.filter(|(_, b)| *b < size));
        let per_column = system.blocks.len() / size;
        assert!(per_column < 40, "{per_column} blocks a column; in the order of time there would be hundreds");
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_is_refused() {
        let (mut system, ..) = system(4, &[(0, 1), (1, 2)], 1);
        system.add(2, 2, &(SMatrix::identity() * -1e4));
        assert!(!system.factorise());
    }
}

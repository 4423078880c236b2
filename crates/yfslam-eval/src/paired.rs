//! In: errors of two systems on the same runs. Out: whether one is better than chance explains: the signed-rank test of Wilcoxon ("Individual
//! comparisons by ranking methods", Biometrics Bulletin 1945), two-sided, without pairs of equal errors, with mean ranks for ties.

use serde::{Deserialize, Serialize};

/// Most pairs for which the distribution is computed exactly; beyond, the normal approximation is used.
const EXACT: usize = 50;

/// Comparison of two systems.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Paired {
    /// Number of pairs.
    pub pairs: usize,
    /// Pairs in which the first system has the smaller error.
    pub wins: usize,
    /// Pairs in which it has the larger one.
    pub losses: usize,
    /// Median of first error / second error; `None` if a second error is 0.
    pub median_ratio: Option<f64>,
    /// Probability of a difference at least as clear if both systems were equal; 1 without pairs that differ.
    pub p: f64,
}

/// Compares the errors of pairs (first, second); `None` without finite pairs.
pub fn paired(errors: &[(f64, f64)]) -> Option<Paired> {
    let errors: Vec<(f64, f64)> = errors.iter().copied().filter(|(a, b)| a.is_finite() && b.is_finite()).collect();
    let mut ratios: Vec<f64> = errors.iter().map(|(a, b)| a / b).collect();
    ratios.sort_by(f64::total_cmp);
    let middle = |at: usize| ratios.get(at).copied();
    let median = (middle(errors.len().checked_sub(1)? / 2)? + middle(errors.len() / 2)?) / 2.0;
    let differences: Vec<f64> = errors.iter().map(|(a, b)| a - b).filter(|d| *d != 0.0).collect();
    Some(Paired {
        pairs: errors.len(),
        wins: differences.iter().filter(|d| **d < 0.0).count(),
        losses: differences.iter().filter(|d| **d > 0.0).count(),
        median_ratio: Some(median).filter(|ratio| ratio.is_finite()),
        p: signed_rank(&differences),
    })
}

/// Returns the two-sided p value of differences, none of which is 0.
fn signed_rank(differences: &[f64]) -> f64 {
    let doubled = doubled_ranks(differences);
    let sum = |positive: bool| -> usize {
        differences.iter().zip(&doubled).filter(|(d, _)| (**d > 0.0) == positive).map(|(_, rank)| rank).sum()
    };
    let smaller = sum(true).min(sum(false));
    if doubled.is_empty() {
        return 1.0;
    }
    if doubled.len() > EXACT {
        let total: f64 = doubled.iter().map(|rank| *rank as f64).sum();
        let variance: f64 = doubled.iter().map(|rank| (*rank as f64).powi(2)).sum::<f64>() / 4.0;
        let z = (total / 2.0 - smaller as f64 - 1.0).max(0.0) / variance.sqrt();
        return erfc(z / std::f64::consts::SQRT_2).min(1.0);
    }
    // Share of all choices of signs that give each sum of ranks.
    let mut shares = vec![1.0];
    for rank in doubled {
        let mut next = vec![0.0; shares.len() + rank];
        for (at, share) in shares.iter().enumerate() {
            for place in [at, at + rank] {
                if let Some(entry) = next.get_mut(place) {
                    *entry += share / 2.0;
                }
            }
        }
        shares = next;
    }
    (2.0 * shares.iter().take(smaller + 1).sum::<f64>()).min(1.0)
}

/// Returns twice the rank of each size, so that mean ranks are whole numbers.
fn doubled_ranks(differences: &[f64]) -> Vec<usize> {
    let rank = |d: &f64| {
        let below = differences.iter().filter(|other| other.abs() < d.abs()).count();
        let equal = differences.iter().filter(|other| other.abs() == d.abs()).count();
        2 * below + equal + 1
    };
    differences.iter().map(rank).collect()
}

/// Returns the complementary error function, to 1.2e-7 (Press et al., Numerical Recipes, §6.2).
fn erfc(x: f64) -> f64 {
    const C: [f64; 10] = [
        -1.265_512_23,
        1.000_023_68,
        0.374_091_96,
        0.096_784_18,
        -0.186_288_06,
        0.278_868_07,
        -1.135_203_98,
        1.488_515_87,
        -0.822_152_23,
        0.170_872_77,
    ];
    let t = 1.0 / (1.0 + 0.5 * x.abs());
    let polynomial = C.iter().rev().fold(0.0, |sum, c| sum * t + c);
    let value = t * (-x * x + polynomial).exp();
    if x >= 0.0 { value } else { 2.0 - value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn p_values_are_those_of_the_tables() {
        let of = |differences: &[f64]| signed_rank(differences);
        // All of n differences have the same sign: p = 2 / 2ⁿ.
        assert!((of(&[-1.0, -2.0, -3.0]) - 0.25).abs() < 1e-12);
        assert!((of(&[1.0, 2.0, 3.0, 4.0, 5.0]) - 0.0625).abs() < 1e-12);
        // n = 5, the smallest rank has the other sign: sums up to 1 have 2 of 32 choices on each side.
        assert!((of(&[-1.0, 2.0, 3.0, 4.0, 5.0]) - 0.125).abs() < 1e-12);
        assert_eq!(of(&[]), 1.0);
        // Ties: two of the same size and opposite signs say nothing.
        assert!((of(&[1.0, -1.0]) - 1.0).abs() < 1e-12);
        // scipy.stats.wilcoxon, exact, and with method="approx" and correction=True.
        assert!((of(&[0.3, -0.1, 0.5, 0.7, -0.2, 0.9, 1.1, 0.4]) - 0.0390625).abs() < 1e-12);
        let many: Vec<f64> = (1..=100).map(|k| if k % 4 == 0 { -f64::from(k) } else { f64::from(k) }).collect();
        assert!((of(&many) - 2.551_122_287_8e-5).abs() < 1e-10, "{}", of(&many));
    }

    #[test]
    fn pairs_are_counted_and_the_ratio_is_a_median() {
        let result = paired(&[(1.0, 2.0), (3.0, 4.0), (2.0, 2.0), (5.0, 4.0), (f64::NAN, 1.0)]).unwrap();
        assert_eq!((result.pairs, result.wins, result.losses), (4, 2, 1));
        assert!((result.median_ratio.unwrap() - 0.875).abs() < 1e-12);
        assert_eq!(paired(&[]), None);
    }
}

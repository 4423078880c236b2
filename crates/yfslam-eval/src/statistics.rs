//! In: one error per pose or pair. Out: the statistics in tables.

use serde::{Deserialize, Serialize};

/// Statistics of a set of errors, all in the unit of the errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    /// Number of errors.
    pub count: usize,
    /// Root of the mean square.
    pub rmse: f64,
    /// Arithmetic mean.
    pub mean: f64,
    /// Median; the mean of the two middle values if the number is even.
    pub median: f64,
    /// Standard deviation about the mean, of the population (divided by `count`); the papers' "S.D.".
    pub std: f64,
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
}

impl Statistics {
    /// Computes the statistics of finite errors; `None` without errors.
    pub fn of(errors: &[f64]) -> Option<Self> {
        let mut sorted = errors.to_vec();
        sorted.sort_by(f64::total_cmp);
        let (&min, &max) = (sorted.first()?, sorted.last()?);
        let count = sorted.len();
        let mean_of = |f: &dyn Fn(f64) -> f64| sorted.iter().map(|&e| f(e)).sum::<f64>() / count as f64;
        let mean = mean_of(&|e| e);
        let median = (sorted.get((count - 1) / 2)? + sorted.get(count / 2)?) / 2.0;
        let std = mean_of(&|e| (e - mean) * (e - mean)).sqrt();
        Some(Self { count, rmse: mean_of(&|e| e * e).sqrt(), mean, median, std, min, max })
    }
}

/// Returns the improvement of `ours` over `original` in percent, (1 − ours / original) · 100 (paper equation 3); negative if ours is worse.
///
/// `None` if it is undefined: an original error of zero, or an error that is negative or not finite.
pub fn improvement_percent(ours: f64, original: f64) -> Option<f64> {
    let defined = ours.is_finite() && ours >= 0.0 && original.is_finite() && original > 0.0;
    defined.then(|| (1.0 - ours / original) * 100.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_of_three_four_five_are_those_computed_by_hand() {
        let s = Statistics::of(&[5.0, 3.0, 4.0]).unwrap();
        assert_eq!((s.count, s.mean, s.median, s.min, s.max), (3, 4.0, 4.0, 3.0, 5.0));
        assert!((s.rmse - (50.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        assert!((s.std - (2.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        assert_eq!(Statistics::of(&[1.0, 2.0, 4.0, 9.0]).unwrap().median, 3.0);
        assert_eq!(Statistics::of(&[]), None);
    }

    #[test]
    fn improvement_reproduces_table_2_of_the_paper() {
        // fr3_walking_static: ORB-SLAM2 0.3872 m, YF-SLAM 0.0067 m, printed 98.27 %.
        assert!((improvement_percent(0.0067, 0.3872).unwrap() - 98.27).abs() < 0.005);
        assert!(improvement_percent(0.02, 0.01).unwrap() < 0.0);
        assert_eq!(improvement_percent(0.1, 0.0), None);
        assert_eq!(improvement_percent(f64::NAN, 1.0), None);
    }
}

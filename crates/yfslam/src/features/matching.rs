//! Rotation consistency: matches between two images turn by the same angle (ORB-SLAM, IEEE T-RO 2015, section V-B).

/// Bins of the histogram. Source: ORB-SLAM2.
const BINS: usize = 30;

/// A histogram of the turn of each match; those outside its three highest bins are outliers.
#[derive(Clone, Debug, Default)]
pub struct RotationHistogram {
    entries: Vec<(u8, u32)>,
}

impl RotationHistogram {
    /// Notes that match `payload` turned by `turn_rad`, any angle.
    pub fn add(&mut self, turn_rad: f32, payload: u32) {
        let turns = turn_rad / std::f32::consts::TAU;
        // The fraction may round up to 1.
        let bin = ((turns - turns.floor()) * BINS as f32) as usize % BINS;
        self.entries.push((bin as u8, payload));
    }

    /// Calls `visit` for each match outside the dominant bins. The second and third bin count only if they hold at least a tenth of
    /// the first.
    pub fn for_each_outlier(&self, mut visit: impl FnMut(u32)) {
        let mut counts = [0usize; BINS];
        for (bin, _) in &self.entries {
            counts[usize::from(*bin)] += 1;
        }
        let mut order: [usize; BINS] = std::array::from_fn(|i| i);
        order.sort_by_key(|&bin| std::cmp::Reverse(counts[bin]));
        let dominant =
            order[..3].iter().filter(|&&bin| counts[bin] * 10 >= counts[order[0]]).fold(0u32, |m, &b| m | 1 << b);
        for &(bin, payload) in &self.entries {
            if dominant & (1 << bin) == 0 {
                visit(payload);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matches_off_the_common_turn_are_outliers() {
        let mut histogram = RotationHistogram::default();
        for i in 0..40 {
            histogram.add(0.3 + 0.001 * i as f32 - std::f32::consts::TAU, i);
        }
        for i in 40..43 {
            histogram.add(1.0 + i as f32, i);
        }
        let mut outliers = Vec::new();
        histogram.for_each_outlier(|i| outliers.push(i));
        assert_eq!(outliers, [40, 41, 42]);
    }
}

//! Automatic exposure: the gain follows the recently measured brightness.
//!
//! In: a time and a function that measures the brightness of the scene. Out: a gain, 1 at the start. The scene is measured only
//! every [`STEP_S`] and each reading is kept, so that frames can be rendered in any order at little cost.

use std::sync::OnceLock;

use crate::rng::{hash, normals4};

/// Time between two readings, s.
const STEP_S: f64 = 0.2;
/// Weight of a reading that is 0, 1, 2, 3 steps old: the gain settles in about half a second, as in webcams.
const WEIGHTS: [f32; 4] = [0.4, 0.3, 0.2, 0.1];
/// Least and greatest gain.
const RANGE: [f32; 2] = [0.5, 2.0];
/// Relative error of a reading.
const METER_NOISE: f32 = 0.01;

/// The readings.
#[derive(Debug)]
pub struct Meter {
    readings: Vec<OnceLock<f32>>,
    seed: u64,
    /// Share of a change of brightness that the gain compensates.
    strength: f32,
}

impl Meter {
    /// Creates the meter for a sequence of `seconds`; a strength of 0 keeps the gain at 1.
    pub fn new(seconds: f64, strength: f32, seed: u64) -> Self {
        let count = if strength > 0.0 { (seconds / STEP_S) as usize + 2 } else { 0 };
        Self { readings: (0..count).map(|_| OnceLock::new()).collect(), seed, strength }
    }

    /// Returns the gain at `time` seconds; `brightness` measures the scene at a time.
    pub fn gain(&self, time: f64, brightness: impl Fn(f64) -> f32) -> f32 {
        if self.strength <= 0.0 {
            return 1.0;
        }
        let read = |step: usize| {
            let meter = || {
                let error = normals4(hash(self.seed, step as u64))[0] * METER_NOISE;
                brightness(step as f64 * STEP_S).max(1e-4) * (1.0 + error)
            };
            self.readings.get(step).map_or_else(meter, |known| *known.get_or_init(meter))
        };
        let start = read(0);
        let settled = |step: usize| {
            let seen = WEIGHTS.iter().enumerate().map(|(age, weight)| weight * read(step.saturating_sub(age)));
            libm::powf(start / seen.sum::<f32>(), self.strength).clamp(RANGE[0], RANGE[1])
        };
        // Interpolated between the gains of the last two readings, so that gains change without steps.
        let (step, part) = ((time / STEP_S).max(0.0) as usize, (time / STEP_S).max(0.0).fract() as f32);
        settled(step.saturating_sub(1)) * (1.0 - part) + settled(step) * part
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gain_compensates_a_change_of_brightness_without_steps_and_in_any_order() {
        let brightness = |t: f64| if t < 2.0 { 0.2 } else { 0.4 };
        let gains = |order: &mut dyn Iterator<Item = usize>| {
            let meter = Meter::new(4.0, 0.8, 3);
            let mut gains = vec![0.0; 120];
            order.for_each(|k| gains[k] = meter.gain(k as f64 / 30.0, brightness));
            gains
        };
        let gains_forward = gains(&mut (0..120));
        assert_eq!(gains_forward, gains(&mut (0..120).rev()));
        let near = |gain: f32, wanted: f32| assert!((gain / wanted - 1.0).abs() < 0.05, "{gain} for {wanted}");
        near(gains_forward[0], 1.0);
        near(gains_forward[119], 0.5f32.powf(0.8));
        let step = gains_forward.windows(2).map(|g| (g[1] - g[0]).abs()).fold(0.0, f32::max);
        assert!(step < 0.04, "jumps by {step}");
        assert_eq!(Meter::new(4.0, 0.0, 3).gain(3.0, brightness), 1.0);
    }
}

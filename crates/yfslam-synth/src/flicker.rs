//! Changing light: supply voltage that varies, and lamps that drop out for a moment.
//!
//! In: strength, seed and time. Out: the brightness of the unsteady lamps; 1 is normal. It is a pure and continuous function of
//! time: sudden changes take [`SUDDEN_S`].

use crate::rng::hash;

/// Seconds between the points of the slow change.
const SLOW_S: f64 = 2.5;
/// Seconds within which at most one drop-out happens, and its probability.
const DROP_SLOT_S: f64 = 4.0;
const DROP_CHANCE: f64 = 0.45;
/// Duration of a sudden change, s: two frames at 30 Hz.
const SUDDEN_S: f64 = 0.07;

/// Returns the brightness of flickering lamps at `time` seconds: within [1 − strength, 1 + 0.2 strength].
pub fn brightness(strength: f32, seed: u64, time: f64) -> f32 {
    if strength <= 0.0 {
        return 1.0;
    }
    let slow = 0.2 - 0.6 * wander(seed, time / SLOW_S);
    let level = slow + (-1.0 - slow) * drop_out(seed ^ 0xd509, time);
    (1.0 + f64::from(strength) * level) as f32
}

/// Returns a uniform draw in [0, 1) for point `index` of stream `seed`.
fn draw(seed: u64, index: i64) -> f64 {
    (hash(seed, index as u64) >> 11) as f64 / 9_007_199_254_740_992.0
}

fn smooth(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Returns smooth noise in [0, 1] with a new value at every whole number.
fn wander(seed: u64, t: f64) -> f64 {
    let (cell, s) = (t.floor() as i64, smooth(t - t.floor()));
    draw(seed, cell) * (1.0 - s) + draw(seed, cell + 1) * s
}

/// Returns how far lamps have dropped out, in [0, 1].
fn drop_out(seed: u64, time: f64) -> f64 {
    let slot = (time / DROP_SLOT_S).floor() as i64;
    let t = time - slot as f64 * DROP_SLOT_S;
    if draw(seed, 4 * slot) > DROP_CHANCE {
        return 0.0;
    }
    let lasts = 0.15 + 1.2 * draw(seed, 4 * slot + 1).powi(2);
    let start = draw(seed, 4 * slot + 2) * (DROP_SLOT_S - lasts - 2.0 * SUDDEN_S);
    let depth = 0.6 + 0.4 * draw(seed, 4 * slot + 3);
    depth * (smooth((t - start) / SUDDEN_S) - smooth((t - start - SUDDEN_S - lasts) / SUDDEN_S))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_wanders_and_drops_out_within_its_strength_and_without_jumps() {
        for strength in [0.3, 1.0] {
            let levels: Vec<f32> = (0..60_000).map(|i| brightness(strength, 5, f64::from(i) * 1e-3)).collect();
            let (low, high) = levels.iter().fold((2.0f32, 0.0f32), |(l, h), &b| (l.min(b), h.max(b)));
            assert!(low >= 1.0 - strength - 1e-6 && high <= 1.0 + 0.2 * strength + 1e-6, "{low} to {high}");
            assert!(low < 1.0 - 0.7 * strength, "never drops out: {low}");
            assert!(levels.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 0.04 * strength), "jumps");
        }
    }

    #[test]
    fn without_strength_the_light_is_steady() {
        assert!((0..100).all(|i| brightness(0.0, 5, f64::from(i)) == 1.0));
    }
}

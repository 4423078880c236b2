//! A circuit through a scene, on wheels or on foot, with the camera directed ahead.
//!
//! In: waypoints on the floor and a pace. Out: the pose of the camera at any time. The corners of the circuit are averaged away,
//! the pace drops where it would turn too fast, and the result, sampled evenly in time, is read through a uniform cubic B-spline
//! (de Boor, "A practical guide to splines", 1978): position, velocity and acceleration are continuous.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::look_at::look_at;

/// Pace on a circuit.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// Slowest and fastest speed on a straight, m/s.
    pub speed: [f64; 2],
    /// Fastest turn, rad/s.
    pub turn: f64,
    /// Height of the camera, m.
    pub height: f64,
    /// Downward tilt of the camera as a slope.
    pub tilt: f64,
    /// Spread of the average that rounds the corners, m.
    pub rounding: f64,
}

/// A closed circuit with a timetable.
#[derive(Clone, Debug)]
pub struct Tour {
    /// x, y, and the direction of view (cosine, sine) every [`TICK_S`] or slightly less, for one round.
    ticks: Vec<[f64; 4]>,
    tick: f64,
    pace: Pace,
}

/// Distance between points of the route, m.
const SPACING_M: f64 = 0.02;
/// Greatest time between two points of the timetable, s.
const TICK_S: f64 = 0.1;
/// The direction of view points from a little behind the camera to a place ahead, m: people and robots look into a bend.
const LOOK_M: [f64; 2] = [-0.3, 0.9];

impl Tour {
    /// Creates a circuit through `corners` that takes `seconds` if the pace allows it, otherwise as close to that as possible.
    pub fn new(corners: &[[f64; 2]], pace: Pace, seconds: f64) -> Self {
        let route = rounded(corners, pace.rounding);
        let view_directions = view_directions(&route);
        let count = route.len();
        let lengths: Vec<f64> = (0..count).map(|i| distance(route[i], route[(i + 1) % count])).collect();
        let bends: Vec<f64> =
            (0..count).map(|i| angle_between(view_directions[i], view_directions[(i + 1) % count])).collect();
        let times = |top: f64| -> Vec<f64> {
            let speeds: Vec<f64> =
                lengths.iter().zip(&bends).map(|(l, a)| top.min(pace.turn * l / a.max(1e-9))).collect();
            // The slowest speed of a neighbourhood, averaged over it: never faster than allowed and without abrupt braking.
            let reach = ((0.8 / SPACING_M) as usize).min(count / 4);
            let slowest: Vec<f64> = (0..count)
                .map(|i| (0..=2 * reach).map(|k| speeds[(i + count + k - reach) % count]).fold(top, f64::min))
                .collect();
            let smooth = averaged(&slowest.iter().map(|&v| [v]).collect::<Vec<_>>(), 2 * reach + 1);
            lengths.iter().zip(smooth).map(|(l, [v])| l / v).collect()
        };
        let [mut low, mut high] = pace.speed;
        for _ in 0..20 {
            let middle = 0.5 * (low + high);
            if times(middle).iter().sum::<f64>() > seconds { low = middle } else { high = middle }
        }
        let steps = times(high);
        let period: f64 = steps.iter().sum();
        let ticks = (period / TICK_S).ceil().max(4.0);
        let tick = period / ticks;
        let (mut at, mut i) = (0.0, 0);
        let ticks = (0..ticks as usize).map(|k| {
            let time = k as f64 * tick;
            while i + 1 < count && at + steps[i] <= time {
                at += steps[i];
                i += 1;
            }
            let t = ((time - at) / steps[i]).min(1.0);
            let blend = |a: [f64; 2], b: [f64; 2]| [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t];
            let ([x, y], [c, s]) =
                (blend(route[i], route[(i + 1) % count]), blend(view_directions[i], view_directions[(i + 1) % count]));
            [x, y, c, s]
        });
        Self { ticks: ticks.collect(), tick, pace }
    }

    /// Returns the pose (world from camera) at `time` seconds.
    pub fn pose(&self, time: f64) -> Isometry3<f64> {
        let [x, y, c, s] = self.at(time);
        let eye = Point3::new(x, y, self.pace.height);
        let ahead = Vector3::new(c, s, 0.0).normalize();
        look_at(eye, eye + ahead - Vector3::z() * self.pace.tilt)
    }

    /// Returns the place on the floor at `time` seconds, m.
    pub fn place(&self, time: f64) -> [f64; 2] {
        let [x, y, ..] = self.at(time);
        [x, y]
    }

    /// Returns the time of one round, s.
    pub fn period(&self) -> f64 {
        self.tick * self.ticks.len() as f64
    }

    /// Returns the length of one round, m.
    pub fn length(&self) -> f64 {
        let points = self.ticks.iter().zip(self.ticks.iter().cycle().skip(1));
        points.map(|(a, b)| libm::hypot(a[0] - b[0], a[1] - b[1])).sum()
    }

    /// Returns the time at which the circuit is nearest to `place`, s.
    pub fn time_near(&self, place: [f64; 2]) -> f64 {
        let away = |at: &[f64; 4]| distance([at[0], at[1]], place);
        let nearest = self.ticks.iter().enumerate().min_by(|(_, a), (_, b)| away(a).total_cmp(&away(b)));
        nearest.map_or(0.0, |(k, _)| k as f64 * self.tick)
    }

    /// Returns the place and direction of view at `time` seconds.
    fn at(&self, time: f64) -> [f64; 4] {
        let ticks = (time / self.tick).rem_euclid(self.ticks.len() as f64);
        let (k, t) = (ticks as usize, ticks.fract());
        let weights = [
            (1.0 - t).powi(3) / 6.0,
            (3.0 * t.powi(3) - 6.0 * t * t + 4.0) / 6.0,
            (-3.0 * t.powi(3) + 3.0 * t * t + 3.0 * t + 1.0) / 6.0,
            t.powi(3) / 6.0,
        ];
        let n = self.ticks.len();
        std::array::from_fn(|axis| {
            weights.iter().enumerate().map(|(i, w)| w * self.ticks[(k + n + i - 1) % n][axis]).sum::<f64>()
        })
    }
}

/// Returns evenly spaced points along the closed polygon, averaged three times so that corners become bends.
fn rounded(corners: &[[f64; 2]], rounding: f64) -> Vec<[f64; 2]> {
    let sides = corners.iter().zip(corners.iter().cycle().skip(1));
    let mut points = Vec::new();
    for (a, b) in sides {
        let steps = (distance(*a, *b) / SPACING_M).ceil().max(1.0);
        points.extend((0..steps as usize).map(|i| {
            let t = i as f64 / steps;
            [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t]
        }));
    }
    // Three boxes of width w have a spread of w / 2.
    let width = ((2.0 * rounding / SPACING_M) as usize).min(points.len() / 4) | 1;
    (0..3).fold(points, |points, _| averaged(&points, width))
}

/// Averages over `width` (odd) neighbours on a circle.
fn averaged<const N: usize>(values: &[[f64; N]], width: usize) -> Vec<[f64; N]> {
    let count = values.len();
    let mean = |i: usize| {
        let window = (0..width).map(|k| values[(i + count + k - width / 2) % count]);
        window.fold([0.0; N], |sum, v| std::array::from_fn(|axis| sum[axis] + v[axis] / width as f64))
    };
    (0..count).map(mean).collect()
}

/// Returns the unit direction of view at every point of the route.
fn view_directions(route: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let count = route.len();
    let at = |i: usize, metres: f64| route[(i as i64 + (metres / SPACING_M) as i64).rem_euclid(count as i64) as usize];
    let chord = |i: usize| {
        let (from, to) = (at(i, LOOK_M[0]), at(i, LOOK_M[1]));
        let length = distance(from, to).max(1e-9);
        [(to[0] - from[0]) / length, (to[1] - from[1]) / length]
    };
    (0..count).map(chord).collect()
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

fn angle_between(a: [f64; 2], b: [f64; 2]) -> f64 {
    libm::asin((a[0] * b[1] - a[1] * b[0]).abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    const PACE: Pace = Pace { speed: [0.3, 1.2], turn: 0.7, height: 1.4, tilt: 0.05, rounding: 1.0 };
    const CORNERS: [[f64; 2]; 5] = [[0.0, 0.0], [0.0, 6.0], [10.0, 6.0], [10.0, -4.0], [0.0, -4.0]];

    #[test]
    fn a_circuit_takes_the_given_time_unless_that_would_be_too_fast() {
        assert!((Tour::new(&CORNERS, PACE, 60.0).period() - 60.0).abs() < 0.1);
        let rushed = Tour::new(&CORNERS, PACE, 10.0).period();
        assert!((31.0..38.0).contains(&rushed), "40 m with rounded corners in {rushed} s");
        let patient = Tour::new(&CORNERS, PACE, 1000.0).period();
        assert!((110.0..135.0).contains(&patient), "{patient} s");
    }

    #[test]
    fn speed_and_turning_stay_within_the_pace() {
        let tour = Tour::new(&CORNERS, PACE, 10.0);
        let h = 0.01;
        let poses: Vec<_> = (0..(tour.period() / h) as usize).map(|i| tour.pose(i as f64 * h)).collect();
        for pair in poses.windows(2) {
            let speed = (pair[1].translation.vector - pair[0].translation.vector).norm() / h;
            let turn = pair[0].rotation.angle_to(&pair[1].rotation) / h;
            assert!((0.3..1.21).contains(&speed), "{speed} m/s");
            assert!(turn < 0.72, "{turn} rad/s");
        }
    }
}

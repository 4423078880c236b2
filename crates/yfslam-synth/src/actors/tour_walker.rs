//! The way of someone who walks the same round as the camera: ahead of it, or towards it and past it at its side.
//!
//! In: a round with its time-table, and how it is walked. Out: position, heading, distance walked and speed at any time. Who
//! walks beside the round follows its parallel curve, at the place that the round has at that time.

use nalgebra::Vector2;

use super::walkway::Step;
use crate::tour::Tour;

/// Someone on a round.
#[derive(Clone, Debug)]
pub struct TourWalker {
    tour: Tour,
    manner: Manner,
    /// Length of the parallel curve from the start of the round, every [`SAMPLE_S`] of its time-table, for one round; m.
    arc: Vec<f64>,
}

/// How someone walks a round.
#[derive(Clone, Copy, Debug)]
pub struct Manner {
    /// Where one begins: the time at which the time-table has that place, s.
    pub start_s: f64,
    /// Speed relative to the time-table's; below 0 one walks the round the other way.
    pub rate: f64,
    /// How far one walks beside the round, to the right of the time-table's direction, m.
    pub beside_m: f64,
    /// One is now early and now late: by up to so many seconds of the time-table, at this angular frequency and phase.
    pub waver: [f64; 3],
}

/// Step of the table of lengths, s.
const SAMPLE_S: f64 = 0.05;

impl TourWalker {
    /// Someone who walks `tour` in the given way.
    pub fn new(tour: Tour, manner: Manner) -> Self {
        let samples = (tour.period() / SAMPLE_S).ceil() as usize;
        let places = (0..=samples).map(|k| beside(&tour, k as f64 * tour.period() / samples as f64, manner.beside_m).0);
        let places: Vec<Vector2<f64>> = places.collect();
        let mut arc = vec![0.0];
        for pair in places.windows(2) {
            arc.push(arc[arc.len() - 1] + (pair[1] - pair[0]).norm());
        }
        Self { tour, manner, arc }
    }

    /// Where the walker is at `time` seconds.
    pub fn at(&self, time: f64) -> Step {
        let [size, omega, phase] = self.manner.waver;
        let table = self.manner.start_s + self.manner.rate * time + size * (omega * time + phase).sin();
        let rate = self.manner.rate + size * omega * (omega * time + phase).cos();
        let (place, along) = beside(&self.tour, table, self.manner.beside_m);
        let onwards = along * rate.signum();
        let slope = (self.length(table + SAMPLE_S) - self.length(table - SAMPLE_S)) / (2.0 * SAMPLE_S);
        Step {
            position: [place.x, place.y],
            heading: (-onwards.x).atan2(onwards.y),
            glance: 0.0,
            distance: self.length(table) * rate.signum(),
            speed: slope * rate.abs(),
            legs_before: 0,
            waited: 0.0,
            pause: 0.0,
        }
    }

    /// Length of the parallel curve up to a time of the time-table, m.
    fn length(&self, table: f64) -> f64 {
        let rounds = table.div_euclid(self.tour.period());
        let steps = self.arc.len() - 1;
        let at = table.rem_euclid(self.tour.period()) / self.tour.period() * steps as f64;
        let k = (at as usize).min(steps - 1);
        rounds * self.arc[steps] + self.arc[k] + (self.arc[k + 1] - self.arc[k]) * (at - k as f64)
    }
}

/// The place `beside_m` to the right of the round at a time of its time-table, and the unit direction of the round there.
fn beside(tour: &Tour, table: f64, beside_m: f64) -> (Vector2<f64>, Vector2<f64>) {
    let [before, here, after] = [-SAMPLE_S, 0.0, SAMPLE_S].map(|h| Vector2::from(tour.place(table + h)));
    let along = (after - before).normalize();
    (here + Vector2::new(along.y, -along.x) * beside_m, along)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera_path::WALK;

    #[test]
    fn a_companion_moves_at_the_speed_it_tells_and_looks_where_it_goes_ahead_and_against_the_tour() {
        let tour = Tour::new(&[[0.0, 0.0], [0.0, 6.0], [10.0, 6.0], [10.0, -4.0], [0.0, -4.0]], WALK, 40.0);
        for (rate, beside_m) in [(1.0, -0.2), (-0.8, 0.7)] {
            let manner = Manner { start_s: 3.0, rate, beside_m, waver: [0.3, 0.5, 1.0] };
            let companion = TourWalker::new(tour.clone(), manner);
            let dt = 0.02;
            let steps: Vec<Step> = (0..5000).map(|i| companion.at(f64::from(i) * dt)).collect();
            for pair in steps.windows(2) {
                let [a, b] = [pair[0].position, pair[1].position].map(Vector2::from);
                let moved = b - a;
                assert!(
                    (moved.norm() / dt - pair[0].speed).abs() < 0.06,
                    "{} is not {}",
                    moved.norm() / dt,
                    pair[0].speed
                );
                assert!((pair[1].distance - pair[0].distance - moved.norm()).abs() < 0.002);
                let ahead = Vector2::new(-pair[0].heading.sin(), pair[0].heading.cos());
                assert!(moved.norm() < 0.002 || ahead.dot(&moved) > 0.97 * moved.norm(), "{ahead} is not {moved}");
            }
            let lane = steps.iter().map(|step| (Vector2::from(step.position) - nearest(&tour, step.position)).norm());
            let widest = lane.fold(0.0, f64::max);
            assert!((widest - beside_m.abs()).abs() < 0.02, "{widest} m beside the tour");
        }
    }

    fn nearest(tour: &Tour, place: [f64; 2]) -> Vector2<f64> {
        let time = tour.time_near(place);
        let around = (-20..=20).map(|k| Vector2::from(tour.place(time + f64::from(k) * 0.01)));
        around.min_by(|a, b| (a - Vector2::from(place)).norm().total_cmp(&(b - Vector2::from(place)).norm())).unwrap()
    }
}

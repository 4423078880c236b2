//! The route of a person who walks along the camera's circuit: ahead of the camera, or towards it and past it at its side.
//!
//! In: a circuit with its timetable, and a manner of walking. Out: position, heading, distance walked and speed at any time. A
//! person beside the circuit follows its parallel curve, at the place that the circuit has at that time.

use nalgebra::Vector2;

use super::walkway::Step;
use crate::tour::Tour;

/// A person on a circuit.
#[derive(Clone, Debug)]
pub struct TourWalker {
    tour: Tour,
    manner: Manner,
    /// Length of the parallel curve from the start of the circuit, every [`SAMPLE_S`] of its timetable, for one round; m.
    arc: Vec<f64>,
}

/// How a person walks along a circuit.
#[derive(Clone, Copy, Debug)]
pub struct Manner {
    /// Time at which the timetable has the starting place, s.
    pub start_s: f64,
    /// Speed relative to that of the timetable; below 0 the person walks in the opposite direction.
    pub rate: f64,
    /// Distance beside the circuit, to the right of the direction of the timetable, m.
    pub beside_m: f64,
    /// The person is sometimes early and sometimes late, by up to so many seconds of the timetable, at this angular frequency and
    /// phase.
    pub waver: [f64; 3],
}

/// Step of the table of lengths, s.
const SAMPLE_S: f64 = 0.05;

impl TourWalker {
    /// Creates a person who walks along `tour` in the given manner.
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

    /// Returns the place of the walker at `time` seconds.
    pub fn at(&self, time: f64) -> Step {
        let [size, omega, phase] = self.manner.waver;
        let table = self.manner.start_s + self.manner.rate * time + size * libm::sin(omega * time + phase);
        let rate = self.manner.rate + size * omega * libm::cos(omega * time + phase);
        let (place, along) = beside(&self.tour, table, self.manner.beside_m);
        let onwards = along * rate.signum();
        let slope = (self.length(table + SAMPLE_S) - self.length(table - SAMPLE_S)) / (2.0 * SAMPLE_S);
        Step {
            position: [place.x, place.y],
            heading: libm::atan2(-onwards.x, onwards.y),
            glance: 0.0,
            distance: self.length(table) * rate.signum(),
            speed: slope * rate.abs(),
            legs_before: 0,
            waited: 0.0,
            pause: 0.0,
        }
    }

    /// Returns the length of the parallel curve up to a time of the timetable, m.
    fn length(&self, table: f64) -> f64 {
        let rounds = table.div_euclid(self.tour.period());
        let steps = self.arc.len() - 1;
        let at = table.rem_euclid(self.tour.period()) / self.tour.period() * steps as f64;
        let k = (at as usize).min(steps - 1);
        rounds * self.arc[steps] + self.arc[k] + (self.arc[k + 1] - self.arc[k]) * (at - k as f64)
    }
}

/// Returns the place `beside_m` to the right of the circuit at a time of its timetable, and the unit direction of the circuit
/// there.
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
    fn a_tour_walker_moves_at_its_stated_speed_in_its_heading_ahead_and_against_the_tour() {
        let tour = Tour::new(&[[0.0, 0.0], [0.0, 6.0], [10.0, 6.0], [10.0, -4.0], [0.0, -4.0]], WALK, 40.0);
        for (rate, beside_m) in [(1.0, -0.2), (-0.8, 0.7)] {
            let manner = Manner { start_s: 3.0, rate, beside_m, waver: [0.3, 0.5, 1.0] };
            let walker = TourWalker::new(tour.clone(), manner);
            let dt = 0.02;
            let steps: Vec<Step> = (0..5000).map(|i| walker.at(f64::from(i) * dt)).collect();
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
            let distances =
                steps.iter().map(|step| (Vector2::from(step.position) - nearest(&tour, step.position)).norm());
            let widest = distances.fold(0.0, f64::max);
            assert!((widest - beside_m.abs()).abs() < 0.02, "{widest} m beside the tour");
        }
    }

    fn nearest(tour: &Tour, place: [f64; 2]) -> Vector2<f64> {
        let time = tour.time_near(place);
        let around = (-20..=20).map(|k| Vector2::from(tour.place(time + f64::from(k) * 0.01)));
        around.min_by(|a, b| (a - Vector2::from(place)).norm().total_cmp(&(b - Vector2::from(place)).norm())).unwrap()
    }
}

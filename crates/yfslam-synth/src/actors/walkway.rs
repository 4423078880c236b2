//! A walking route: a closed smooth circuit with stops.
//!
//! In: waypoints, stops with the paces to them, and a phase. Out: position, heading, distance walked and speed at any time. The
//! circuit is a closed Catmull–Rom spline, walked by arc length; between stops the speed follows a minimum-jerk profile with a
//! plateau.

/// A closed circuit.
#[derive(Clone, Debug)]
pub struct Walkway {
    /// Points on the circuit, closely spaced, and the arc length up to each; the first point is repeated at the end.
    points: Vec<[f64; 2]>,
    arc: Vec<f64>,
    legs: Vec<Leg>,
    period: f64,
    phase: f64,
    clockwise: bool,
}

/// A walk between two stops, and the stop at its end.
#[derive(Clone, Copy, Debug)]
struct Leg {
    start_time: f64,
    walk_time: f64,
    start_arc: f64,
    length: f64,
    /// Direction of view while standing, relative to the direction of the route, rad.
    glance: f64,
    pause: f64,
    /// Number of the stop at the end.
    stop: usize,
}

/// A place to stop at.
#[derive(Clone, Copy, Debug)]
pub struct Stop {
    /// Place; the stop is at the nearest point of the circuit, m.
    pub near: [f64; 2],
    /// Duration, s; more than 0.
    pub pause: f64,
    /// Direction of view meanwhile, relative to the direction of the route, rad.
    pub glance: f64,
    /// Speed on the leg to it, m/s.
    pub pace: f64,
}

/// The state of a walker.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Position on the floor, m.
    pub position: [f64; 2],
    /// Direction of the route: angle about +z from +y, rad.
    pub heading: f64,
    /// Direction of view, relative to that, rad.
    pub glance: f64,
    /// Distance walked along the route from an arbitrary origin, m.
    pub distance: f64,
    /// Speed, m/s.
    pub speed: f64,
    /// Number of legs walked before this one, from an arbitrary origin, over all rounds.
    pub legs_before: i64,
    /// Time spent at the stop at the end of this leg, s; 0 while walking there.
    pub waited: f64,
    /// Duration of that stop, s.
    pub pause: f64,
}

const SAMPLES_PER_SPAN: usize = 24;
/// Moments of a round among which the nearest to a place is searched.
const MOMENTS: usize = 1000;

impl Walkway {
    /// Creates a circuit through `waypoints` with at least one stop.
    pub fn new(waypoints: &[[f64; 2]], stops: &[Stop], clockwise: bool) -> Self {
        let n = waypoints.len() as isize;
        let at = |i: isize| waypoints[i.rem_euclid(n) as usize];
        let mut points = Vec::new();
        for i in 0..n {
            for step in 0..SAMPLES_PER_SPAN {
                let t = step as f64 / SAMPLES_PER_SPAN as f64;
                points.push(catmull_rom([at(i - 1), at(i), at(i + 1), at(i + 2)], t));
            }
        }
        points.extend(points.first().copied());
        let mut arc = vec![0.0];
        for pair in points.windows(2) {
            arc.push(arc[arc.len() - 1] + distance(pair[0], pair[1]));
        }
        let total = arc[arc.len() - 1];
        let along = |stop: &Stop| {
            let squared = |p: &[f64; 2]| distance(*p, stop.near);
            let nearest = points.iter().enumerate().min_by(|(_, a), (_, b)| squared(a).total_cmp(&squared(b)));
            let at = nearest.map_or(0.0, |(i, _)| arc[i]);
            if clockwise { total - at } else { at }
        };
        let mut halts: Vec<(f64, usize)> = stops.iter().enumerate().map(|(i, stop)| (along(stop), i)).collect();
        halts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut legs = Vec::new();
        let mut time = 0.0;
        for (k, &(start_arc, _)) in halts.iter().enumerate() {
            let (end_arc, index) = halts[(k + 1) % halts.len()];
            let stop = stops[index];
            // With a single stop, the leg is a full round.
            let length = total - (start_arc - end_arc).rem_euclid(total);
            // The mean speed of the smooth profile is a share 1 - RAMP of its plateau.
            let walk_time = length / (stop.pace * (1.0 - RAMP));
            let (glance, pause) = (stop.glance, stop.pause);
            legs.push(Leg { start_time: time, walk_time, start_arc, length, glance, pause, stop: index });
            time += walk_time + stop.pause;
        }
        Self { points, arc, legs, period: time, phase: 0.0, clockwise }
    }

    /// Returns the same circuit with the times of `other`, which has as many stops, so that both stop and walk together.
    pub fn in_step_with(mut self, other: &Self) -> Self {
        for (leg, model) in self.legs.iter_mut().zip(&other.legs) {
            (leg.start_time, leg.walk_time, leg.pause) = (model.start_time, model.walk_time, model.pause);
        }
        (self.period, self.phase) = (other.period, other.phase);
        self
    }

    /// Returns the same circuit, timed to be nearest to `place` at `time` seconds, and then ahead by `spread` rounds.
    pub fn meeting(self, place: [f64; 2], time: f64, spread: f64) -> Self {
        let start = Self { phase: 0.0, ..self };
        let moments = (0..MOMENTS).map(|k| k as f64 * start.period / MOMENTS as f64);
        let away = |t: &f64| distance(start.at(*t).position, place);
        let visit = moments.min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(0.0);
        Self { phase: visit - time + spread * start.period, ..start }
    }

    /// Returns the state of the walker at `time` seconds.
    pub fn at(&self, time: f64) -> Step {
        let rounds = ((time + self.phase) / self.period).floor();
        let t = (time + self.phase).rem_euclid(self.period);
        let k = self.legs.partition_point(|leg| leg.start_time <= t).saturating_sub(1);
        let leg = self.legs[k];
        let walked = ((t - leg.start_time) / leg.walk_time).min(1.0);
        let (share, rate) = profile(walked);
        let arc = leg.start_arc + share * leg.length;
        let waited = (t - leg.start_time - leg.walk_time).clamp(0.0, leg.pause);
        let glance = leg.glance * turned(waited, leg.pause);
        let (position, heading) = self.locate(arc);
        let distance = rounds * self.arc[self.arc.len() - 1] + arc;
        Step {
            position,
            heading,
            glance,
            distance,
            speed: rate * leg.length / leg.walk_time,
            legs_before: rounds as i64 * self.legs.len() as i64 + k as i64,
            waited,
            pause: leg.pause,
        }
    }

    /// Returns the legs of a round, and the number of the leg that leads to stop number `stop`.
    pub fn leg_to(&self, stop: usize) -> (i64, i64) {
        let leg = self.legs.iter().position(|leg| leg.stop == stop).unwrap_or(0);
        (self.legs.len() as i64, leg as i64)
    }

    /// Returns the position and direction of the route at stop number `stop`.
    pub fn place_of(&self, stop: usize) -> ([f64; 2], f64) {
        let leg = self.legs[self.leg_to(stop).1 as usize];
        self.locate(leg.start_arc + leg.length)
    }

    /// Returns whether the circuit is clockwise, seen from above.
    pub fn is_clockwise(&self) -> bool {
        self.clockwise
    }

    fn locate(&self, arc: f64) -> ([f64; 2], f64) {
        let total = self.arc[self.arc.len() - 1];
        let along = if self.clockwise { total - arc.rem_euclid(total) } else { arc.rem_euclid(total) };
        let position = self.point(along);
        // The heading is averaged over 0.4 m: people turn before the bend.
        let (a, b) = (self.point((along - 0.2).rem_euclid(total)), self.point((along + 0.2).rem_euclid(total)));
        let sign = if self.clockwise { -1.0 } else { 1.0 };
        let (dx, dy) = (sign * (b[0] - a[0]), sign * (b[1] - a[1]));
        (position, libm::atan2(-dx, dy))
    }

    fn point(&self, along: f64) -> [f64; 2] {
        let i = self.arc.partition_point(|&a| a <= along).clamp(1, self.arc.len() - 1);
        let t = (along - self.arc[i - 1]) / (self.arc[i] - self.arc[i - 1]);
        let (a, b) = (self.points[i - 1], self.points[i]);
        [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t]
    }
}

/// Share of the time of a leg for acceleration, and for deceleration.
const RAMP: f64 = 0.2;

/// Returns the share of a turn of the view after `waited` of `pause` seconds: within a second to the side, then constant, then
/// back.
fn turned(waited: f64, pause: f64) -> f64 {
    let t = (waited.min(pause - waited) / (pause / 2.0).min(1.0)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Returns the share of the route and the relative speed at share `t` of the time: the speed rises as a smoothstep, is constant,
/// and falls.
fn profile(t: f64) -> (f64, f64) {
    let top = 1.0 / (1.0 - RAMP);
    let rising = |t: f64| {
        let s = t / RAMP;
        (top * RAMP * (s.powi(3) - 0.5 * s.powi(4)), top * s * s * (3.0 - 2.0 * s))
    };
    if t < RAMP {
        rising(t)
    } else if t <= 1.0 - RAMP {
        (top * (t - RAMP / 2.0), top)
    } else {
        let (route, speed) = rising(1.0 - t);
        (1.0 - route, speed)
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

fn catmull_rom(p: [[f64; 2]; 4], t: f64) -> [f64; 2] {
    std::array::from_fn(|k| {
        let [a, b, c, d] = p.map(|q| q[k]);
        b + 0.5 * t * (c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_walker_moves_without_jumps_at_the_stated_speed_and_stops() {
        let waypoints = [[2.0, 0.0], [0.0, 2.0], [-2.0, 0.0], [0.0, -2.0]];
        let stop = |near| Stop { near, pause: 1.5, glance: 0.8, pace: 0.9 };
        let walkway =
            Walkway::new(&waypoints, &[stop([0.0, 2.0]), stop([-2.0, 0.1])], true).meeting([0.0, 2.0], 3.0, 0.0);
        let met = walkway.at(3.0);
        assert!(distance(met.position, [0.0, 2.0]) < 0.1 && met.speed < 1e-9, "{met:?}");
        let h = 0.01;
        let steps: Vec<Step> = (0..(2.0 * walkway.period / h) as usize).map(|i| walkway.at(i as f64 * h)).collect();
        let speeds: Vec<f64> = steps.windows(2).map(|pair| distance(pair[0].position, pair[1].position) / h).collect();
        let top = speeds.iter().copied().fold(0.0, f64::max);
        assert!((0.85..1.0).contains(&top), "top speed {top}");
        assert!(speeds.iter().any(|&s| s < 1e-6), "never stops");
        for (pair, speed) in steps.windows(2).zip(&speeds) {
            assert!((pair[0].speed - speed).abs() < 0.05, "{} is not {speed}", pair[0].speed);
            let walked = (pair[1].distance - pair[0].distance) / h;
            assert!((walked - speed).abs() < 0.01, "the distance changes by {walked} m/s instead of {speed}");
            let turn = (pair[1].heading + pair[1].glance - pair[0].heading - pair[0].glance).sin().abs();
            assert!(turn < 0.06, "turns by {turn} rad in {h} s");
        }
    }
}

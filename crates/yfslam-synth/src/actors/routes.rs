//! Routes of people and robots, timed so that no two collide.
//!
//! In: a scene, the path of the camera, the number of walkers and drivers, and their closeness to the camera. Out: a route for
//! each. There are two lanes, an oval inside an oval around the furniture. All go in the same direction, two abreast: for a camera,
//! several people who walk past together are harder than people who stand or cross each other, because most of what is visible then
//! moves alike.
//!
//! Where a camera on a tour would collide with them or show none of them, people walk along that tour themselves: ahead of the
//! camera and, where there is room as in a corridor, every second one towards it and past it.

use super::people::tasks::HANDLING_S;
use super::tour_walker::{Manner, TourWalker};
use super::walkway::{Step, Stop, Walkway};
use crate::camera_path::{CameraPath, WALK};
use crate::config::{Activity, WorldConfig};
use crate::rng::Rng;
use crate::scene::{Company, Scene};
use crate::tour::Tour;

const LANE_M: f64 = 0.5;
/// Lead of the outer of two abreast over the inner one before the camera, so that both are visible, m.
const AHEAD_M: f64 = 0.9;
/// Half the length of the route past the camera, m; in narrow scenes a share of their width.
const PAST_M: f64 = 1.3;
const PAST_SHARE: f64 = 0.6;
/// Pace past the camera at closeness 1, relative to that at closeness 0.
const STROLL: f64 = 0.25;
/// Pause before the camera at closeness 2, for one, two or three of a lane, who must not catch up with each other, s.
const LINGER_S: [f64; 3] = [14.0, 14.0, 9.5];

/// Mean distance of the first person ahead of the camera, at closeness 0 and at closeness 2, m.
const LEAD_M: [f64; 2] = [5.0, 2.0];
/// Additional distance of each further person, m.
const APART_M: f64 = 1.2;
/// How much they fall back and hurry ahead, as a share of their lead, and how fast, rad/s.
const WAVER: f64 = 0.12;
const WAVER_RATE: f64 = 0.45;
/// Distance of those ahead of the camera to the left of its tour, which keeps them clear of those who come towards them, m.
const LEFT_M: f64 = 0.12;
/// Pace of those who come towards the camera, relative to that of the camera.
const TOWARDS: f64 = 0.8;

/// The route of a walker or driver.
#[derive(Clone, Debug)]
pub enum Route {
    /// Around the furniture.
    Around(Walkway),
    /// Along the tour of the camera.
    Along(TourWalker),
}

impl Route {
    /// Returns the place on the route at `time` seconds.
    pub fn at(&self, time: f64) -> Step {
        match self {
            Self::Around(route) => route.at(time),
            Self::Along(route) => route.at(time),
        }
    }
}

/// Returns the index of the person who carries an object: the first one, whose inner lane has room at its side.
pub fn carrier(config: &WorldConfig) -> Option<usize> {
    let exists = config.actors.carried_box && config.activity == Activity::Walking;
    (exists && config.people > 0).then_some(0)
}

/// Returns the index of the person who pushes a chair: the first one whose hands are free.
pub fn pusher(config: &WorldConfig) -> Option<usize> {
    let first = usize::from(carrier(config).is_some());
    let exists = config.actors.pushed_chair && config.activity == Activity::Walking;
    (exists && config.people > first).then_some(first)
}

/// Returns the lane of number `k`: 0 is the outer one, 1 the inner one; they alternate, starting with the inner one.
fn lane_of(k: usize) -> usize {
    (k + 1) % 2
}

/// Returns the route of walker or driver number `k`, for a closeness up to 2.
pub fn route(scene: &Scene, config: &WorldConfig, path: &CameraPath, k: usize, closeness: f64) -> Route {
    match (path.tour(), scene.company) {
        (Some(tour), Company::Ahead) => Route::Along(ahead(config, tour, k, closeness)),
        (Some(tour), Company::BothWays(_)) if k.is_multiple_of(2) => {
            Route::Along(ahead(config, tour, k / 2, closeness))
        }
        (Some(tour), Company::BothWays(lane_m)) => Route::Along(towards(scene, config, tour, lane_m, k)),
        _ => Route::Around(circuit(scene, config, k, closeness)),
    }
}

/// Returns the route of number `place` of those ahead of the camera on its tour; a larger closeness gives a smaller distance.
fn ahead(config: &WorldConfig, tour: &Tour, place: usize, closeness: f64) -> TourWalker {
    let mut draw = Rng::new(config.seed, 0xc0a1);
    let [far, near] = LEAD_M.map(libm::log);
    let lead_m = libm::exp(far + (near - far) * closeness / 2.0);
    let pace = tour.length() / tour.period();
    // The paces of all vary in the same way, so that they never collide.
    let waver = [WAVER * lead_m / pace, WAVER_RATE, draw.range64(0.0, std::f64::consts::TAU)];
    let start_s = (lead_m + APART_M * place as f64) / pace;
    TourWalker::new(tour.clone(), Manner { start_s, rate: 1.0, beside_m: -LEFT_M, waver })
}

/// Returns the route of number `k`, who comes towards the camera in the lane beside its tour.
fn towards(scene: &Scene, config: &WorldConfig, tour: &Tour, lane_m: f64, k: usize) -> TourWalker {
    let seconds = config.frames as f64 / config.camera.fps;
    // A parallel of a tour with narrow bends cannot be walked: this lane has wide bends.
    let lane = Tour::new(&scene.circuit, WALK, tour.period());
    let early = Rng::new(config.seed, 0x1a7e).range64(0.3, 0.6) * seconds.min(12.0);
    let of_these = ((walkers(scene, config) + config.actors.robots) / 2).max(1);
    let behind_s = (k / 2) as f64 / of_these as f64 * lane.period();
    let start_s = lane.time_near(tour.place(early)) + TOWARDS * early + behind_s;
    let manner = Manner { start_s, rate: -TOWARDS, beside_m: lane_m, waver: [0.0; 3] };
    TourWalker::new(lane, manner)
}

/// Returns the circuit of number `k` for a closeness up to 2. A larger closeness means a slower walk past the camera and a shorter
/// pause out of its view; beyond 1 it also means a smaller distance and a stop before the camera, facing it.
fn circuit(scene: &Scene, config: &WorldConfig, k: usize, closeness: f64) -> Walkway {
    let going = walkers(scene, config) + config.actors.robots;
    let in_lane = (0..going).filter(|&other| lane_of(other) == lane_of(k)).count().max(1);
    let [own, model] = [k, 1].map(|number| lane(scene, config, number, closeness));
    // A person passes early in the sequence, however short it is; in half of the worlds earlier than in the others.
    let seconds = config.frames as f64 / config.camera.fps;
    let late = (-closeness).max(0.0) + Rng::new(config.seed, 0x1a7e).range64(0.3, 0.6);
    // All have the same schedule, evenly spread over the circuit, and therefore never meet.
    let spread = (k / 2) as f64 / in_lane as f64;
    let before = [scene.walk_center.x, scene.walk_near_y[1]];
    own.in_step_with(&model.meeting(before, seconds.min(12.0) * late, spread))
}

/// Returns the circuit of number `k` with times of its own: its shape differs slightly from all others, its stops and paces do not.
fn lane(scene: &Scene, config: &WorldConfig, k: usize, closeness: f64) -> Walkway {
    let lane = lane_of(k);
    let (wall, closeness) = ((closeness - 1.0).clamp(0.0, 1.0), closeness.clamp(0.0, 1.0));
    let inward = LANE_M * lane as f64;
    let [closest, farthest] = scene.walk_near_y;
    let near = farthest + (closest - farthest) * wall + inward;
    let (far, half) = (scene.walk_far_y - inward, scene.walk_half_width - 0.9 * inward);
    let (cx, cy) = (scene.walk_center.x, (near + far) / 2.0);
    let mut own = Rng::new(config.seed, 0x3a1c + k as u64);
    let mut jitter = |v: f64| v + own.range64(-0.05, 0.05);
    // A rounded rectangle, anticlockwise from the right.
    let waypoints = [
        [half, cy],
        [0.92 * half, far - 0.35],
        [0.35 * half, far],
        [-0.35 * half, far],
        [-0.92 * half, far - 0.35],
        [-half, cy],
        [-0.80 * half, near + 0.30],
        [-0.30 * half, near],
        [0.30 * half, near],
        [0.80 * half, near + 0.30],
    ]
    .map(|[x, y]| [jitter(cx + x), jitter(y)]);
    let mut draw = Rng::new(config.seed, 0x5c4e);
    let (clockwise, speed) = (draw.chance(0.5), draw.range64(0.75, 1.0));
    let onwards = if clockwise { -1.0 } else { 1.0 };
    let stroll = speed * libm::pow(STROLL, closeness);
    let going = walkers(scene, config) + config.actors.robots;
    let in_lane = going.div_ceil(2).clamp(1, 3);
    let ahead = AHEAD_M * (0.5 - lane as f64);
    // Towards the camera, from the direction of the route on the near side.
    let facing = 1.4 * -onwards;
    let mut before = |x: f64, pace: f64, linger: f64, least: f64| Stop {
        near: [cx + onwards * (x + ahead) + draw.range64(-0.1, 0.1), near],
        pause: (draw.range64(0.1, 0.4) + linger * draw.range64(0.9, 1.1)).max(least),
        glance: draw.range64(-0.6, 0.6) * (1.0 - wall) + facing * wall,
        pace,
    };
    let past = PAST_M.min(PAST_SHARE * half);
    let mut stops = vec![before(-past, speed, 0.0, 0.0), before(past, stroll, 0.0, 0.0)];
    let handling = if carrier(config).is_some() { HANDLING_S } else { 0.0 };
    let linger = LINGER_S[in_lane - 1] * wall;
    if handling + linger > 0.0 {
        let apart = 0.35 - 0.10 * wall;
        stops.splice(0..0, [-apart, apart].map(|x| before(x, stroll, linger, handling)));
    }
    // At a low closeness people wait at the side, outside the view of the camera.
    let mut away = |near: [f64; 2], shy: f64| Stop {
        near,
        pause: draw.range64(0.3, 0.8) + shy * draw.range64(0.9, 1.1),
        glance: draw.range64(-1.2, 1.2),
        pace: speed,
    };
    stops.push(away([cx, far], 0.0));
    // Not exactly where the circuit begins: there it could be the first stop of some and the last of others.
    stops.push(away([cx + half, cy + 0.3], 10.0 * (1.0 - closeness)));
    Walkway::new(&waypoints, &stops, clockwise)
}

/// Returns the number of people who walk.
fn walkers(scene: &Scene, config: &WorldConfig) -> usize {
    let settled = match config.activity {
        Activity::Walking => 0,
        Activity::Sitting => scene.seats.len() + scene.stands.len(),
        Activity::Crowd => scene.seats.len(),
    };
    config.people.saturating_sub(settled)
}

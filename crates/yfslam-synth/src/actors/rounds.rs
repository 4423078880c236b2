//! The rounds that people walk and robots drive, timed so that nobody meets.
//!
//! In: a scene, how many go round, and how close to the camera. Out: a way for each. There are two lanes, an oval in an
//! oval around the furniture, walked in opposite directions.

use super::people::tasks::HANDLING_S;
use super::walkway::{Stop, Walkway};
use crate::config::{Activity, WorldConfig};
use crate::rng::Rng;
use crate::scene::Scene;

const LANE_M: f64 = 0.5;
/// Pause before the camera at closeness 1, s.
const LINGER_S: f64 = 8.0;
/// The same at closeness 2, for one, two or three of a lane, who must not catch up with each other.
const LONG_LINGER_S: [f64; 3] = [14.0, 14.0, 9.5];

/// Index of the person who carries a box: the first one, whose inner lane has room at its side.
pub fn carrier(config: &WorldConfig) -> Option<usize> {
    let someone = config.actors.carried_box && config.activity == Activity::Walking;
    (someone && config.people > 0).then_some(0)
}

/// Index of the person who pushes a chair: the first one whose hands are free.
pub fn pusher(config: &WorldConfig) -> Option<usize> {
    let first = usize::from(carrier(config).is_some());
    let someone = config.actors.pushed_chair && config.activity == Activity::Walking;
    (someone && config.people > first).then_some(first)
}

/// The lane of number `k`: 0 is the outer one, 1 the inner one, taken in turns from the inner one on.
fn lane_of(k: usize) -> usize {
    (k + 1) % 2
}

/// The round of number `k` of those who go round, for a closeness up to 2: lingers the longer in front of the camera, and
/// the shorter out of its sight, the closer; from one half to 1 the near side comes nearer to the camera; beyond 1 those who
/// stand there move together and face the camera.
pub fn round(scene: &Scene, config: &WorldConfig, k: usize, closeness: f64) -> Walkway {
    let (late, wall, closeness) = ((-closeness).max(0.0), (closeness - 1.0).clamp(0.0, 1.0), closeness.clamp(0.0, 1.0));
    let lane = lane_of(k);
    let inward = LANE_M * lane as f64;
    let [closest, farthest] = scene.walk_near_y;
    let near = farthest + (closest - farthest) * (2.0 * closeness - 1.0).clamp(0.0, 1.0) + inward;
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
    // All of one lane share its schedule, evenly spread over the round, and so never meet.
    let mut draw = Rng::new(config.seed, 0x5c4e + lane as u64);
    let speed = draw.range64(0.75, 1.0);
    let handling = if carrier(config).is_some_and(|person| lane_of(person) == lane) { HANDLING_S } else { 0.0 };
    // Towards the camera, from the direction of the way on the near side.
    let facing = if lane == 0 { 1.4 } else { -1.4 };
    let mut stop = |x: f64, y: f64, linger: f64, least: f64| Stop {
        near: [cx + x + draw.range64(-0.2, 0.2) * (1.0 - 0.7 * wall), y],
        pause: (draw.range64(0.5, 1.0) + linger * draw.range64(0.9, 1.1)).max(least),
        glance: draw.range64(-1.2, 1.2) * (1.0 - wall) + facing * wall,
    };
    // Shy people wait at the side, which the camera does not see.
    // At first only the inner lane lingers: from there, the camera sees people with their heads.
    let going = walkers(scene, config) + config.actors.robots;
    let in_lane = (0..going).filter(|&k| lane_of(k) == lane).count();
    let linger = LINGER_S + (LONG_LINGER_S[in_lane.clamp(1, 3) - 1] - LINGER_S) * wall;
    let bold = linger * if lane == 1 { 2.0 * closeness } else { 2.0 * closeness - 1.0 }.clamp(0.0, 1.0);
    let shy = 10.0 * (1.0 - closeness);
    let apart = 0.35 - 0.10 * wall;
    let stops = [
        stop(-apart, near, bold, handling),
        stop(apart, near, bold, handling),
        stop(0.0, far, 0.0, 0.0),
        stop(half, cy, shy, 0.0),
    ];
    let spread = (k / 2) as f64 / in_lane.max(1) as f64;
    // Someone of each lane comes by early, however short the sequence is; the lanes take turns, unless they are to hide as
    // much as they can.
    let seconds = config.frames as f64 / config.camera.fps;
    let turn = 0.3 + 0.4 * lane as f64 + draw.range64(-0.1, 0.1);
    let first_visit = seconds.min(12.0) * (late + turn + (0.5 - turn) * wall);
    Walkway::new(&waypoints, &stops, speed, lane == 0).meeting(first_visit, spread)
}

/// How many people go round.
fn walkers(scene: &Scene, config: &WorldConfig) -> usize {
    let settled = match config.activity {
        Activity::Walking => 0,
        Activity::Sitting => scene.seats.len() + scene.stands.len(),
        Activity::Crowd => scene.seats.len(),
    };
    config.people.saturating_sub(settled)
}

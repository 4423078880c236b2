//! Tasks of walkers: pushing a chair, or carrying an object from one stop to another and leaving it there.
//!
//! In: the place of a walker on the route. Out: the bend, turn and arms of the walker, and the pose of the object. A carried object
//! visits the two stops P and Q (in walking order) in a cycle of three rounds: fetched at P, put down at Q, left there, fetched at
//! Q, put down at P, left there. A person on the tour of the camera does not stop and holds it all the time.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};

use super::skeleton::{self, BonePoses, Joints, Proportions};
use super::{gait, smooth, upright};
use crate::actors::routes::Route;
use crate::actors::walkway::{Step, Walkway};
use crate::config::CarriedObject;
use crate::mesh::Vec3;

/// A task while walking.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// None: the arms swing, and the person looks around at stops.
    Nothing,
    /// Pushes a chair.
    Push,
    /// Carries an object between the first two stops.
    Carry(CarriedObject),
}

/// Size of the carried box: right, forward, up, m.
pub const BOX_M: [f32; 3] = [0.36, 0.26, 0.24];
/// Size of the carried laptop without its lid, and of the lid: right, forward, up, m.
pub const LAPTOP_M: [f32; 3] = [0.34, 0.235, 0.018];
/// Least pause at the stops where the object is fetched or put down, s.
pub const HANDLING_S: f64 = 3.4;
/// The two stops.
const STOPS: [usize; 2] = [0, 1];
/// Distance from the pusher to the middle of the chair, m.
const CHAIR_AHEAD_M: f32 = 0.68;
/// Place of the hands on the back of the chair, in the axes of the chair, m.
const CHAIR_GRIP_M: [f32; 3] = [0.17, -0.25, 0.99];
/// Place of box and laptop when they are held, relative to the hips: forward, up to the bottom, m.
const HOLD_BOX_M: [f32; 2] = [0.31, 0.13];
const HOLD_LAPTOP_M: [f32; 2] = [0.31, 0.26];
/// How much deeper than for the box a person stoops for the laptop.
const LOW: f32 = 1.22;
/// Place on the floor, ahead of the person who put it there, m.
const PUT_AHEAD_M: f32 = 0.58;

/// State of a carried object.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Handling {
    /// In the hands, while walking.
    Held,
    /// On the floor at a stop, with no person near.
    Left(usize),
    /// Being fetched or put down at a stop; the share of the needed time that has passed.
    Fetched(usize, f32),
    PutDown(usize, f32),
}

impl Task {
    /// Bends the walker for the task; returns the turn relative to the route if the task sets it.
    pub fn prepare(self, route: &Route, step: &Step, joints: &mut Joints) -> Option<f32> {
        match self {
            Self::Nothing => None,
            Self::Push => {
                joints.trunk[0] += 0.12;
                Some(0.0)
            }
            Self::Carry(object) => {
                let Route::Around(route) = route else { return None };
                let (turned, bent) = match handling(route, step) {
                    Handling::Fetched(_, t) | Handling::PutDown(_, t) => (turned(t), bent(t)),
                    _ => return None,
                };
                // A laptop is low: the hands reach down to the floor.
                gait::stoop(joints, bent * if object == CarriedObject::Laptop { LOW } else { 1.0 });
                Some(inwards(route) * turned)
            }
        }
    }

    /// Moves the hands to where the task needs them.
    pub fn hands(self, route: &Route, step: &Step, p: &Proportions, poses: &mut BonePoses) {
        let (rigid_actor, grip, firm) = match self {
            Self::Nothing => return,
            Self::Push => (chair(step), CHAIR_GRIP_M, 1.0),
            Self::Carry(object) => {
                let handling = match route {
                    Route::Around(route) => handling(route, step),
                    Route::Along(_) => Handling::Held,
                };
                let firm = match handling {
                    Handling::Held => 1.0,
                    Handling::Left(_) => return,
                    Handling::Fetched(_, t) => {
                        if t >= 0.5 {
                            1.0
                        } else {
                            bent(t)
                        }
                    }
                    Handling::PutDown(_, t) => {
                        if t < 0.5 {
                            1.0
                        } else {
                            bent(t)
                        }
                    }
                };
                (carried(object, route, step, poses), grip_m(object), firm)
            }
        };
        for (side, sign) in [(0, 1.0), (1, -1.0)] {
            let on_thing = (rigid_actor * Point3::new(sign * grip[0], grip[1], grip[2])).coords;
            let free = skeleton::palm(poses, p, side);
            skeleton::reach(poses, p, side, &(free + (on_thing - free) * firm));
        }
    }
}

/// Returns the pose of the pushed chair.
pub fn chair(step: &Step) -> Isometry3<f32> {
    let pusher = upright(step.position.map(|v| v as f32), 0.0, step.heading as f32);
    pusher * Translation3::new(0.0, CHAIR_AHEAD_M, 0.0)
}

/// Returns the place of the right hand on a carried object, in the axes of the object, m.
pub fn grip_m(object: CarriedObject) -> [f32; 3] {
    match object {
        CarriedObject::Box => [BOX_M[0] / 2.0 + 0.01, 0.0, 0.8 * BOX_M[2]],
        CarriedObject::Laptop => [LAPTOP_M[0] / 2.0, 0.02, LAPTOP_M[2]],
    }
}

/// Returns the pose of a carried object: the middle of its bottom, in the hands of the person with the given bones, or on the
/// floor.
pub fn carried(object: CarriedObject, route: &Route, step: &Step, poses: &BonePoses) -> Isometry3<f32> {
    // The turn and roll of the hips are ignored: hands keep objects level.
    let hips = poses[0].translation.vector;
    let [ahead, up] = match object {
        CarriedObject::Box => HOLD_BOX_M,
        CarriedObject::Laptop => HOLD_LAPTOP_M,
    };
    let held =
        |turn: f32| upright([hips.x, hips.y], hips.z, step.heading as f32 + turn) * Translation3::new(0.0, ahead, up);
    let Route::Around(route) = route else { return held(0.0) };
    let between = |stop: usize, t: f32| {
        let (from, to, share) = (held(inwards(route) * turned(t)), left_at(route, stop), bent(t));
        Isometry3::from_parts(
            Translation3::from(from.translation.vector.lerp(&to.translation.vector, share)),
            from.rotation.nlerp(&to.rotation, share),
        )
    };
    match handling(route, step) {
        Handling::Held => held(0.0),
        Handling::Left(stop) => left_at(route, stop),
        Handling::Fetched(stop, t) => {
            if t < 0.5 {
                left_at(route, stop)
            } else {
                between(stop, t)
            }
        }
        Handling::PutDown(stop, t) => {
            if t >= 0.5 {
                left_at(route, stop)
            } else {
                between(stop, t)
            }
        }
    }
}

/// Returns the pose on the floor at a stop: beside the route, on its inner side.
fn left_at(route: &Walkway, stop: usize) -> Isometry3<f32> {
    let (position, heading) = route.place_of(stop);
    let turn = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), heading as f32 + inwards(route));
    let ahead = turn * Vec3::new(0.0, PUT_AHEAD_M, 0.0);
    let place = Translation3::new(position[0] as f32 + ahead.x, position[1] as f32 + ahead.y, 0.0);
    Isometry3::from_parts(place, turn)
}

/// Returns a quarter turn towards the middle of the circuit.
fn inwards(route: &Walkway) -> f32 {
    let quarter = std::f32::consts::FRAC_PI_2;
    if route.is_clockwise() { -quarter } else { quarter }
}

/// Returns how far the person has turned to the side, there and back.
fn turned(t: f32) -> f32 {
    smooth(t / 0.2) * (1.0 - smooth((t - 0.8) / 0.2))
}

/// Returns how far the person has bent down: to the floor at half time, and up again.
fn bent(t: f32) -> f32 {
    smooth((t - 0.17) / 0.28) * (1.0 - smooth((t - 0.55) / 0.28))
}

fn handling(route: &Walkway, step: &Step) -> Handling {
    let (legs, first) = route.leg_to(STOPS[0]);
    let (_, second) = route.leg_to(STOPS[1]);
    // P is visited before Q in each round.
    let (p, q) = if first < second { (STOPS[0], STOPS[1]) } else { (STOPS[1], STOPS[0]) };
    let (leg_p, leg_q) = (first.min(second), first.max(second));
    let (round, leg) = (step.legs_before.div_euclid(legs), step.legs_before.rem_euclid(legs));
    // Arrivals before that of this leg, and whether this leg leads to an arrival that has begun.
    let before = 2 * round + i64::from(leg > leg_p) + i64::from(leg > leg_q);
    let arrives = (leg == leg_p || leg == leg_q) && step.waited > 0.0;
    let spare = (step.pause - HANDLING_S).max(0.0) / 2.0;
    let t = ((step.waited - spare) / HANDLING_S.min(step.pause)).clamp(0.0, 1.0) as f32;
    // The state after the last of the arrivals so far.
    match ((before + i64::from(arrives) - 1).rem_euclid(6), arrives) {
        (0, true) => Handling::Fetched(p, t),
        (1, true) => Handling::PutDown(q, t),
        (3, true) => Handling::Fetched(q, t),
        (4, true) => Handling::PutDown(p, t),
        (0 | 3, false) => Handling::Held,
        (1 | 2, _) => Handling::Left(q),
        _ => Handling::Left(p),
    }
}

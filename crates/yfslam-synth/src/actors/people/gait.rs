//! Movements: a walking cycle, and sitting or standing with small gestures.
//!
//! In: the distance and speed of a walker, or the time. Out: joint angles. Walking is built from the feet: each carries the weight
//! for 60 % of the cycle, rolls over its ball and swings forward (phases as in Winter, "Biomechanics and Motor Control of Human
//! Movement", chapter 2); the law of cosines gives hip and knee.

use std::f32::consts::TAU;

use super::skeleton::{Joints, Proportions};
use super::smooth;
use crate::rng::Rng;

/// Speed above which strides have their full length, m/s; slower walkers are about to stop.
const FULL_STRIDE_SPEED: f32 = 0.7;
/// Length of a stride (two steps) relative to the leg.
const STRIDE: f32 = 1.5;
/// Share of the cycle in which a foot carries the weight.
const STANCE: f32 = 0.6;
/// Place of the foot when it is put down, ahead of the hips, as a share of the stride.
const AHEAD: f32 = 0.255;
/// Height of the hips above the ankle of a foot that stands flat, relative to the leg.
const HIPS: f32 = 0.93;
/// Distance from the ankle to the ball of the foot, m, and the rotation of the heel about it, rad.
const BALL_M: f32 = 0.14;
const HEEL_RISE: f32 = 0.75;
/// Height to which a foot is lifted while it swings, m.
const LIFT_M: f32 = 0.05;

/// Returns the length of a full stride (two steps), m.
pub fn stride(p: &Proportions) -> f32 {
    STRIDE * (p.thigh() + p.shank())
}

/// Returns the joints of a person who has walked `distance` metres and moves at `speed` m/s; a halted person gestures. A foot that
/// carries the weight stays in place; the angles of its leg follow.
pub fn walk(p: &Proportions, distance: f32, speed: f32, seed: u64, time: f32) -> Joints {
    let effort = smooth(speed / FULL_STRIDE_SPEED);
    let cycle = (distance / stride(p)).fract();
    let mut stand = Joints { knee: [0.05; 2], hip: [0.025; 2], ankle: [0.025; 2], ..Joints::default() };
    stand.elbow = [0.18; 2];
    let mut j = Joints::default();
    for (side, offset) in [(0, 0.0), (1, 0.5)] {
        let at = (cycle + offset).rem_euclid(1.0);
        let foot = foot(p, at);
        let (hip, knee) = bend(p, foot.forward, HIPS * (p.thigh() + p.shank()) - foot.up);
        (j.hip[side], j.knee[side], j.ankle[side]) = (hip, knee, foot.pitch - hip + knee);
        // The arm swings against its leg, which is foremost when its foot is put down.
        let cos = libm::cosf(at * TAU);
        j.shoulder[side] = -0.38 * cos + 0.02;
        j.elbow[side] = 0.40 - 0.15 * cos;
    }
    let (sin, cos) = libm::sincosf(cycle * TAU);
    j.pelvis = [0.05 * cos, 0.03 * sin];
    j.trunk = [0.05, -0.08 * cos, 0.0];
    let mut j = stand.blend(&j, effort);
    for side in [0, 1] {
        j.lift[side] += 0.10;
    }
    j.trunk[0] += 0.03;
    gestures(&mut j, seed, time, 0.9 * (1.0 - effort));
    j
}

/// A foot in the sagittal plane: its ankle relative to where it is when the foot stands flat below the hips, m, and the
/// slope of the sole, toes up, rad.
struct Foot {
    forward: f32,
    up: f32,
    pitch: f32,
}

/// Returns the foot at share `at` of the cycle that begins when it is put down.
fn foot(p: &Proportions, at: f32) -> Foot {
    let stride = stride(p);
    // Turning about the ball moves the ankle up and forward.
    let rolled = |heel: f32| {
        let (sin, cos) = libm::sincosf(heel);
        let a = p.ankle();
        [BALL_M * (1.0 - cos) + a * sin, BALL_M * sin - a * (1.0 - cos)]
    };
    if at < STANCE {
        let heel = HEEL_RISE * smooth((at / STANCE - 0.55) / 0.45);
        let [forward, up] = rolled(heel);
        return Foot { forward: stride * (AHEAD - at) + forward, up, pitch: -heel };
    }
    let t = (at - STANCE) / (1.0 - STANCE);
    let heel = HEEL_RISE * (1.0 - smooth(t / 0.8));
    let [forward, up] = rolled(heel);
    let swing = AHEAD - STANCE + STANCE * smooth(t);
    let lift = LIFT_M * libm::sinf(std::f32::consts::PI * t).powi(2);
    Foot { forward: stride * swing + forward, up: up + lift, pitch: -heel }
}

/// Returns the angles of hip and knee that bring the ankle `forward` of the hip and `down` from it.
fn bend(p: &Proportions, forward: f32, down: f32) -> (f32, f32) {
    let (thigh, shank) = (p.thigh(), p.shank());
    let reach = libm::hypotf(forward, down).clamp(0.3 * (thigh + shank), 0.999 * (thigh + shank));
    let inside =
        libm::acosf(((thigh * thigh + shank * shank - reach * reach) / (2.0 * thigh * shank)).clamp(-1.0, 1.0));
    let above = libm::acosf(((thigh * thigh + reach * reach - shank * shank) / (2.0 * thigh * reach)).clamp(-1.0, 1.0));
    (libm::atan2f(forward, down) + above, std::f32::consts::PI - inside)
}

/// Returns a slow, smooth, seeded sway of about [-1, 1]; `channel` distinguishes the joints.
fn sway(seed: u64, channel: u64, time: f32, hertz: f32) -> f32 {
    let mut rng = Rng::new(seed, channel);
    let (a, b) = (rng.range(0.0, TAU), rng.range(0.0, TAU));
    let (f, g) = (hertz * rng.range(0.8, 1.2), hertz * rng.range(1.7, 2.4));
    0.7 * libm::sinf(TAU * f * time + a) + 0.3 * libm::sinf(TAU * g * time + b)
}

/// Adds breathing, glances and gestures that come and go; with `lively` 1 they are those of a conversation.
fn gestures(j: &mut Joints, seed: u64, time: f32, lively: f32) {
    let s = |channel, hertz| sway(seed, channel, time, hertz);
    j.head[0] += 0.06 + 0.08 * lively * s(1, 0.21);
    j.head[1] += 0.45 * lively * s(2, 0.11);
    j.trunk[0] += 0.02 * lively * s(3, 0.13) + 0.004 * s(4, 0.27);
    j.trunk[1] += 0.10 * lively * s(5, 0.07);
    for side in [0, 1] {
        let channel = 10 * (side as u64 + 1);
        // Hands of a speaking person: active about half of the time.
        let active = lively * (2.0 * s(channel, 0.06)).clamp(0.0, 1.0);
        j.shoulder[side] += active * (0.28 + 0.16 * s(channel + 1, 0.55));
        j.elbow[side] += active * (0.50 + 0.42 * s(channel + 2, 0.75));
        j.lift[side] += 0.04 * s(channel + 3, 0.1) + active * 0.12 * (1.0 + s(channel + 4, 0.4));
    }
}

/// Returns the joints of a standing person.
pub fn stand(seed: u64, time: f32) -> Joints {
    let mut j =
        Joints { shoulder: [0.05; 2], elbow: [0.25; 2], lift: [0.10; 2], spread: [0.06; 2], ..Joints::default() };
    j.knee = [0.05; 2];
    j.hip = [0.025; 2];
    j.ankle = [0.025; 2];
    gestures(&mut j, seed, time, 0.8);
    j
}

/// Bends a person down to the floor (1) with straight legs at 0; the feet stay below the hips.
pub fn stoop(j: &mut Joints, depth: f32) {
    const LEGS: f32 = 0.95;
    for side in [0, 1] {
        j.hip[side] += LEGS * depth;
        j.knee[side] += 2.0 * LEGS * depth;
        j.ankle[side] += LEGS * depth;
        j.spread[side] += 0.10 * depth;
    }
    j.trunk[0] += 1.2 * depth;
    j.head[0] += 0.3 * depth;
}

/// Returns the joints of a person who sits with the hip joints `height` metres above the floor, shanks upright, soles on the floor.
pub fn sit(p: &Proportions, height: f32, seed: u64, time: f32) -> Joints {
    let bend = libm::acosf(((height - p.shank() - p.ankle()) / p.thigh()).clamp(-0.3, 0.9));
    let mut j = Joints {
        hip: [bend; 2],
        knee: [bend; 2],
        spread: [0.12; 2],
        shoulder: [0.28; 2],
        elbow: [1.05; 2],
        lift: [0.14; 2],
        trunk: [0.02, 0.0, 0.0],
        ..Joints::default()
    };
    gestures(&mut j, seed, time, 0.3);
    j
}

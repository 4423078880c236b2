//! Movements: a walking cycle, and sitting or standing with small gestures.
//!
//! In: how far and how fast someone walks, or the time. Out: joint angles. The walking cycle keeps the main harmonics of
//! the joint angles in Winter, "Biomechanics and Motor Control of Human Movement", chapter 2.

use std::f32::consts::TAU;

use super::skeleton::{Joints, Proportions};
use crate::rng::Rng;

/// Speed at which people stride out in full, m/s.
const FULL_STRIDE_SPEED: f32 = 0.9;
/// Swing of the hip at full stride, rad.
const HIP_SWING: f32 = 0.42;

/// Length of a full stride (two steps), m.
pub fn stride(p: &Proportions) -> f32 {
    4.0 * (p.thigh() + p.shank()) * HIP_SWING.sin() * 0.95
}

/// Joints of someone who has walked `distance` metres and moves at `speed` m/s; who halts, gestures.
pub fn walk(p: &Proportions, distance: f32, speed: f32, seed: u64, time: f32) -> Joints {
    let effort = (speed / FULL_STRIDE_SPEED).clamp(0.0, 1.2);
    let phase = (distance / stride(p)).fract() * TAU;
    let mut j = Joints::default();
    for (side, offset) in [(0, 0.0), (1, TAU / 2.0)] {
        let (sin, cos) = (phase + offset).sin_cos();
        let swing = (-(phase + offset - 0.35).sin()).max(0.0);
        j.hip[side] = effort * (HIP_SWING * cos + 0.06);
        j.knee[side] = 0.06 + effort * (0.10 + 0.85 * swing * swing.sqrt());
        // The foot stays about level while it carries, and its heel lifts at the end.
        j.ankle[side] = 0.6 * (j.knee[side] - j.hip[side]) - effort * 0.25 * (sin * 0.5 - cos * 0.5).max(0.0);
        j.shoulder[side] = -effort * 0.42 * cos + 0.02;
        j.elbow[side] = 0.18 + effort * (0.22 - 0.15 * cos);
        j.lift[side] = 0.10;
    }
    let (sin, cos) = phase.sin_cos();
    j.pelvis = [0.10 * effort * cos, 0.04 * effort * sin];
    j.trunk = [0.03 + 0.05 * effort, -0.08 * effort * cos, 0.0];
    gestures(&mut j, seed, time, 0.9 * (1.0 - effort.min(1.0)));
    j
}

/// Slow, smooth, seeded sway in [-1, 1] or so; `channel` tells joints apart.
fn sway(seed: u64, channel: u64, time: f32, hertz: f32) -> f32 {
    let mut rng = Rng::new(seed, channel);
    let (a, b) = (rng.range(0.0, TAU), rng.range(0.0, TAU));
    let (f, g) = (hertz * rng.range(0.8, 1.2), hertz * rng.range(1.7, 2.4));
    0.7 * (TAU * f * time + a).sin() + 0.3 * (TAU * g * time + b).sin()
}

/// Adds breathing, glances and gestures that come and go; `lively` 1 is a conversation.
fn gestures(j: &mut Joints, seed: u64, time: f32, lively: f32) {
    let s = |channel, hertz| sway(seed, channel, time, hertz);
    j.head[0] += 0.06 + 0.08 * lively * s(1, 0.21);
    j.head[1] += 0.45 * lively * s(2, 0.11);
    j.trunk[0] += 0.025 * s(3, 0.13) + 0.006 * s(4, 0.27);
    j.trunk[1] += 0.10 * lively * s(5, 0.07);
    for side in [0, 1] {
        let channel = 10 * (side as u64 + 1);
        // Talking hands: active about half of the time.
        let active = lively * (2.0 * s(channel, 0.06)).clamp(0.0, 1.0);
        j.shoulder[side] += active * (0.28 + 0.16 * s(channel + 1, 0.55));
        j.elbow[side] += active * (0.50 + 0.42 * s(channel + 2, 0.75));
        j.lift[side] += 0.04 * s(channel + 3, 0.1) + active * 0.12 * (1.0 + s(channel + 4, 0.4));
    }
}

/// Joints of someone who stands.
pub fn stand(seed: u64, time: f32) -> Joints {
    let mut j =
        Joints { shoulder: [0.05; 2], elbow: [0.25; 2], lift: [0.10; 2], spread: [0.06; 2], ..Joints::default() };
    j.knee = [0.05; 2];
    j.hip = [0.025; 2];
    j.ankle = [0.025; 2];
    gestures(&mut j, seed, time, 0.8);
    j
}

/// Joints of someone who bends down to the floor (1) with straight legs at 0; the feet stay below the hips.
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

/// Joints of someone who sits with the hip joints `height` metres above the floor, shanks upright, soles on the floor.
pub fn sit(p: &Proportions, height: f32, seed: u64, time: f32) -> Joints {
    let bend = ((height - p.shank() - p.ankle()) / p.thigh()).clamp(-0.3, 0.9).acos();
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
    gestures(&mut j, seed, time, 1.0);
    j
}

//! Materials of buildings: concrete, painted walls, floors, doors, signs, radiators, crates, rust.
//!
//! In: a canvas, metres per texel `m` and a seed. Out: the painted canvas.

use super::Color;
use super::canvas::Canvas;
use super::material::{blend, tint};
use super::noise::cell;
use super::print::{self, BLACK, WHITE};
use crate::rng::Rng;

fn size(canvas: &Canvas) -> (f32, f32) {
    (canvas.width() as f32, canvas.height() as f32)
}

/// Draws a crooked line of short segments, like cracks and scratches.
fn crack(canvas: &mut Canvas, m: f32, color: Color, rng: &mut Rng) {
    let (w, h) = size(canvas);
    let mut from = [rng.range(0.0, w), rng.range(0.0, h)];
    let mut angle = rng.range(0.0, std::f32::consts::TAU);
    for _ in 0..4 + rng.below(14) {
        angle += rng.range(-0.7, 0.7);
        let step = rng.range(0.02, 0.07) / m;
        let to = [from[0] + step * libm::cosf(angle), from[1] + step * libm::sinf(angle)];
        canvas.line(from, to, rng.range(0.002, 0.005) / m, color);
        from = to;
    }
}

pub(super) fn concrete(canvas: &mut Canvas, color: Color, m: f32, seed: u64, rng: &mut Rng) {
    let fields = [
        canvas.field(seed, [0.9 * m; 2], 4),
        canvas.field(seed ^ 1, [6.0 * m, 1.2 * m], 3),
        canvas.field(seed ^ 2, [22.0 * m; 2], 3),
    ];
    canvas.shade_with(fields, |x, y, _, [stain, run, grain]| {
        let pore = if cell(seed ^ 3, x * m * 70.0, y * m * 70.0) > 0.975 { -0.22 } else { 0.0 };
        tint(color, 1.0 + 0.5 * (stain - 0.5) + 0.22 * (run - 0.5) + 0.20 * (grain - 0.5) + pore)
    });
    let (w, h) = size(canvas);
    let (dark, thin) = (tint(color, 0.55), 0.008 / m);
    // Formwork of 1.25 m × 2.5 m with tie holes.
    let (across, down) = (1.25 / m, 2.5 / m);
    for i in 1..=(w / across) as usize {
        canvas.rect(i as f32 * across - thin, 0.0, thin, h, dark);
    }
    for j in 1..=(h / down) as usize {
        canvas.rect(0.0, j as f32 * down, w, thin, dark);
    }
    for (i, j) in (0..(w / across) as usize).flat_map(|i| (0..(2.0 * h / down) as usize).map(move |j| (i, j))) {
        canvas.disc((i as f32 + 0.5) * across, (j as f32 + 0.5) * down / 2.0, 0.015 / m, dark);
    }
    let area = w * h * m * m;
    for _ in 0..(area * 1.2 + rng.range(0.0, 1.0)) as usize {
        let shade = rng.range(0.35, 0.7);
        crack(canvas, m, tint(color, shade), rng);
    }
}

pub(super) fn paint(canvas: &mut Canvas, color: Color, m: f32, seed: u64, rng: &mut Rng) {
    let fields = [canvas.field(seed, [0.7 * m; 2], 3), canvas.field(seed ^ 1, [28.0 * m; 2], 2)];
    canvas
        .shade_with(fields, |_, _, _, [cloud, grain]| tint(color, 1.0 + 0.03 * (cloud - 0.5) + 0.035 * (grain - 0.5)));
    let (w, h) = size(canvas);
    // Old nail holes and marks, one in two square metres.
    for _ in 0..(w * h * m * m * 0.5 + rng.range(0.0, 1.0)) as usize {
        let mark = tint(color, rng.range(0.55, 0.9));
        canvas.disc(rng.range(0.0, w), rng.range(0.0, h), rng.range(0.003, 0.007) / m, mark);
    }
}

pub(super) fn vinyl(canvas: &mut Canvas, color: Color, m: f32, seed: u64) {
    let fields = [canvas.field(seed, [1.5 * m; 2], 3), canvas.field(seed ^ 1, [14.0 * m, 5.0 * m], 3)];
    canvas.shade_with(fields, |x, y, _, [worn, streak]| {
        let fleck = cell(seed ^ 2, x * m * 55.0, y * m * 130.0);
        let fleck = if fleck > 0.94 { 0.07 } else { 0.0 } - if fleck < 0.06 { 0.08 } else { 0.0 };
        tint(color, 1.0 + 0.14 * (worn - 0.5) + 0.10 * (streak - 0.5) + fleck)
    });
    let (w, h) = size(canvas);
    let seam = 0.006 / m;
    canvas.rect(0.0, 0.0, w, seam, tint(color, 0.7));
    canvas.rect(0.0, 0.0, seam, h, tint(color, 0.7));
}

pub(super) fn door(canvas: &mut Canvas, color: Color, m: f32, seed: u64, rng: &mut Rng) {
    let (w, h) = size(canvas);
    let frame = 0.07 / m;
    canvas.fill([0.62, 0.63, 0.64]);
    let gap = 0.008 / m;
    canvas.rect(frame - gap, frame - gap, w - 2.0 * frame + 2.0 * gap, h, BLACK);
    let grain = canvas.field(seed, [1.5 * m, 20.0 * m], 3);
    let leaf = [frame, frame, w - 2.0 * frame, h - frame];
    canvas.shade_with([grain], |x, y, old, [grain]| {
        let inside = x > leaf[0] && x < leaf[0] + leaf[2] && y > leaf[1] && y < leaf[1] + leaf[3];
        if inside { tint(color, 1.0 + 0.25 * (grain - 0.5)) } else { old }
    });
    // Handle and lock on the right, kick plate below, a plate with the number at eye level.
    let metal = [0.80, 0.80, 0.82];
    let (x, y) = (w - frame - 0.09 / m, 1.05 / m);
    canvas.rect(x, h - y - 0.08 / m, 0.045 / m, 0.22 / m, tint(metal, 0.85));
    canvas.rect(x - 0.09 / m, h - y - 0.03 / m, 0.12 / m, 0.025 / m, metal);
    canvas.disc(x + 0.022 / m, h - y + 0.09 / m, 0.010 / m, BLACK);
    canvas.rect(frame, h - 0.25 / m, w - 2.0 * frame, 0.22 / m, [0.70, 0.71, 0.73]);
    if rng.chance(0.4) {
        let glass = [frame + 0.16 / m, frame + 0.16 / m, 0.22 / m, 0.75 / m];
        canvas.rect(glass[0], glass[1], glass[2], glass[3], [0.24, 0.29, 0.33]);
        canvas.line([glass[0], glass[1] + 0.5 * glass[3]], [glass[0] + glass[2], glass[1]], 0.02 / m, [0.45; 3]);
    }
    let plate = [w * 0.5 - 0.09 / m, h - 1.72 / m, 0.20 / m, 0.14 / m];
    canvas.rect(plate[0], plate[1], plate[2], plate[3], WHITE);
    let number: String = (0..3).map(|_| char::from(b'0' + rng.below(10) as u8)).collect();
    canvas.text(plate[0] + 0.02 / m, plate[1] + 0.02 / m, 0.011 / m, &number, BLACK);
    print::word(canvas, plate[0] + 0.02 / m, plate[1] + 0.09 / m, 0.15 / m, tint(BLACK, 3.0), rng);
    if rng.chance(0.5) {
        let note = [frame + rng.range(0.2, 0.4) / m, h - 1.45 / m, 0.15 / m, 0.21 / m];
        canvas.rect(note[0], note[1], note[2], note[3], WHITE);
        let inner = [note[0] + 0.015 / m, note[1] + 0.02 / m, note[2] - 0.03 / m, note[3] - 0.04 / m];
        print::paragraph(canvas, inner, 0.014 / m, tint(BLACK, 2.5), rng);
    }
}

pub(super) fn sign(canvas: &mut Canvas, color: Color, rng: &mut Rng) {
    let (w, h) = size(canvas);
    canvas.fill(color);
    let edge = 0.06 * h;
    for (x, y, bw, bh) in [(0.0, 0.0, w, edge), (0.0, h - edge, w, edge), (0.0, 0.0, edge, h), (w - edge, 0.0, edge, h)]
    {
        canvas.rect(x, y, bw, bh, WHITE);
    }
    let side = 0.5 * h.min(w);
    let (cx, cy) = (0.15 * w + 0.5 * side, 0.5 * h);
    match rng.below(3) {
        0 => {
            // An arrow.
            canvas.rect(cx - 0.5 * side, cy - 0.12 * side, 0.7 * side, 0.24 * side, WHITE);
            for step in 0..8 {
                let t = step as f32 / 8.0;
                canvas.rect(
                    cx + (0.1 + 0.4 * t) * side,
                    cy - 0.4 * side * (1.0 - t),
                    0.05 * side,
                    0.8 * side * (1.0 - t),
                    WHITE,
                );
            }
        }
        1 => {
            canvas.disc(cx, cy - 0.32 * side, 0.14 * side, WHITE);
            canvas.line([cx, cy - 0.15 * side], [cx - 0.1 * side, cy + 0.15 * side], 0.18 * side, WHITE);
            canvas.line([cx - 0.1 * side, cy + 0.15 * side], [cx + 0.2 * side, cy + 0.4 * side], 0.10 * side, WHITE);
            canvas.line([cx - 0.1 * side, cy + 0.15 * side], [cx - 0.4 * side, cy + 0.35 * side], 0.10 * side, WHITE);
            canvas.line([cx - 0.3 * side, cy - 0.1 * side], [cx + 0.3 * side, cy], 0.09 * side, WHITE);
        }
        _ => {
            canvas.disc(cx, cy, 0.45 * side, WHITE);
            canvas.disc(cx, cy, 0.32 * side, color);
            canvas.rect(cx - 0.07 * side, cy - 0.3 * side, 0.14 * side, 0.6 * side, WHITE);
        }
    }
    let left = 0.25 * w + side;
    if left < 0.75 * w {
        print::word(canvas, left, 0.38 * h, (0.92 * w - left).min(h), WHITE, rng);
    }
}

pub(super) fn hazard(canvas: &mut Canvas, m: f32, seed: u64) {
    let fields = [canvas.field(seed, [9.0 * m; 2], 4), canvas.field(seed ^ 1, [1.5 * m; 2], 2)];
    canvas.shade_with(fields, |x, y, _, [worn, dirt]| {
        let stripe = ((x + y) * m / 0.20).rem_euclid(1.0) < 0.5;
        let color = if stripe { [0.85, 0.68, 0.12] } else { [0.11, 0.11, 0.11] };
        let color = if worn > 0.66 { [0.48, 0.46, 0.44] } else { color };
        tint(color, 0.75 + 0.5 * dirt)
    });
}

pub(super) fn notice_board(canvas: &mut Canvas, m: f32, seed: u64, rng: &mut Rng) {
    let cork = [0.70, 0.52, 0.36];
    canvas.shade(|x, y, _| tint(cork, 0.85 + 0.3 * cell(seed, x * m * 220.0, y * m * 220.0)));
    let (w, h) = size(canvas);
    let columns = (w * m / 0.27).max(1.0) as usize;
    let rows = (h * m / 0.36).max(1.0) as usize;
    for (i, j) in (0..columns).flat_map(|i| (0..rows).map(move |j| (i, j))) {
        if rng.chance(0.15) {
            continue;
        }
        let (x, y) = (
            (i as f32 + rng.range(0.05, 0.2)) * w / columns as f32,
            (j as f32 + rng.range(0.03, 0.15)) * h / rows as f32,
        );
        let (pw, ph) = (rng.range(0.14, 0.21) / m, rng.range(0.19, 0.29) / m);
        let ground = if rng.chance(0.7) { WHITE } else { blend(WHITE, print::ink(rng), 0.4) };
        canvas.rect(x, y, pw, ph, ground);
        print::word(canvas, x + 0.1 * pw, y + 0.07 * ph, 0.6 * pw, tint(print::ink(rng), 0.8), rng);
        if rng.chance(0.5) {
            print::illustration(canvas, [x + 0.1 * pw, y + 0.25 * ph, 0.8 * pw, 0.35 * ph], rng);
        }
        let text = [x + 0.1 * pw, y + 0.64 * ph, 0.8 * pw, 0.3 * ph];
        print::paragraph(canvas, text, 0.011 / m, tint(BLACK, 2.0), rng);
        canvas.disc(x + 0.5 * pw, y + 0.012 / m, 0.008 / m, print::ink(rng));
    }
    let edge = 0.025 / m;
    for (x, y, bw, bh) in [(0.0, 0.0, w, edge), (0.0, h - edge, w, edge), (0.0, 0.0, edge, h), (w - edge, 0.0, edge, h)]
    {
        canvas.rect(x, y, bw, bh, [0.62, 0.62, 0.63]);
    }
}

pub(super) fn ribs(canvas: &mut Canvas, color: Color, m: f32, seed: u64) {
    let dirt = canvas.field(seed, [4.0 * m; 2], 3);
    canvas.shade_with([dirt], |x, y, _, [dirt]| {
        let t = (x * m / 0.05).fract();
        let rib = if t < 0.12 { 0.45 } else { 0.85 + 0.25 * (1.0 - (2.0 * t - 1.0).abs()) };
        let rail = if (y * m - 0.05).abs() < 0.008 { 0.8 } else { 1.0 };
        tint(color, rib * rail * (0.9 + 0.2 * dirt))
    });
}

pub(super) fn planks(canvas: &mut Canvas, color: Color, m: f32, seed: u64, rng: &mut Rng) {
    let fields = [canvas.field(seed, [1.3 * m, 9.0 * m], 3), canvas.field(seed ^ 1, [12.0 * m, 180.0 * m], 2)];
    canvas.shade_with(fields, |_, y, _, [bend, fibre]| {
        let plank = y * m / 0.12;
        let tone = cell(seed ^ 2, 0.0, plank) - 0.5;
        let gap = if plank.fract() < 0.06 { 0.35 } else { 1.0 };
        tint(color, gap * (0.95 + 0.35 * tone + 0.25 * (bend - 0.5) + 0.25 * (fibre - 0.5)))
    });
    let (w, h) = size(canvas);
    // Battens at both ends, with nails, and a stencil.
    let batten = 0.09 / m;
    for x in [0.0, w - batten] {
        canvas.shade_within(x, 0.0, batten, h, |_, y, _| {
            tint(color, 0.82 + 0.2 * (cell(seed ^ 3, 0.0, y * m * 90.0) - 0.5))
        });
        canvas.rect(x, 0.0, 0.006 / m, h, tint(color, 0.45));
        canvas.rect(x + batten - 0.006 / m, 0.0, 0.006 / m, h, tint(color, 0.45));
        for j in 0..(h * m / 0.12) as usize {
            canvas.disc(x + 0.5 * batten, (j as f32 + 0.5) * 0.12 / m, 0.007 / m, tint(color, 0.35));
        }
    }
    print::word(canvas, 0.25 * w, 0.3 * h, 0.45 * w, tint(color, 0.35), rng);
}

pub(super) fn rusty(canvas: &mut Canvas, color: Color, m: f32, seed: u64) {
    let fields = [canvas.field(seed, [5.0 * m, 3.0 * m], 4), canvas.field(seed ^ 1, [28.0 * m; 2], 3)];
    let h = canvas.height() as f32;
    canvas.shade_with(fields, |_, y, _, [spread, grain]| {
        let rust = [0.46, 0.29, 0.19];
        let eaten = ((spread - 0.52) * 9.0).clamp(0.0, 1.0);
        // Two beads around a barrel.
        let bead = if (y / h - 0.33).abs() < 0.015 || (y / h - 0.67).abs() < 0.015 { 0.6 } else { 1.0 };
        tint(blend(color, rust, eaten), bead * (0.8 + 0.4 * grain))
    });
}

pub(super) fn socket(canvas: &mut Canvas) {
    let (w, h) = size(canvas);
    canvas.fill([0.84, 0.84, 0.82]);
    for x in [0.25, 0.75] {
        canvas.disc(x * w, 0.5 * h, 0.34 * h, [0.68; 3]);
        canvas.disc(x * w, 0.5 * h, 0.30 * h, [0.78; 3]);
        canvas.disc(x * w - 0.13 * h, 0.5 * h, 0.05 * h, BLACK);
        canvas.disc(x * w + 0.13 * h, 0.5 * h, 0.05 * h, BLACK);
    }
    canvas.rect(0.495 * w, 0.0, 0.01 * w, h, [0.55; 3]);
}

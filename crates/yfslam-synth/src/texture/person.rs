//! Skin, faces, hair and clothes. On textures that go once around a body, u = 1/4 is the front and u = 3/4 the back.

use super::canvas::Canvas;
use super::material::{Pattern, blend, tint};
use super::noise::{cell, fractal};
use super::{Color, print};
use crate::rng::Rng;

/// Returns weave and creases, a factor for the colour at (x, y) metres.
fn creases(seed: u64, x: f32, y: f32) -> f32 {
    let weave = cell(seed, x * 330.0, y * 330.0) - 0.5;
    let bend = fractal(seed ^ 2, x * 3.0, y * 3.0, 2);
    // Creases are narrow and dark, the cloth between them is wide and bright.
    let ridge = (fractal(seed ^ 1, x * 7.0 + 1.5 * bend, y * 4.5 + 2.0 * bend, 3) - 0.5).abs();
    let crease = (1.0 - ridge * 9.0).max(0.0);
    let soft = fractal(seed ^ 3, x * 5.0, y * 3.0, 3) - 0.5;
    1.02 + 0.09 * weave - 0.22 * crease * crease + 0.30 * soft
}

pub(super) fn garment(canvas: &mut Canvas, color: Color, m: f32, seed: u64) {
    canvas.shade(|x, y, _| tint(color, creases(seed, x * m, y * m)));
}

pub(super) fn skin(canvas: &mut Canvas, color: Color, m: f32, seed: u64) {
    canvas.shade(|x, y, _| {
        let cloud = fractal(seed, x * m * 14.0, y * m * 14.0, 3) - 0.5;
        let red = fractal(seed ^ 1, x * m * 6.0, y * m * 6.0, 2) - 0.5;
        let [r, g, b] = tint(color, 1.0 + 0.10 * cloud);
        [r * (1.0 + 0.06 * red), g * (1.0 - 0.05 * red), b * (1.0 - 0.05 * red)]
    });
}

pub(super) fn shirt(canvas: &mut Canvas, [base, accent]: [Color; 2], pattern: Pattern, m: f32, seed: u64) {
    let (width, height) = (canvas.width() as f32, canvas.height() as f32);
    let mut rng = Rng::new(seed, 0x51);
    // Distance from the middle of the front, m.
    let off = |x: f32| ((x / width - 0.25).abs() * width * m, (x / width - 0.25) * width * m);
    let checks = |x: f32, y: f32, size: f32| {
        let on = |t: f32| f32::from(u8::from((t * m / size).fract() < 0.45));
        let thin = |t: f32| (t * m / size + 0.28).fract() < 0.06;
        let ground = blend(base, accent, 0.5 * (on(x) + on(y)));
        if thin(x) || thin(y) { tint(ground, 0.6) } else { ground }
    };
    match pattern {
        Pattern::Stripes => canvas.shade(|_, y, _| if (y * m / 0.032).fract() < 0.35 { accent } else { base }),
        Pattern::Checks => canvas.shade(|x, y, _| checks(x, y, 0.038)),
        Pattern::Motifs => canvas.shade(|x, y, _| {
            let (row, cells) = ((y * m / 0.034).floor(), 0.034);
            let (u, v) = ((x * m / cells + 0.5 * (row % 2.0)).fract(), (y * m / cells).fract());
            let ring = (u - 0.5).abs().max((v - 0.5).abs());
            if ring < 0.14 { accent } else { base }
        }),
        Pattern::Print => {
            canvas.fill(base);
            for front in [0.25, 0.75] {
                let size = (0.10 / m).min(width * 0.16);
                let (left, top) = (width * front - size, height * 0.30);
                canvas.rect(left, top, 2.0 * size, 1.6 * size, accent);
                print::word(canvas, left + 0.15 * size, top + 0.2 * size, 1.7 * size, base, &mut rng);
                canvas.disc(width * front, top + 1.15 * size, 0.3 * size, base);
            }
        }
        Pattern::Jacket => canvas.shade(|x, y, _| {
            let (v, (aside, signed)) = (y / height, off(x));
            let open = 0.022 + 0.035 * v;
            if aside < open {
                let (u, w) = ((x * m / 0.03).fract(), (y * m / 0.03).fract());
                return if (u - 0.5).abs().max((w - 0.5).abs()) < 0.12 { tint(accent, 0.75) } else { accent };
            }
            let zip = aside < open + 0.008 && (y * m / 0.006).fract() < 0.5;
            let lapel = v < 0.36 && aside < open + 0.075 * (1.0 - v / 0.36);
            let pocket = (0.66..0.68).contains(&v) && (aside - 0.13).abs() < 0.055;
            let seam = (aside - 0.20).abs() < 0.002 || (signed.abs() - 0.33).abs() < 0.002 || v > 0.965;
            match () {
                () if zip => [0.62, 0.62, 0.60],
                () if pocket => tint(base, 0.5),
                () if lapel => tint(base, 1.25),
                () if seam => tint(base, 0.72),
                () => blend(base, checks(x, y, 0.038), 0.4),
            }
        }),
        Pattern::Buttons => canvas.shade(|x, y, _| {
            let (v, (aside, signed)) = (y / height, off(x));
            let ground = checks(x, y, 0.024);
            let button = aside < 0.006 && ((y * m / 0.085).fract() - 0.5).abs() < 0.07;
            let placket = (aside - 0.017).abs() < 0.0015;
            let pocket = (0.30..0.47).contains(&v) && (signed - 0.09).abs() < 0.05;
            let rim = pocket && (v < 0.325 || (signed - 0.09).abs() > 0.047);
            match () {
                () if button => [0.92, 0.91, 0.88],
                () if placket || rim => tint(ground, 0.65),
                () => ground,
            }
        }),
    }
    canvas.shade(|x, y, old| tint(old, creases(seed, x * m, y * m)));
}

/// Returns a soft bump: 1 at `t` = 0, 0 from |t| = 1 on.
fn bump(t: f32) -> f32 {
    let s = (1.0 - t * t).max(0.0);
    s * s
}

pub(super) fn head(canvas: &mut Canvas, skin: Color, hair: Color, beard: bool, seed: u64) {
    let (width, height) = (canvas.width() as f32, canvas.height() as f32);
    let darkest = tint(hair, 0.55);
    canvas.shade(|x, y, _| {
        // v = 0 is the crown, u = 0 the middle of the face.
        let (u, v) = (x / width - 0.25, y / height);
        let u = if u > 0.5 { u - 1.0 } else { u };
        let side = u.abs();
        let oval = |cu: f32, cv: f32, ru: f32, rv: f32| ((side - cu) / ru).powi(2) + ((v - cv) / rv).powi(2);
        if v < hairline(side) - 0.01 {
            return tint(hair, 0.9);
        }
        // Skin: flushed cheeks, nose and lips, shaded eye sockets, sides of the nose, below the lip and the jaw.
        let blotch = fractal(seed ^ 2, x * 0.08, y * 0.08, 3) - 0.5;
        let flush = bump(oval(0.085, 0.60, 0.06, 0.09).sqrt()) + 0.5 * bump(oval(0.0, 0.57, 0.03, 0.05).sqrt());
        let shade = 0.26 * bump(oval(0.055, 0.465, 0.05, 0.055).sqrt())
            + 0.16 * bump(oval(0.033, 0.56, 0.014, 0.07).sqrt())
            + 0.16 * bump(oval(0.0, 0.745, 0.035, 0.02).sqrt())
            + 0.35 * ((v - 0.82) / 0.18).max(0.0)
            + 0.20 * ((side - 0.14) / 0.1).clamp(0.0, 1.0);
        let [r, g, b] = tint(skin, 1.04 + 0.08 * blotch - shade);
        let ground = [r * (1.0 + 0.05 * flush), g * (1.0 - 0.07 * flush), b * (1.0 - 0.06 * flush)];
        let strands = 0.75 + 0.5 * fractal(seed ^ 4, x * 0.7, y * 0.15, 2);
        let jaw = v > 0.63 && oval(0.0, 0.60, 0.20, 0.06) > 1.0 && oval(0.0, 0.70, 0.055, 0.035) > 1.0;
        let moustache = (0.638..0.672).contains(&v) && side < 0.055;
        let brow_middle = 0.425 - 0.10 * (side - 0.055).max(0.0) + 0.9 * (side - 0.055).powi(2) * 4.0;
        if (0.022..0.092).contains(&side) && (v - brow_middle).abs() < 0.013 - 0.10 * (side - 0.05).max(0.0) {
            tint(hair, 0.75 * strands)
        } else if oval(0.057, 0.477, 0.009, 0.0135) < 1.0 {
            [0.10, 0.08, 0.07] // iris
        } else if oval(0.057, 0.477, 0.026, 0.0125) < 1.0 {
            [0.90, 0.88, 0.86] // eye
        } else if oval(0.057, 0.473, 0.029, 0.017) < 1.0 {
            tint(skin, 0.45) // lashes
        } else if oval(0.014, 0.607, 0.008, 0.006) < 1.0 {
            tint(skin, 0.35) // nostril
        } else if side < 0.048 && (v - 0.692).abs() < 0.0035 {
            tint(skin, 0.40) // between the lips
        } else if oval(0.0, 0.692, 0.046, 0.021 - 0.012 * f32::from(u8::from(v < 0.692))) < 1.0 {
            blend(tint(skin, 0.85), [0.70, 0.30, 0.30], 0.55) // lips
        } else if beard && (jaw || moustache) {
            blend(ground, tint(hair, strands), 0.75)
        } else {
            let roots = ((hairline(side) + 0.02 - v) / 0.03).clamp(0.0, 1.0);
            blend(ground, darkest, 0.6 * roots)
        }
    });
}

/// Returns the v at which the hair begins, at a distance `side` in u from the middle of the face.
pub fn hairline(side: f32) -> f32 {
    let step = |from: f32, to: f32, t: f32| {
        let t = ((t - from) / (to - from)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    };
    0.30 + 0.24 * step(0.12, 0.20, side) + 0.18 * step(0.26, 0.36, side)
}

pub(super) fn hair_strands(canvas: &mut Canvas, color: Color, seed: u64) {
    canvas.shade(|x, y, _| {
        let lock = fractal(seed ^ 1, x * 0.12, y * 0.02, 3) - 0.5;
        tint(color, 1.0 + 0.8 * (fractal(seed, x * 0.6, y * 0.06, 3) - 0.5) + 0.7 * lock)
    });
}

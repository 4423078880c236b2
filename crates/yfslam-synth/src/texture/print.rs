//! Printed matter: posters, books, paper, boxes, screens, keyboards, whiteboards. Rectangles and letters of many sizes give corners
//! at every scale.

use super::Color;
use super::canvas::Canvas;
use super::font::WORDS;
use super::material::{blend, tint};
use super::noise::{cell, fractal};
use crate::rng::Rng;

const INKS: [Color; 9] = [
    [0.75, 0.16, 0.14],
    [0.13, 0.33, 0.62],
    [0.10, 0.48, 0.35],
    [0.90, 0.66, 0.15],
    [0.45, 0.22, 0.50],
    [0.15, 0.16, 0.20],
    [0.88, 0.42, 0.12],
    [0.20, 0.58, 0.70],
    [0.55, 0.10, 0.28],
];
pub(super) const WHITE: Color = [0.95, 0.95, 0.93];
pub(super) const BLACK: Color = [0.10, 0.10, 0.11];

/// Returns one of the printing colours.
pub fn ink(rng: &mut Rng) -> Color {
    let factor = rng.range(0.8, 1.15);
    tint(rng.pick(INKS), factor)
}

/// Writes a random word that fills the width; returns its height.
pub fn word(canvas: &mut Canvas, x: f32, y: f32, width: f32, color: Color, rng: &mut Rng) -> f32 {
    let text = rng.pick(WORDS);
    let cell = width / (text.len() as f32 * 4.0 - 1.0);
    canvas.text(x, y, cell, text, color);
    5.0 * cell
}

/// Writes lines of words like print, each `line` high.
pub(super) fn paragraph(canvas: &mut Canvas, area: [f32; 4], line: f32, color: Color, rng: &mut Rng) {
    let [x, y, w, h] = area;
    let rows = (h / line) as usize;
    for row in 0..rows {
        let stop = if row + 1 == rows || rng.chance(0.15) { rng.range(0.3, 0.8) * w } else { w };
        let mut left = 0.0;
        while left < stop {
            let length = (rng.range(1.0, 5.0) * line).min(stop - left);
            canvas.rect(x + left, y + row as f32 * line, length, line * 0.5, color);
            left += length + 0.5 * line;
        }
    }
}

/// Draws an illustration within an area: mosaic, landscape, chart, rings or a network.
pub(super) fn illustration(canvas: &mut Canvas, area: [f32; 4], rng: &mut Rng) {
    let [x, y, w, h] = area;
    let seed = rng.bits();
    let (a, b, c) = (ink(rng), ink(rng), ink(rng));
    match rng.below(5) {
        0 => {
            let size = w.min(h) / rng.range(5.0, 9.0);
            canvas.shade_within(x, y, w, h, |px, py, _| {
                let t = cell(seed, (px - x) / size, (py - y) / size);
                if t < 0.33 {
                    tint(a, 0.7 + t)
                } else if t < 0.66 {
                    tint(b, 0.4 + t)
                } else {
                    tint(c, t)
                }
            });
        }
        1 => canvas.shade_within(x, y, w, h, |px, py, _| {
            let height = (py - y) / h;
            let ridge = 0.35 + 0.35 * fractal(seed, (px - x) / w * 5.0, 0.0, 4);
            let texture = fractal(seed ^ 1, px / w * 24.0, py / h * 24.0, 4);
            if height < ridge { blend(WHITE, b, 1.0 - height) } else { tint(a, 0.4 + 1.1 * texture) }
        }),
        2 => {
            canvas.rect(x, y, w, h, WHITE);
            let bars = 5 + rng.below(6);
            let step = w * 0.9 / bars as f32;
            for bar in 0..bars {
                let height = rng.range(0.2, 0.9) * h;
                let color = if bar % 2 == 0 { a } else { b };
                canvas.rect(x + w * 0.07 + bar as f32 * step, y + h * 0.95 - height, step * 0.7, height, color);
            }
            canvas.rect(x, y + h * 0.95, w, h * 0.03, BLACK);
            canvas.rect(x + w * 0.03, y, w * 0.02, h, BLACK);
        }
        3 => {
            canvas.rect(x, y, w, h, tint(a, 0.5));
            for _ in 0..12 {
                let radius = rng.range(0.06, 0.22) * w.min(h);
                let at = [x + rng.range(radius, w - radius), y + rng.range(radius, h - radius)];
                canvas.disc(at[0], at[1], radius, ink(rng));
                canvas.disc(at[0], at[1], radius * 0.6, WHITE);
                canvas.disc(at[0], at[1], radius * 0.35, b);
            }
        }
        _ => {
            canvas.rect(x, y, w, h, WHITE);
            let nodes: Vec<[f32; 2]> =
                (0..12).map(|_| [x + rng.range(0.08, 0.92) * w, y + rng.range(0.08, 0.92) * h]).collect();
            let thin = w.min(h) * 0.018;
            for pair in nodes.windows(2) {
                canvas.line(pair[0], pair[1], thin, BLACK);
            }
            for node in &nodes {
                let half = 2.5 * thin;
                canvas.rect(node[0] - half, node[1] - half, 2.0 * half, 2.0 * half, ink(rng));
            }
        }
    }
}

pub(super) fn poster(canvas: &mut Canvas, rng: &mut Rng) {
    let (w, h) = (canvas.width() as f32, canvas.height() as f32);
    let (ground, head) = (if rng.chance(0.6) { WHITE } else { tint(ink(rng), 0.6) }, ink(rng));
    let text = if ground == WHITE { BLACK } else { WHITE };
    canvas.fill(ground);
    let top = 0.16 * h;
    canvas.rect(0.0, 0.0, w, top, head);
    let width = 0.9 * w;
    word(canvas, 0.05 * w, 0.03 * h, width.min(0.09 * h * 4.5), WHITE, rng);
    let columns = if w > h { 3 } else { 2 };
    let column = (w - 0.04 * w) / columns as f32;
    for c in 0..columns {
        let x = 0.04 * w + c as f32 * column;
        let inner = column - 0.04 * w;
        let mut y = top + 0.03 * h;
        let mut with_illustration = c % 2 == 0;
        while y < 0.9 * h {
            let height = rng.range(0.16, 0.30) * h;
            let height = height.min(0.97 * h - y);
            if with_illustration {
                illustration(canvas, [x, y, inner, height], rng);
            } else {
                canvas.rect(x, y, inner * 0.6, 0.018 * h, head);
                paragraph(canvas, [x, y + 0.03 * h, inner, height - 0.03 * h], 0.016 * h, text, rng);
            }
            with_illustration = !with_illustration;
            y += height + 0.03 * h;
        }
    }
    let border = 0.008 * w;
    for (x, y, bw, bh) in
        [(0.0, 0.0, w, border), (0.0, h - border, w, border), (0.0, 0.0, border, h), (w - border, 0.0, border, h)]
    {
        canvas.rect(x, y, bw, bh, BLACK);
    }
}

pub(super) fn paper(canvas: &mut Canvas, m: f32, rng: &mut Rng) {
    let (w, h) = (canvas.width() as f32, canvas.height() as f32);
    canvas.fill(WHITE);
    let margin = 0.1 * w;
    canvas.rect(margin, margin, 0.5 * w, 0.010 / m, BLACK);
    let line = 0.009 / m;
    paragraph(canvas, [margin, margin + 0.025 / m, w - 2.0 * margin, h * 0.45], line, tint(BLACK, 2.2), rng);
    illustration(canvas, [margin, 0.64 * h, w - 2.0 * margin, 0.27 * h], rng);
}

pub(super) fn cover(canvas: &mut Canvas, color: Color, rng: &mut Rng) {
    let (w, h) = (canvas.width() as f32, canvas.height() as f32);
    canvas.fill(color);
    word(canvas, 0.1 * w, 0.1 * h, 0.8 * w, WHITE, rng);
    word(canvas, 0.1 * w, 0.3 * h, 0.5 * w, tint(WHITE, 0.8), rng);
    illustration(canvas, [0.15 * w, 0.45 * h, 0.7 * w, 0.42 * h], rng);
}

pub(super) fn spine(canvas: &mut Canvas, color: Color, rng: &mut Rng) {
    let (w, h) = (canvas.width() as f32, canvas.height() as f32);
    canvas.fill(color);
    let accent = if rng.chance(0.5) { WHITE } else { ink(rng) };
    for _ in 0..1 + rng.below(3) {
        canvas.rect(0.0, rng.range(0.02, 0.98) * h, w, rng.range(0.01, 0.05) * h, accent);
    }
    let text = rng.pick(WORDS);
    let size = (w * 0.13).min(h * 0.7 / (4.0 * text.len() as f32));
    canvas.text_down(w * 0.5 + 2.5 * size, 0.12 * h, size, text, if rng.chance(0.7) { WHITE } else { BLACK });
    canvas.rect(0.2 * w, 0.88 * h, 0.6 * w, 0.05 * h, accent);
}

pub(super) fn cardboard(canvas: &mut Canvas, m: f32, seed: u64, rng: &mut Rng) {
    let (w, h) = (canvas.width() as f32, canvas.height() as f32);
    let brown = [0.66, 0.50, 0.34];
    let fields = [canvas.field(seed, [5.0 * m; 2], 4), canvas.field(seed ^ 1, [160.0 * m, 12.0 * m], 2)];
    canvas.shade_with(fields, |_, _, _, [cloud, flute]| tint(brown, 1.0 + 0.22 * (cloud - 0.5) + 0.10 * (flute - 0.5)));
    canvas.rect(0.46 * w, 0.0, 0.08 * w, h, [0.74, 0.62, 0.42]);
    let (x, y) = (rng.range(0.05, 0.3) * w, rng.range(0.1, 0.3) * h);
    canvas.rect(x, y, 0.36 * w, 0.36 * h, WHITE);
    word(canvas, x + 0.03 * w, y + 0.03 * h, 0.3 * w, BLACK, rng);
    let mut bar = x + 0.03 * w;
    while bar < x + 0.32 * w {
        let width = rng.range(0.004, 0.016) * w;
        canvas.rect(bar, y + 0.20 * h, width, 0.12 * h, BLACK);
        bar += width + rng.range(0.005, 0.014) * w;
    }
    word(canvas, 0.55 * w, 0.62 * h, 0.38 * w, [0.30, 0.18, 0.12], rng);
    canvas.rect(0.60 * w, 0.80 * h, 0.10 * w, 0.12 * h, [0.35, 0.18, 0.12]);
}

pub(super) fn screen(canvas: &mut Canvas, rng: &mut Rng) {
    let (w, h) = (canvas.width() as f32, canvas.height() as f32);
    let ground = tint(rng.pick([INKS[1], INKS[2], INKS[4]]), 0.7);
    let seed = rng.bits();
    let cloud = canvas.field(seed, [3.0 / w, 3.0 / h], 4);
    canvas.shade_with([cloud], |_, _, _, [cloud]| tint(ground, 0.7 + 0.6 * cloud));
    for window in 0..3 {
        let (ww, wh) = (rng.range(0.38, 0.52) * w, rng.range(0.45, 0.75) * h);
        let x = (0.03 + 0.27 * window as f32) * w;
        let y = rng.range(0.04, 0.9 - wh / h) * h;
        let dark = rng.chance(0.5);
        let (paper, text) = if dark { ([0.12, 0.13, 0.16], [0.75, 0.78, 0.7]) } else { (WHITE, BLACK) };
        canvas.rect(x, y, ww, wh, paper);
        canvas.rect(x, y, ww, 0.05 * h, tint(ink(rng), 0.8));
        let line = 0.025 * h;
        paragraph(canvas, [x + 0.02 * w, y + 0.08 * h, ww * 0.9, wh * 0.5], line, text, rng);
        illustration(canvas, [x + 0.02 * w, y + 0.1 * h + wh * 0.5, ww * 0.6, wh * 0.3], rng);
    }
    canvas.rect(0.0, 0.95 * h, w, 0.05 * h, [0.16, 0.17, 0.2]);
    for icon in 0..7 {
        canvas.rect((0.01 + 0.035 * icon as f32) * w, 0.96 * h, 0.02 * w, 0.03 * h, ink(rng));
    }
}

pub(super) fn keyboard(canvas: &mut Canvas, rng: &mut Rng) {
    let (w, h) = (canvas.width() as f32, canvas.height() as f32);
    canvas.fill([0.16, 0.16, 0.18]);
    let (columns, rows) = (17, 5);
    for row in 0..rows {
        for column in 0..columns {
            let (x, y) = ((0.02 + 0.0565 * column as f32) * w, (0.06 + 0.18 * row as f32) * h);
            let shade = rng.range(0.75, 0.92);
            canvas.rect(x, y, 0.046 * w, 0.14 * h, [shade; 3]);
            canvas.rect(x + 0.012 * w, y + 0.03 * h, 0.012 * w, 0.05 * h, BLACK);
        }
    }
}

pub(super) fn whiteboard(canvas: &mut Canvas, m: f32, rng: &mut Rng) {
    let (w, h) = (canvas.width() as f32, canvas.height() as f32);
    let seed = rng.bits();
    let smear = canvas.field(seed, [4.0 * m; 2], 3);
    canvas.shade_with([smear], |_, _, _, [smear]| tint(WHITE, 0.94 + 0.08 * (smear - 0.5)));
    let pens = [[0.10, 0.15, 0.45], [0.60, 0.12, 0.12], [0.08, 0.35, 0.18], BLACK];
    for row in 0..3 {
        for column in 0..4 {
            let (x, y) = ((0.04 + 0.24 * column as f32) * w, (0.06 + 0.31 * row as f32) * h);
            let pen = rng.pick(pens);
            let thin = 0.009 / m;
            match rng.below(4) {
                0 => {
                    word(canvas, x, y, 0.18 * w, pen, rng);
                    word(canvas, x, y + 0.12 * h, 0.12 * w, pen, rng);
                }
                1 => {
                    let corners = [[x, y], [x + 0.16 * w, y], [x + 0.16 * w, y + 0.2 * h], [x, y + 0.2 * h], [x, y]];
                    corners.windows(2).for_each(|pair| canvas.line(pair[0], pair[1], thin, pen));
                    canvas.line(corners[0], corners[2], thin, rng.pick(pens));
                    word(canvas, x + 0.02 * w, y + 0.02 * h, 0.09 * w, pen, rng);
                }
                2 => {
                    let mut from = [x, y + rng.range(0.0, 0.2) * h];
                    for step in 1..10 {
                        let to = [x + 0.019 * w * step as f32, y + rng.range(0.0, 0.22) * h];
                        canvas.line(from, to, thin, pen);
                        from = to;
                    }
                    canvas.line([x, y], [x, y + 0.24 * h], thin, BLACK);
                    canvas.line([x, y + 0.24 * h], [x + 0.19 * w, y + 0.24 * h], thin, BLACK);
                }
                _ => {
                    for line in 0..4 {
                        let text = rng.pick(WORDS);
                        canvas.text(x, y + 0.06 * h * line as f32, 0.009 * h, text, pen);
                    }
                }
            }
        }
    }
}

pub(super) fn outdoors(canvas: &mut Canvas, seed: u64, rng: &mut Rng) {
    let (w, h) = (canvas.width() as f32, canvas.height() as f32);
    canvas.shade(|x, y, _| {
        let (s, t) = (x / w, y / h);
        let cloud = fractal(seed, s * 4.0, t * 7.0, 5);
        let tree = 0.62 + 0.16 * (fractal(seed ^ 1, s * 9.0, 0.0, 4) - 0.5);
        if t < tree {
            blend([0.62, 0.78, 0.95], [1.0; 3], (cloud * 1.6 - 0.3).clamp(0.0, 1.0))
        } else {
            tint([0.30, 0.42, 0.20], 0.5 + 1.1 * fractal(seed ^ 2, s * 40.0, t * 30.0, 4))
        }
    });
    let house = [rng.range(0.1, 0.5) * w, 0.38 * h, 0.30 * w, 0.4 * h];
    canvas.rect(house[0], house[1], house[2], house[3], [0.78, 0.70, 0.60]);
    for row in 0..4 {
        for column in 0..5 {
            let (x, y) = (house[0] + (0.02 + 0.055 * column as f32) * w, house[1] + (0.03 + 0.09 * row as f32) * h);
            canvas.rect(x, y, 0.03 * w, 0.05 * h, [0.32, 0.38, 0.45]);
        }
    }
}

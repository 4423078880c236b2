//! What surfaces are made of: each material paints its own, never repeating texture.
//!
//! In: a material, the surface's size and a seed. Out: a painted [`Canvas`]. Lengths inside are metres turned into
//! texels, so that grain and print have their natural size.

use super::canvas::Canvas;
use super::noise::{cell, fractal};
use super::{Color, person, print};
use crate::rng::Rng;

/// Patterns of clothes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pattern {
    /// Horizontal stripes.
    Stripes,
    /// Crossing bands.
    Checks,
    /// Small squares in rows.
    Motifs,
    /// A word and a sign on chest and back.
    Print,
    /// An open jacket over a shirt of the second colour, with zip, collar and pockets.
    Jacket,
    /// A shirt with fine checks, a button placket and a breast pocket.
    Buttons,
}

/// A kind of surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Material {
    /// Speckled linoleum or carpet with worn patches.
    Floor(Color),
    /// Painted wall: roller marks, scuffs and small holes.
    Plaster(Color),
    /// Wood grain along the longer side.
    Wood(Color),
    /// Lacquered metal or plastic with scratches.
    Plain(Color),
    /// Acoustic ceiling tiles.
    Ceiling,
    /// A printed poster: title, pictures, diagrams, text.
    Poster,
    /// A sheet of printed paper.
    Paper,
    /// The front of a book.
    Cover(Color),
    /// The spine of a book.
    Spine(Color),
    /// Cut pages of a book.
    Pages,
    /// A cardboard box with label and tape.
    Cardboard,
    /// A computer screen with windows full of text and plots.
    Screen,
    /// A keyboard.
    Keyboard,
    /// A whiteboard with drawings.
    Whiteboard,
    /// A view out of a window.
    Outdoors,
    /// Woven cloth, plain.
    Cloth(Color),
    /// Plain clothes with creases.
    Garment(Color),
    /// Clothes of two colours with a pattern.
    Shirt(Color, Color, Pattern),
    /// Skin.
    Skin(Color),
    /// A face and the hair around it; with a beard or without.
    Head(Color, Color, bool),
    /// Hair.
    Hair(Color),
    /// Leaves of a plant.
    Leaves,
}

impl Material {
    /// Density of texels that the material needs, relative to printed matter.
    pub fn detail(&self) -> f32 {
        match self {
            Self::Plain(_) | Self::Pages | Self::Hair(_) | Self::Skin(_) => 0.4,
            Self::Cloth(_) | Self::Garment(_) | Self::Leaves => 0.7,
            _ => 1.0,
        }
    }

    /// Paints a surface of `size_m` metres with about `density` texels per metre.
    pub fn paint(&self, size_m: [f32; 2], density: f32, seed: u64) -> Canvas {
        let texels = |metres: f32| ((metres * density).round() as usize).clamp(4, 4096);
        let mut canvas = Canvas::new(texels(size_m[0]), texels(size_m[1]));
        let mut rng = Rng::new(seed, 0x7e);
        // Metres per texel, after rounding.
        let m = size_m[0] / canvas.width() as f32;
        match *self {
            Self::Floor(color) => floor(&mut canvas, color, m, seed),
            Self::Plaster(color) => plaster(&mut canvas, color, m, seed, &mut rng),
            Self::Wood(color) => wood(&mut canvas, color, m, seed),
            Self::Plain(color) => plain(&mut canvas, color, m, seed, &mut rng),
            Self::Ceiling => ceiling(&mut canvas, m, seed),
            Self::Poster => print::poster(&mut canvas, &mut rng),
            Self::Paper => print::paper(&mut canvas, m, &mut rng),
            Self::Cover(color) => print::cover(&mut canvas, color, &mut rng),
            Self::Spine(color) => print::spine(&mut canvas, color, &mut rng),
            Self::Pages => pages(&mut canvas, seed),
            Self::Cardboard => print::cardboard(&mut canvas, m, seed, &mut rng),
            Self::Screen => print::screen(&mut canvas, &mut rng),
            Self::Keyboard => print::keyboard(&mut canvas, &mut rng),
            Self::Whiteboard => print::whiteboard(&mut canvas, m, &mut rng),
            Self::Outdoors => print::outdoors(&mut canvas, seed, &mut rng),
            Self::Cloth(color) => cloth(&mut canvas, color, m, seed),
            Self::Garment(color) => person::garment(&mut canvas, color, m, seed),
            Self::Shirt(base, accent, pattern) => person::shirt(&mut canvas, [base, accent], pattern, m, seed),
            Self::Skin(color) => person::skin(&mut canvas, color, m, seed),
            Self::Head(skin, hair, beard) => person::head(&mut canvas, skin, hair, beard, seed),
            Self::Hair(color) => person::hair_strands(&mut canvas, color, seed),
            Self::Leaves => leaves(&mut canvas, m, seed),
        }
        canvas
    }
}

/// `color` scaled by `factor`.
pub fn tint(color: Color, factor: f32) -> Color {
    color.map(|c| c * factor)
}

/// Blend from `a` to `b`.
pub fn blend(a: Color, b: Color, t: f32) -> Color {
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t)
}

fn floor(canvas: &mut Canvas, color: Color, m: f32, seed: u64) {
    canvas.shade(|x, y, _| {
        let (x, y) = (x * m, y * m);
        let worn = fractal(seed, x * 1.3, y * 1.3, 4) - 0.5;
        let marble = fractal(seed ^ 1, x * 9.0 + 2.0 * worn, y * 9.0, 4) - 0.5;
        // Coloured chips of 8 to 16 mm, a fifth of the cells.
        let chip = cell(seed ^ 2, x * 90.0 + marble * 3.0, y * 90.0 + worn * 3.0);
        let chip = if chip > 0.93 {
            0.22
        } else if chip < 0.09 {
            -0.22
        } else {
            0.0
        };
        tint(color, 1.0 + 0.20 * worn + 0.26 * marble + chip)
    });
}

fn plaster(canvas: &mut Canvas, color: Color, m: f32, seed: u64, rng: &mut Rng) {
    canvas.shade(|x, y, _| {
        let (x, y) = (x * m, y * m);
        let roller = fractal(seed, x * 2.0, y * 0.7, 3) - 0.5;
        let grain = fractal(seed ^ 1, x * 35.0, y * 35.0, 3) - 0.5;
        tint(color, 1.0 + 0.05 * roller + 0.05 * grain)
    });
    let area = canvas.width() as f32 * canvas.height() as f32 * m * m;
    for _ in 0..(area * 3.0) as usize {
        let at = [rng.range(0.0, canvas.width() as f32), rng.range(0.0, canvas.height() as f32)];
        let dark = tint(color, rng.range(0.45, 0.85));
        if rng.chance(0.5) {
            canvas.disc(at[0], at[1], rng.range(0.004, 0.010) / m, dark);
        } else {
            let to = [at[0] + rng.range(-0.12, 0.12) / m, at[1] + rng.range(-0.03, 0.03) / m];
            canvas.line(at, to, rng.range(0.002, 0.005) / m, dark);
        }
    }
}

fn wood(canvas: &mut Canvas, color: Color, m: f32, seed: u64) {
    let along_x = canvas.width() >= canvas.height();
    canvas.shade(|x, y, _| {
        let (s, t) = if along_x { (x * m, y * m) } else { (y * m, x * m) };
        let bend = fractal(seed, s * 1.1, t * 3.0, 3);
        let rings = ((t * 38.0 + bend * 9.0) * std::f32::consts::TAU * 0.5).sin();
        let fibre = fractal(seed ^ 1, s * 14.0, t * 260.0, 2) - 0.5;
        let pore = if cell(seed ^ 2, s * 60.0, t * 500.0) > 0.97 { -0.25 } else { 0.0 };
        tint(color, 0.95 + 0.07 * rings + 0.18 * fibre + 0.2 * (bend - 0.5) + pore)
    });
}

fn plain(canvas: &mut Canvas, color: Color, m: f32, seed: u64, rng: &mut Rng) {
    canvas.shade(|x, y, _| {
        let cloud = fractal(seed, x * m * 6.0, y * m * 6.0, 3) - 0.5;
        let grain = cell(seed ^ 1, x * m * 300.0, y * m * 300.0) - 0.5;
        tint(color, 1.0 + 0.12 * cloud + 0.04 * grain)
    });
    let area = canvas.width() as f32 * canvas.height() as f32 * m * m;
    for _ in 0..(area * 12.0) as usize {
        let at = [rng.range(0.0, canvas.width() as f32), rng.range(0.0, canvas.height() as f32)];
        let to = [at[0] + rng.range(-0.05, 0.05) / m, at[1] + rng.range(-0.05, 0.05) / m];
        canvas.line(at, to, 0.0025 / m, tint(color, rng.range(0.6, 1.4)));
    }
}

fn ceiling(canvas: &mut Canvas, m: f32, seed: u64) {
    canvas.shade(|x, y, _| {
        let (x, y) = (x * m, y * m);
        let hole = cell(seed, x * 70.0, y * 70.0) > 0.90;
        let stain = fractal(seed ^ 1, x * 1.5, y * 1.5, 3) - 0.5;
        // Tiles of 0.6 m with a dark joint of 1 cm.
        let joint = (x / 0.6).fract() * 0.6 < 0.01 || (y / 0.6).fract() * 0.6 < 0.01;
        let level = if joint {
            0.55
        } else if hole {
            0.72
        } else {
            0.90
        };
        tint([1.0, 0.99, 0.96], level + 0.08 * stain)
    });
}

fn pages(canvas: &mut Canvas, seed: u64) {
    canvas.shade(|x, y, _| {
        let sheet = cell(seed, 0.0, y / 2.0) - 0.5;
        tint([0.93, 0.90, 0.80], 0.92 + 0.14 * sheet + 0.05 * (cell(seed, x / 9.0, y) - 0.5))
    });
}

fn cloth(canvas: &mut Canvas, color: Color, m: f32, seed: u64) {
    canvas.shade(|x, y, _| {
        let weave = cell(seed, x * m * 350.0, y * m * 350.0) - 0.5;
        let fold = fractal(seed ^ 1, x * m * 7.0, y * m * 4.0, 4) - 0.5;
        tint(color, 1.0 + 0.16 * weave + 0.45 * fold)
    });
}

fn leaves(canvas: &mut Canvas, m: f32, seed: u64) {
    canvas.shade(|x, y, _| {
        let leaf = cell(seed, x * m * 25.0 + fractal(seed ^ 3, x * m * 9.0, y * m * 9.0, 2) * 3.0, y * m * 18.0);
        let shade = fractal(seed ^ 1, x * m * 30.0, y * m * 30.0, 3);
        tint([0.30, 0.52, 0.22], 0.45 + 0.7 * leaf + 0.3 * (shade - 0.5))
    });
}

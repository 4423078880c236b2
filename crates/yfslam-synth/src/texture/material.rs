//! Materials of surfaces: each paints its own texture, which never repeats.
//!
//! In: a material, the size of the surface and a seed. Out: a painted [`Canvas`]. Lengths are converted from metres to texels, so
//! that grain and print have their natural size.

use super::canvas::Canvas;
use super::noise::cell;
use super::{Color, building, person, print};
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
    /// A printed poster: title, illustrations, diagrams, text.
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
    /// A face and the hair around it, with or without a beard.
    Head(Color, Color, bool),
    /// Hair.
    Hair(Color),
    /// Leaves of a plant.
    Leaves,
    /// Raw concrete: stains, formwork joints, tie holes and cracks.
    Concrete(Color),
    /// A white wall with hardly any texture.
    Paint(Color),
    /// A sheet of vinyl floor with welded seams along its border.
    Vinyl(Color),
    /// A door leaf in its frame, with a handle and a plate.
    Door(Color),
    /// A small printed sign on coloured ground.
    Sign(Color),
    /// Black and yellow warning stripes, worn.
    Hazard,
    /// A cork board with papers.
    NoticeBoard,
    /// The ribs of a radiator or grille.
    Ribs(Color),
    /// The planks of a crate.
    Planks(Color),
    /// Rusty lacquer.
    Rusty(Color),
    /// A double power socket.
    Socket,
}

impl Material {
    /// Returns the density of texels that the material needs, relative to printed matter.
    pub fn detail(&self) -> f32 {
        match self {
            Self::Plain(_) | Self::Pages | Self::Hair(_) | Self::Skin(_) => 0.4,
            Self::Cloth(_) | Self::Garment(_) | Self::Leaves | Self::Paint(_) => 0.7,
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
            Self::Concrete(color) => building::concrete(&mut canvas, color, m, seed, &mut rng),
            Self::Paint(color) => building::paint(&mut canvas, color, m, seed, &mut rng),
            Self::Vinyl(color) => building::vinyl(&mut canvas, color, m, seed),
            Self::Door(color) => building::door(&mut canvas, color, m, seed, &mut rng),
            Self::Sign(color) => building::sign(&mut canvas, color, &mut rng),
            Self::Hazard => building::hazard(&mut canvas, m, seed),
            Self::NoticeBoard => building::notice_board(&mut canvas, m, seed, &mut rng),
            Self::Ribs(color) => building::ribs(&mut canvas, color, m, seed),
            Self::Planks(color) => building::planks(&mut canvas, color, m, seed, &mut rng),
            Self::Rusty(color) => building::rusty(&mut canvas, color, m, seed),
            Self::Socket => building::socket(&mut canvas),
        }
        canvas
    }
}

/// Returns `color` scaled by `factor`.
pub fn tint(color: Color, factor: f32) -> Color {
    color.map(|c| c * factor)
}

/// Blends from `a` to `b`.
pub fn blend(a: Color, b: Color, t: f32) -> Color {
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t)
}

fn floor(canvas: &mut Canvas, color: Color, m: f32, seed: u64) {
    let fields = [canvas.field(seed, [1.3 * m; 2], 4), canvas.field(seed ^ 1, [9.0 * m; 2], 4)];
    canvas.shade_with(fields, |x, y, _, [worn, marble]| {
        let (x, y, worn, marble) = (x * m, y * m, worn - 0.5, marble - 0.5);
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
    let fields = [canvas.field(seed, [2.0 * m, 0.7 * m], 3), canvas.field(seed ^ 1, [35.0 * m; 2], 3)];
    canvas
        .shade_with(fields, |_, _, _, [roller, grain]| tint(color, 1.0 + 0.05 * (roller - 0.5) + 0.05 * (grain - 0.5)));
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
    let step = |s: f32, t: f32| if along_x { [s * m, t * m] } else { [t * m, s * m] };
    let fields = [canvas.field(seed, step(1.1, 3.0), 3), canvas.field(seed ^ 1, step(14.0, 260.0), 2)];
    canvas.shade_with(fields, |x, y, _, [bend, fibre]| {
        let (s, t) = if along_x { (x * m, y * m) } else { (y * m, x * m) };
        let rings = libm::sinf((t * 38.0 + bend * 9.0) * std::f32::consts::TAU * 0.5);
        let fibre = fibre - 0.5;
        let pore = if cell(seed ^ 2, s * 60.0, t * 500.0) > 0.97 { -0.25 } else { 0.0 };
        tint(color, 0.95 + 0.07 * rings + 0.18 * fibre + 0.2 * (bend - 0.5) + pore)
    });
}

fn plain(canvas: &mut Canvas, color: Color, m: f32, seed: u64, rng: &mut Rng) {
    canvas.shade_with([canvas.field(seed, [6.0 * m; 2], 3)], |x, y, _, [cloud]| {
        let grain = cell(seed ^ 1, x * m * 300.0, y * m * 300.0) - 0.5;
        tint(color, 1.0 + 0.12 * (cloud - 0.5) + 0.04 * grain)
    });
    let area = canvas.width() as f32 * canvas.height() as f32 * m * m;
    for _ in 0..(area * 12.0) as usize {
        let at = [rng.range(0.0, canvas.width() as f32), rng.range(0.0, canvas.height() as f32)];
        let to = [at[0] + rng.range(-0.05, 0.05) / m, at[1] + rng.range(-0.05, 0.05) / m];
        canvas.line(at, to, 0.0025 / m, tint(color, rng.range(0.6, 1.4)));
    }
}

fn ceiling(canvas: &mut Canvas, m: f32, seed: u64) {
    canvas.shade_with([canvas.field(seed ^ 1, [1.5 * m; 2], 3)], |x, y, _, [stain]| {
        let (x, y, stain) = (x * m, y * m, stain - 0.5);
        let hole = cell(seed, x * 70.0, y * 70.0) > 0.90;
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
    canvas.shade_with([canvas.field(seed ^ 1, [7.0 * m, 4.0 * m], 4)], |x, y, _, [fold]| {
        let weave = cell(seed, x * m * 350.0, y * m * 350.0) - 0.5;
        tint(color, 1.0 + 0.16 * weave + 0.45 * (fold - 0.5))
    });
}

fn leaves(canvas: &mut Canvas, m: f32, seed: u64) {
    let fields = [canvas.field(seed ^ 3, [9.0 * m; 2], 2), canvas.field(seed ^ 1, [30.0 * m; 2], 3)];
    canvas.shade_with(fields, |x, y, _, [bend, shade]| {
        let leaf = cell(seed, x * m * 25.0 + bend * 3.0, y * m * 18.0);
        tint([0.30, 0.52, 0.22], 0.45 + 0.7 * leaf + 0.3 * (shade - 0.5))
    });
}

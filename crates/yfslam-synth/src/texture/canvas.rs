//! A canvas for painting textures: filled shapes and text in pixels, every colour in gamma-2 space.

use super::noise::Field;
use super::{Color, font};

/// Colour image of f32 channels, row-major, top row first.
#[derive(Clone, Debug)]
pub struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<Color>,
}

impl Canvas {
    /// Creates a black canvas of at least one pixel.
    pub fn new(width: usize, height: usize) -> Self {
        let (width, height) = (width.max(1), height.max(1));
        Self { width, height, pixels: vec![[0.0; 3]; width * height] }
    }

    /// Returns the number of pixels per row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Returns the number of rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Returns all pixels.
    pub fn pixels(&self) -> &[Color] {
        &self.pixels
    }

    /// Fills the canvas with one colour.
    pub fn fill(&mut self, color: Color) {
        self.pixels.fill(color);
    }

    /// Replaces every pixel by `shade(x, y, old)`, x and y in pixels; the result is clamped to [0, 1].
    pub fn shade(&mut self, shade: impl Fn(f32, f32, Color) -> Color) {
        self.shade_within(0.0, 0.0, self.width as f32, self.height as f32, shade);
    }

    /// Returns fractal noise for this canvas; pixels are `step` cells wide and high.
    pub fn field(&self, seed: u64, step: [f32; 2], octaves: u32) -> Field {
        Field::new(seed, self.width, step, octaves)
    }

    /// Applies [`Canvas::shade`] with the values of noise fields at the pixel: `shade(x, y, old, values)`.
    pub fn shade_with<const N: usize>(
        &mut self,
        mut fields: [Field; N],
        shade: impl Fn(f32, f32, Color, [f32; N]) -> Color,
    ) {
        for (y, row) in self.pixels.chunks_mut(self.width).enumerate() {
            let values = fields.each_mut().map(|field| field.row(y));
            for (x, pixel) in row.iter_mut().enumerate() {
                let here = std::array::from_fn(|k| values[k][x]);
                *pixel = shade(x as f32 + 0.5, y as f32 + 0.5, *pixel, here).map(|c| c.clamp(0.0, 1.0));
            }
        }
    }

    /// Applies [`Canvas::shade`] to the pixels whose centres lie in the rectangle.
    pub fn shade_within(&mut self, x: f32, y: f32, w: f32, h: f32, shade: impl Fn(f32, f32, Color) -> Color) {
        let clip = |from: f32, to: f32, size: usize| {
            ((from - 0.5).ceil().max(0.0) as usize, ((to - 0.5).ceil().max(0.0) as usize).min(size))
        };
        let (x0, x1) = clip(x, x + w, self.width);
        let (y0, y1) = clip(y, y + h, self.height);
        for row in y0..y1 {
            for column in x0..x1 {
                let pixel = &mut self.pixels[row * self.width + column];
                *pixel = shade(column as f32 + 0.5, row as f32 + 0.5, *pixel).map(|c| c.clamp(0.0, 1.0));
            }
        }
    }

    /// Fills a rectangle.
    pub fn rect(&mut self, x: f32, y: f32, w: f32, h: f32, color: Color) {
        self.shade_within(x, y, w, h, |_, _, _| color);
    }

    /// Fills a disc.
    pub fn disc(&mut self, cx: f32, cy: f32, radius: f32, color: Color) {
        let inside = |x: f32, y: f32| (x - cx).powi(2) + (y - cy).powi(2) < radius * radius;
        self.shade_within(
            cx - radius,
            cy - radius,
            2.0 * radius,
            2.0 * radius,
            |x, y, old| {
                if inside(x, y) { color } else { old }
            },
        );
    }

    /// Draws a line of the given thickness.
    pub fn line(&mut self, from: [f32; 2], to: [f32; 2], thickness: f32, color: Color) {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let length2 = (dx * dx + dy * dy).max(1e-6);
        let half = thickness / 2.0;
        let (x, y) = (from[0].min(to[0]) - half, from[1].min(to[1]) - half);
        self.shade_within(x, y, dx.abs() + thickness, dy.abs() + thickness, |px, py, old| {
            let t = (((px - from[0]) * dx + (py - from[1]) * dy) / length2).clamp(0.0, 1.0);
            let (ex, ey) = (px - from[0] - t * dx, py - from[1] - t * dy);
            if ex * ex + ey * ey < half * half { color } else { old }
        });
    }

    /// Writes `text` with its top left at (x, y); a character is `cell * 4` wide and `cell * 5` high.
    pub fn text(&mut self, x: f32, y: f32, cell: f32, text: &str, color: Color) {
        for (index, letter) in text.chars().enumerate() {
            let left = x + index as f32 * cell * 4.0;
            for (row, column) in (0..5).flat_map(|row| (0..3).map(move |column| (row, column))) {
                if font::inked(letter, column, row) {
                    self.rect(left + column as f32 * cell, y + row as f32 * cell, cell, cell, color);
                }
            }
        }
    }

    /// Writes `text` downward, turned by a quarter to the right as on the spine of a book; (x, y) is the top right.
    pub fn text_down(&mut self, x: f32, y: f32, cell: f32, text: &str, color: Color) {
        for (index, letter) in text.chars().enumerate() {
            let top = y + index as f32 * cell * 4.0;
            for (row, column) in (0..5).flat_map(|row| (0..3).map(move |column| (row, column))) {
                if font::inked(letter, column, row) {
                    self.rect(x - (row + 1) as f32 * cell, top + column as f32 * cell, cell, cell, color);
                }
            }
        }
    }
}

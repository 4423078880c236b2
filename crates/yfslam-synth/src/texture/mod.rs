//! Textures: painted once, then read with trilinear filtering.
//!
//! In: painted canvases. Out: mip chains and filtered colours. Colours are stored and filtered in "gamma 2" space: the stored value
//! is the square root of linear light, close to sRGB, so that eight bits suffice and decoding is a square.

mod building;
pub mod canvas;
pub mod font;
pub mod material;
pub mod noise;
mod person;
pub mod print;

use canvas::Canvas;
pub use person::hairline;

/// Gamma-2 colour: the square root of linear light, each channel in [0, 1].
pub type Color = [f32; 3];

#[derive(Clone, Debug)]
struct Level {
    width: i32,
    height: i32,
    /// Width and height once more, as floats.
    size: [f32; 2],
    texels: Vec<[u8; 4]>,
}

/// An image with its mip chain, each level half the size of the one before.
#[derive(Clone, Debug)]
pub struct Texture {
    levels: Vec<Level>,
    /// Number of the coarsest level.
    coarsest: f32,
}

impl Texture {
    /// Quantises the canvas and builds the mip chain by averaging linear light over 2 × 2 texels.
    pub fn new(canvas: &Canvas) -> Self {
        let (mut width, mut height) = (canvas.width(), canvas.height());
        let mut linear: Vec<Color> = canvas.pixels().iter().map(|c| c.map(|x| x * x)).collect();
        let mut levels = vec![quantise(width, height, &linear)];
        while width > 1 || height > 1 {
            let (w, h) = ((width / 2).max(1), (height / 2).max(1));
            let at = |x: usize, y: usize| linear[y.min(height - 1) * width + x.min(width - 1)];
            let halved = (0..w * h)
                .map(|i| {
                    let (x, y) = (2 * (i % w), 2 * (i / w));
                    let four = [at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)];
                    std::array::from_fn(|k| four.iter().map(|c| c[k]).sum::<f32>() / 4.0)
                })
                .collect();
            (width, height, linear) = (w, h, halved);
            levels.push(quantise(width, height, &linear));
        }
        Self { coarsest: (levels.len() - 1) as f32, levels }
    }

    /// Returns the size of the finest level, texels.
    pub fn size(&self) -> [f32; 2] {
        self.levels[0].size
    }

    /// Returns the mean of linear light over the whole texture and its channels.
    pub fn mean(&self) -> f32 {
        let [r, g, b, _] = self.sample(0.5, 0.5, self.coarsest);
        (r * r + g * g + b * b) / 3.0
    }

    /// Returns the gamma-2 colour at (u, v), clamped to [0, 1]²; `lod` is the mip level, 0 the finest, and fractions blend two
    /// levels. The fourth channel is unused: four lanes fill a vector register.
    #[inline]
    pub fn sample(&self, u: f32, v: f32, lod: f32) -> [f32; 4] {
        // `max` and `min` compile to single instructions, `clamp` and casts to unsigned do not.
        let lod = lod.max(0.0).min(self.coarsest);
        let fine = lod as i32 as usize;
        let blend = lod - fine as f32;
        let a = self.levels[fine].bilinear(u, v);
        // Magnified surfaces, the most frequent case, need one level only.
        if blend < 1.0 / 64.0 {
            return a;
        }
        lerp(&a, &self.levels[(fine + 1).min(self.levels.len() - 1)].bilinear(u, v), blend)
    }
}

#[inline(always)]
fn lerp(a: &[f32; 4], b: &[f32; 4], t: f32) -> [f32; 4] {
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t)
}

impl Level {
    #[inline(always)]
    fn bilinear(&self, u: f32, v: f32) -> [f32; 4] {
        let x = (u * self.size[0] - 0.5).max(0.0).min(self.size[0] - 1.0);
        let y = (v * self.size[1] - 0.5).max(0.0).min(self.size[1] - 1.0);
        let (x0, y0) = (x as i32, y as i32);
        let (right, below) = (i32::from(x0 + 1 < self.width), i32::from(y0 + 1 < self.height) * self.width);
        let (fx, fy) = (x - x0 as f32, y - y0 as f32);
        let index = y0 * self.width + x0;
        let texel = |offset: i32| self.texels[(index + offset) as usize].map(|c| f32::from(c) * (1.0 / 255.0));
        let top = lerp(&texel(0), &texel(right), fx);
        let bottom = lerp(&texel(below), &texel(below + right), fx);
        lerp(&top, &bottom, fy)
    }
}

fn quantise(width: usize, height: usize, linear: &[Color]) -> Level {
    let byte = |x: f32| (x.max(0.0).sqrt() * 255.0 + 0.5) as u8;
    let texels = linear.iter().map(|c| [byte(c[0]), byte(c[1]), byte(c[2]), 255]).collect();
    Level { width: width as i32, height: height as i32, size: [width as f32, height as f32], texels }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_canvas_has_its_colour_at_every_level_and_place() {
        let mut canvas = Canvas::new(37, 20);
        canvas.fill([0.2, 0.4, 0.8]);
        let texture = Texture::new(&canvas);
        for lod in [0.0, 0.5, 2.7, 99.0] {
            for (u, v) in [(0.0, 0.0), (0.31, 0.77), (1.0, 1.0)] {
                let color = texture.sample(u, v, lod);
                for (got, want) in color.iter().zip([0.2, 0.4, 0.8]) {
                    assert!((got - want).abs() < 1.0 / 255.0, "{color:?}");
                }
            }
        }
    }

    #[test]
    fn the_coarsest_level_is_the_mean_of_linear_light() {
        let mut canvas = Canvas::new(64, 64);
        canvas.rect(0.0, 0.0, 32.0, 64.0, [1.0; 3]);
        let mean = Texture::new(&canvas).sample(0.5, 0.5, 99.0);
        assert!((mean[0] * mean[0] - 0.5).abs() < 0.01, "{mean:?}");
    }
}

//! Colour images of the camera: gamma, noise, eight bits.
//!
//! In: linear RGB. Out: an [`RgbImage`].

use rayon::prelude::*;
use yfslam::RgbImage;

use crate::rng::{hash, normals4};

/// Develops linear RGB: exposure, a soft shoulder at white, gamma 2, noise of `sigma` grey levels.
pub fn develop(linear: &[[f32; 3]], width: usize, height: usize, exposure: f32, sigma: f32, seed: u64) -> RgbImage {
    let mut image = RgbImage::new(width, height);
    image.data_mut().par_chunks_mut(width).zip(linear.par_chunks(width)).enumerate().for_each(|(row, (out, line))| {
        for (column, (pixel, rgb)) in out.iter_mut().zip(line).enumerate() {
            let noise = match sigma > 0.0 {
                true => normals4(hash(seed, (row * width + column) as u64)),
                false => [0.0; 4],
            };
            *pixel = std::array::from_fn(|k| level(rgb[k] * exposure, sigma * noise[k]));
        }
    });
    image
}

/// Returns the grey level of a linear value plus noise.
fn level(linear: f32, noise: f32) -> u8 {
    // Linear up to 0.7, then towards 1 with continuous slope, as in film and cameras.
    const KNEE: f32 = 0.7;
    let x = linear.max(0.0);
    let x = if x > KNEE { 1.0 - (1.0 - KNEE) * (1.0 - KNEE) / (x - KNEE + 1.0 - KNEE) } else { x };
    (x.sqrt() * 255.0 + noise + 0.5).clamp(0.0, 255.0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grey_card_comes_out_grey_with_the_stated_noise() {
        let card = vec![[0.25; 3]; 128 * 128];
        let clean = develop(&card, 128, 128, 1.0, 0.0, 1);
        assert!(clean.data().iter().all(|p| *p == [128; 3]), "{:?}", clean.data()[0]);
        let noisy = develop(&card, 128, 128, 1.0, 4.0, 1);
        let values: Vec<f64> = noisy.data().iter().flatten().map(|&v| f64::from(v) - 127.5).collect();
        let sigma = (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
        assert!((sigma - 4.0).abs() < 0.1, "{sigma}");
    }
}

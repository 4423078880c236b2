//! Depth as a structured-light sensor measures it: noise, disparity steps, shadow of the projector, range.
//!
//! In: exact depth in metres. Out: a [`DepthImage`] in sensor units, 0 where nothing was measured. Sources of the figures
//! are in [`SensorConfig`].

use rayon::prelude::*;
use yfslam::Camera;
use yfslam::image::{DepthImage, Image};

use crate::config::SensorConfig;
use crate::rng::{hash, normals4};

/// Measures a picture of exact depth.
pub fn measure(exact: &[f32], camera: &Camera, sensor: &SensorConfig, seed: u64) -> DepthImage {
    let (width, bf) = (camera.width, camera.bf as f32);
    let mut raw = Image::<u16>::new(width, camera.height);
    raw.data_mut().par_chunks_mut(width).zip(exact.par_chunks(width)).enumerate().for_each(|(row, (out, line))| {
        let lit = sensor.holes.then(|| lit_by_projector(line, bf));
        for (column, (unit, &z)) in out.iter_mut().zip(line).enumerate() {
            if lit.as_ref().is_some_and(|lit| !lit[column]) || z <= 0.0 {
                continue;
            }
            let bits = hash(seed, (row * width + column) as u64);
            let measured = disturb(z, bf, sensor, normals4(bits)[0]);
            if (sensor.min_depth_m..=sensor.max_depth_m).contains(&measured) {
                // Depth beyond the sixteen bits is no depth.
                // Rounds half up; `round` is a library call on older processors.
                let value = f64::from(measured) * camera.depth_factor + 0.5;
                *unit = if value < 65_536.0 { value as u16 } else { 0 };
            }
        }
    });
    DepthImage { raw, metres_per_unit: (1.0 / camera.depth_factor) as f32 }
}

fn disturb(z: f32, bf: f32, sensor: &SensorConfig, normal: f32) -> f32 {
    let sigma = sensor.depth_noise_m + sensor.depth_noise_growth * (z - 0.4).max(0.0).powi(2);
    let noisy = (z + sigma * normal).max(1e-3);
    if sensor.disparity_step_px > 0.0 && bf > 0.0 {
        let steps = ((bf / noisy / sensor.disparity_step_px + 0.5) as u32).max(1) as f32;
        bf / (steps * sensor.disparity_step_px)
    } else {
        noisy
    }
}

/// Which pixels of a row the projector reaches. It stands to the right of the camera by the baseline: a point at column
/// x and depth z lies at x − bf/z in its view, and is hidden if a pixel farther right lies at or left of that.
fn lit_by_projector(line: &[f32], bf: f32) -> Vec<bool> {
    // A surface's own slope must not hide it: a hidden point is hidden by at least this many pixels.
    const MARGIN_PX: f32 = 1.0;
    let mut lit = vec![true; line.len()];
    let mut leftmost = f32::INFINITY;
    for (column, &z) in line.iter().enumerate().rev() {
        if z > 0.0 {
            let seen_at = column as f32 - bf / z;
            lit[column] = seen_at < leftmost + MARGIN_PX;
            leftmost = leftmost.min(seen_at);
        }
    }
    lit
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::default_camera;

    fn camera() -> Camera {
        Camera { width: 200, height: 100, ..default_camera() }
    }

    #[test]
    fn the_perfect_sensor_only_rounds_to_the_unit() {
        let exact: Vec<f32> = (0..20_000).map(|i| 0.3 + i as f32 * 4e-4).collect();
        let image = measure(&exact, &camera(), &SensorConfig::perfect(), 1);
        for (i, &z) in exact.iter().enumerate() {
            let got = image.metres(i % 200, i / 200).unwrap();
            assert!((got - z).abs() <= 0.000_101, "{got} for {z}");
        }
    }

    #[test]
    fn noise_has_the_stated_spread_and_depth_comes_in_disparity_steps() {
        let exact = vec![3.0; 20_000];
        let smooth = SensorConfig { disparity_step_px: 0.0, ..SensorConfig::default() };
        let image = measure(&exact, &camera(), &smooth, 1);
        let errors: Vec<f64> = image.raw.data().iter().map(|&raw| f64::from(raw) / 5000.0 - 3.0).collect();
        let sigma = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
        let want = 0.0012 + 0.0019 * 2.6 * 2.6;
        assert!((sigma / want - 1.0).abs() < 0.03, "{sigma} instead of {want}");
        let mut values = measure(&exact, &camera(), &SensorConfig::default(), 1).raw.data().to_vec();
        values.sort_unstable();
        values.dedup();
        // One eighth of a pixel at bf = 40 is 28 mm at 3 m.
        let gap = f64::from(values[1] - values[0]) / 5000.0;
        assert!((gap - 0.028).abs() < 0.003, "{gap}");
    }

    #[test]
    fn a_near_object_shades_the_background_to_its_left_as_wide_as_the_difference_of_disparities() {
        let exact: Vec<f32> = (0..20_000).map(|i| if (80..120).contains(&(i % 200)) { 1.0 } else { 2.0 }).collect();
        let sensor = SensorConfig { holes: true, ..SensorConfig::perfect() };
        let image = measure(&exact, &camera(), &sensor, 1);
        let holes: Vec<usize> = (0..200).filter(|&x| image.metres(x, 50).is_none()).collect();
        assert_eq!(holes, (61..80).collect::<Vec<_>>(), "40 px at 1 m less 20 px at 2 m, less the margin");
    }
}

//! Depth images of a structured-light sensor: noise, disparity steps, range; holes in the shadow of the projector, at edges, on
//! grazing and on dark surfaces.
//!
//! In: exact depth in metres and reflectance. Out: a [`DepthImage`] in sensor units, 0 without measurement. The sources of the
//! constants are in [`SensorConfig`].

use rayon::prelude::*;
use yfslam::{Camera, DepthImage, Image};

use crate::config::SensorConfig;
use crate::render::Rendering;
use crate::render::rays::RayTable;
use crate::rng::{hash, normals4};

/// Measures the exact depth of a rendering.
pub fn measure(
    exact: &Rendering,
    rays: &RayTable,
    camera: &Camera,
    depth_factor: f64,
    sensor: &SensorConfig,
    seed: u64,
) -> DepthImage {
    let (width, bf) = (camera.width, camera.bf as f32);
    let least_cosine = libm::cosf(sensor.max_angle_deg.to_radians());
    let by_angle = sensor.max_angle_deg < 90.0 || sensor.depth_noise_angle > 0.0 || sensor.min_return > 0.0;
    let mut raw = Image::<u16>::new(width, camera.height);
    raw.data_mut().par_chunks_mut(width).zip(exact.depth.par_chunks(width)).enumerate().for_each(
        |(row, (out, line))| {
            let lit = sensor.holes.then(|| lit_by_projector(line, bf));
            for (column, (unit, &z)) in out.iter_mut().zip(line).enumerate() {
                if lit.as_ref().is_some_and(|lit| !lit[column]) || z <= 0.0 {
                    continue;
                }
                let pixel = row * width + column;
                let draws = normals4(hash(seed, pixel as u64));
                let cosine = if by_angle { cosine(&exact.depth, rays, row, column) } else { 1.0 };
                let returned = exact.reflectance[pixel] * cosine / (z * z);
                if cosine * (1.0 + ANGLE_SPREAD * draws[1]) < least_cosine
                    || returned * (1.0 + RETURN_SPREAD * draws[2]) < sensor.min_return
                {
                    continue;
                }
                let measured = disturb(z, bf, cosine, sensor, draws[0]);
                if (sensor.min_depth_m..=sensor.max_depth_m).contains(&measured) {
                    // Rounds half up, because `round` is a library call on older processors. Depth that exceeds sixteen bits is not
                    // measured.
                    let value = f64::from(measured) * depth_factor + 0.5;
                    *unit = if value < 65_536.0 { value as u16 } else { 0 };
                }
            }
        },
    );
    DepthImage { raw, metres_per_unit: (1.0 / depth_factor) as f32 }
}

/// Relative spread of the angle and of the returned light at which depth is lost, which gives holes a ragged border.
const ANGLE_SPREAD: f32 = 0.15;
const RETURN_SPREAD: f32 = 0.2;

/// Returns the cosine of the angle between the surface normal and the ray, from the inverse depths around the pixel: the plane n·P
/// = 1 has 1/z = n·(x, y, 1). Depth edges appear as steep surfaces and lose their depth.
fn cosine(depth: &[f32], rays: &RayTable, row: usize, column: usize) -> f32 {
    let (width, height) = (rays.width, rays.height);
    let inverse = |row: usize, column: usize| {
        let z = depth[row * width + column];
        if z > 0.0 { 1.0 / z } else { 0.0 }
    };
    let ray = |row: usize, column: usize| row * rays.stride + column;
    let (left, right) = (column.saturating_sub(1), (column + 1).min(width - 1));
    let (up, down) = (row.saturating_sub(1), (row + 1).min(height - 1));
    let (x, y, w) = (rays.x[ray(row, column)], rays.y[ray(row, column)], inverse(row, column));
    let nx = (inverse(row, right) - inverse(row, left)) / (rays.x[ray(row, right)] - rays.x[ray(row, left)]);
    let ny = (inverse(down, column) - inverse(up, column)) / (rays.y[ray(down, column)] - rays.y[ray(up, column)]);
    let nz = w - nx * x - ny * y;
    w / ((nx * nx + ny * ny + nz * nz) * (x * x + y * y + 1.0)).sqrt()
}

fn disturb(z: f32, bf: f32, cosine: f32, sensor: &SensorConfig, normal: f32) -> f32 {
    let mut sigma = sensor.depth_noise_m + sensor.depth_noise_growth * (z - 0.4).max(0.0).powi(2);
    if sensor.depth_noise_angle > 0.0 && cosine < STEEP_COSINE {
        let angle = libm::acosf(cosine.min(1.0));
        let ratio = angle / (std::f32::consts::FRAC_PI_2 - angle).max(0.05);
        sigma += sensor.depth_noise_angle / z.sqrt() * ratio * ratio;
    }
    let noisy = (z + sigma * normal).max(1e-3);
    if sensor.disparity_step_px > 0.0 && bf > 0.0 {
        let steps = ((bf / noisy / sensor.disparity_step_px + 0.5) as u32).max(1) as f32;
        bf / (steps * sensor.disparity_step_px)
    } else {
        noisy
    }
}

/// Cosine of 60°: flatter surfaces have no effect of the angle (Nguyen et al. 2012; see [`SensorConfig::depth_noise_angle`]).
const STEEP_COSINE: f32 = 0.5;

/// Returns which pixels of a row the projector reaches. It is to the right of the camera by the baseline: a point at column x and
/// depth z is at x − bf/z in its view, and is hidden if a pixel farther right is at or left of that.
fn lit_by_projector(line: &[f32], bf: f32) -> Vec<bool> {
    // The slope of a surface must not hide the surface: a hidden point is hidden by at least this many pixels.
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
        let mut camera = default_camera();
        (camera.width, camera.height) = (200, 100);
        camera
    }

    /// Measures surfaces of the given depth and reflectance.
    fn measured(exact: Vec<f32>, reflectance: f32, sensor: &SensorConfig) -> DepthImage {
        let pixels = exact.len();
        let rendering = Rendering { depth: exact, reflectance: vec![reflectance; pixels], ..Rendering::default() };
        measure(&rendering, &RayTable::new(&camera()), &camera(), 5000.0, sensor, 1)
    }

    fn missing(image: &DepthImage) -> f64 {
        image.raw.data().iter().filter(|&&raw| raw == 0).count() as f64 / image.raw.data().len() as f64
    }

    #[test]
    fn a_wall_has_no_depth_at_a_grazing_angle() {
        // A wall through (0, 0, 2) whose normal has the angle `degrees` to the axis of a camera with a long focal length.
        let wall = |degrees: f32| -> Vec<f32> {
            let slope = degrees.to_radians().tan();
            (0..20_000).map(|i| 2.0 / (1.0 - slope * ((i % 200) as f32 - 100.0) / 20_000.0)).collect()
        };
        let long = Camera::pinhole(200, 100, 20_000.0, 20_000.0, 100.0, 50.0);
        let lost = |degrees: f32| {
            let depth = wall(degrees);
            let rendering = Rendering { reflectance: vec![0.5; depth.len()], depth, ..Rendering::default() };
            let sensor = SensorConfig { max_angle_deg: 80.0, ..SensorConfig::perfect() };
            missing(&measure(&rendering, &RayTable::new(&long), &long, 5000.0, &sensor, 1))
        };
        assert_eq!((lost(0.0), lost(60.0)), (0.0, 0.0));
        assert!((0.2..0.8).contains(&lost(80.0)), "{}", lost(80.0));
        assert!(lost(86.0) > 0.97, "{}", lost(86.0));
    }

    #[test]
    fn a_dark_surface_has_no_depth_when_it_is_far() {
        let sensor = SensorConfig { min_return: 0.005, ..SensorConfig::perfect() };
        let lost = |reflectance: f32, z: f32| missing(&measured(vec![z; 20_000], reflectance, &sensor));
        assert_eq!((lost(0.5, 4.5), lost(0.04, 1.5)), (0.0, 0.0));
        assert!(lost(0.04, 4.0) > 0.95, "{}", lost(0.04, 4.0));
        let border = lost(0.04, 0.04f32.sqrt() / 0.005f32.sqrt());
        assert!((0.3..0.8).contains(&border), "{border}");
    }

    #[test]
    fn the_perfect_sensor_only_rounds_to_the_unit() {
        let exact: Vec<f32> = (0..20_000).map(|i| 0.3 + i as f32 * 4e-4).collect();
        let image = measured(exact.clone(), 0.5, &SensorConfig::perfect());
        for (i, &z) in exact.iter().enumerate() {
            let got = image.metres(i % 200, i / 200).unwrap();
            assert!((got - z).abs() <= 0.000_101, "{got} for {z}");
        }
    }

    #[test]
    fn noise_has_the_stated_spread_and_depth_comes_in_disparity_steps() {
        let exact = vec![3.0; 20_000];
        let smooth = SensorConfig { disparity_step_px: 0.0, ..SensorConfig::default() };
        let image = measured(exact.clone(), 0.5, &smooth);
        let errors: Vec<f64> = image.raw.data().iter().map(|&raw| f64::from(raw) / 5000.0 - 3.0).collect();
        let sigma = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
        let want = 0.0012 + 0.0019 * 2.6 * 2.6;
        assert!((sigma / want - 1.0).abs() < 0.03, "{sigma} instead of {want}");
        let mut values = measured(exact, 0.5, &SensorConfig::default()).raw.data().to_vec();
        values.sort_unstable();
        values.dedup();
        // One eighth of a pixel at bf = 40 is 28 mm at 3 m.
        let gap = f64::from(values[1] - values[0]) / 5000.0;
        assert!((gap - 0.028).abs() < 0.003, "{gap}");
    }

    #[test]
    fn a_near_object_hides_the_background_to_its_left_over_the_difference_of_disparities() {
        let exact: Vec<f32> = (0..20_000).map(|i| if (80..120).contains(&(i % 200)) { 1.0 } else { 2.0 }).collect();
        let sensor = SensorConfig { holes: true, ..SensorConfig::perfect() };
        let image = measured(exact, 0.5, &sensor);
        let holes: Vec<usize> = (0..200).filter(|&x| image.metres(x, 50).is_none()).collect();
        assert_eq!(holes, (61..80).collect::<Vec<_>>(), "40 px at 1 m less 20 px at 2 m, less the margin");
    }
}

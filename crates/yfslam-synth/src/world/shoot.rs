//! Takes images of the world: renders what each row shows at its time and applies the sensor.
//!
//! In: a table of rays, a shutter, the mount of the camera. Out: an exact rendering, a colour image or a depth image.

use nalgebra::Isometry3;
use rayon::prelude::*;
use yfslam::{DepthImage, RgbImage};

use super::World;
use crate::flicker;
use crate::light::Occluder;
use crate::render::rays::RayTable;
use crate::render::shade::View;
use crate::render::{self, Rendering};
use crate::sensor;
use crate::sensor::blur::CameraMove;
use crate::sensor::shutter::Shutter;

impl World {
    /// Renders what the camera at `mount` shows, each row at its time.
    pub(super) fn shoot(&self, rays: &RayTable, shutter: &Shutter, mount: &Isometry3<f64>) -> Rendering {
        if shutter.is_global() {
            return self.render(rays, shutter.middle_s, &(self.path.pose(shutter.middle_s) * mount));
        }
        let row = |row: usize| {
            let time = shutter.time(row as f64, rays.height);
            let (strip, own) = rays.strip(row);
            let all = self.render(&strip, time, &(self.path.pose(time) * mount));
            let range = own * rays.width..(own + 1) * rays.width;
            Rendering {
                color: all.color[range.clone()].to_vec(),
                depth: all.depth[range.clone()].to_vec(),
                instance: all.instance[range.clone()].to_vec(),
                reflectance: all.reflectance[range].to_vec(),
            }
        };
        let rows: Vec<Rendering> = (0..rays.height).into_par_iter().map(row).collect();
        let mut rendering = Rendering::new(0);
        for row in rows {
            rendering.append(row);
        }
        rendering
    }

    /// Renders the whole image as at one time.
    pub(super) fn render(&self, rays: &RayTable, time: f64, t_world_cam: &Isometry3<f64>) -> Rendering {
        let brightness = flicker::brightness(self.config.light.flicker, self.config.seed, time);
        let (actors, occluders) = self.actors.at(time, &self.scene.lights.dimmed(brightness));
        let t_cam_world = t_world_cam.inverse();
        let nearby = if self.config.light.moving_shadows { in_camera(&occluders, &t_cam_world) } else { Vec::new() };
        let view = View {
            meshes: [&self.scene.mesh, &actors],
            surfaces: &self.surfaces,
            brightness,
            occluders: &nearby,
            r_cam_world: t_cam_world.rotation.cast(),
            pitch: rays.pitch,
        };
        render::render(rays, &t_cam_world, &view, self.config.antialias)
    }

    /// Computes the colour image of a camera mounted at `mount` on the first, which sets the exposure of both: blur, gain,
    /// development. The gain is that of the middle row.
    pub(super) fn expose(
        &self,
        rays: &RayTable,
        rendering: &Rendering,
        shutter: &Shutter,
        mount: &Isometry3<f64>,
        seed: u64,
    ) -> RgbImage {
        let (sensor, (width, height)) = (&self.config.sensor, (rays.width, rays.height));
        let gain = self.config.light.exposure * self.meter.gain(shutter.middle_s, |at| self.brightness(at));
        let motion = |row: usize| {
            let time = shutter.time(row as f64, height);
            let [open, close] = [-0.5, 0.5].map(|part| self.path.pose(time + part * sensor.exposure_s) * mount);
            CameraMove::between(&open, &close).with_line(shutter.line_s(height) / sensor.exposure_s)
        };
        let smeared =
            (sensor.exposure_s > 0.0).then(|| sensor::blur::smear(&rendering.color, &rendering.depth, rays, motion));
        let linear = smeared.as_ref().unwrap_or(&rendering.color);
        sensor::color::develop(linear, width, height, gain, sensor.color_noise, seed)
    }

    /// Computes the depth image, whose rows may show the world at other times than those of the colour image.
    pub(super) fn measure(&self, rendering: &Rendering, index: usize, seed: u64) -> DepthImage {
        let (camera, sensor) = (&self.config.camera, &self.config.sensor);
        let shutter = self.depth_shutter(index);
        let own =
            (shutter != self.color_shutter(index)).then(|| self.shoot(&self.rays, &shutter, &Isometry3::identity()));
        let rendering = own.as_ref().unwrap_or(rendering);
        sensor::depth::measure(rendering, &self.rays, camera, self.config.depth_factor, sensor, seed)
    }

    /// Returns the mean brightness of the image, as measured by automatic exposure.
    fn brightness(&self, time: f64) -> f32 {
        let rendering = self.render(&self.small_rays, time, &self.path.pose(time));
        // White is clipped: a lamp in the image does not count for more.
        let sum: f32 = rendering.color.iter().map(|rgb| rgb.iter().map(|v| v.min(1.0)).sum::<f32>() / 3.0).sum();
        sum / rendering.color.len().max(1) as f32
    }
}

fn in_camera(occluders: &[Occluder], t_cam_world: &Isometry3<f64>) -> Vec<Occluder> {
    let pose: Isometry3<f32> = t_cam_world.cast();
    let moved = |o: &Occluder| (pose * nalgebra::Point3::from(o.center)).coords;
    occluders.iter().map(|o| Occluder { center: moved(o), ..*o }).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may")]
mod tests {
    use super::*;
    use crate::SensorConfig;

    #[test]
    fn every_row_is_that_of_the_global_image_at_its_time() {
        for (spec, readout_ms) in [
            ("walking_rpy?seed=2&people=2", 30.0),
            ("walking_xyz?seed=5&people=3&flicker=0.8&robots=1", -30.0),
            ("carried_box?seed=1&people=2", 100.0),
        ] {
            let mut config = crate::parse(&format!("{spec}&width=160&height=120")).unwrap();
            config.light.shadow_rays = 0;
            config.sensor = SensorConfig { readout_ms, ..SensorConfig::perfect() };
            let world = World::new(&config).unwrap();
            let mount = Isometry3::translation(0.1, 0.0, 0.0);
            let shutter = world.color_shutter(31);
            let rolling = world.shoot(&world.rays, &shutter, &mount);
            for row in [0, 1, 17, 59, 60, 93, 119] {
                let time = shutter.time(row as f64, 120);
                assert_eq!(world.row_pose(31, row as f64), world.path.pose(time));
                let global = world.render(&world.rays, time, &(world.path.pose(time) * mount));
                let pixels = row * 160..(row + 1) * 160;
                let differ = |k: &usize| {
                    let colors = rolling.color[*k].iter().zip(global.color[*k]);
                    rolling.instance[*k] != global.instance[*k]
                        || (rolling.depth[*k] - global.depth[*k]).abs() > 1e-5 * global.depth[*k]
                        || colors.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) > 1e-3
                };
                let count = pixels.filter(differ).count();
                assert!(count <= 1, "{spec}: {count} pixels of row {row} differ");
            }
        }
    }
}

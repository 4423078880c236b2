//! Takes images of the world: renders what each row shows at its time and applies the sensor.
//!
//! In: a table of rays, a shutter, the mount of the camera. Out: an exact rendering, a colour image or a depth image.

use nalgebra::Isometry3;
use rayon::prelude::*;
use yfslam::{DepthImage, RgbImage};

use super::World;
use crate::actors::Poses;
use crate::flicker;
use crate::light::{Lights, Occluder};
use crate::mesh::Mesh;
use crate::render::rays::RayTable;
use crate::render::shade::{Carried, View};
use crate::render::{self, Rendering};
use crate::sensor;
use crate::sensor::blur::CameraMove;
use crate::sensor::shutter::Shutter;

/// The world and the camera at one time.
struct Moment {
    t_cam_world: Isometry3<f64>,
    /// Brightness of flickering lamps.
    brightness: f32,
    lights: Lights,
    /// Poses of the bones of the actors.
    bones: Vec<Isometry3<f32>>,
    /// Bodies that darken their surroundings, in camera coordinates.
    occluders: Vec<Occluder>,
}

impl World {
    /// Renders what the camera at `mount` shows, each row at its time.
    pub(super) fn shoot(&self, rays: &RayTable, shutter: &Shutter, mount: &Isometry3<f64>) -> Rendering {
        if shutter.is_global() {
            return self.render(rays, shutter.middle_s, &(self.path.pose(shutter.middle_s) * mount));
        }
        let moment = |row: usize| {
            let time = shutter.time(row as f64, rays.height);
            self.moment(time, &(self.path.pose(time) * mount))
        };
        let moments: Vec<Moment> = (0..rays.height).into_par_iter().map(moment).collect();
        let rig = self.actors.rig();
        let views: Vec<View> = moments
            .iter()
            .map(|moment| {
                let carried = Carried { rig, bones: &moment.bones, lights: &moment.lights };
                View { carried: Some(carried), ..self.view(moment, rig.mesh(), rays.pitch) }
            })
            .collect();
        render::render_rows(rays, &views, self.config.antialias)
    }

    /// Renders the whole image as at one time.
    fn render(&self, rays: &RayTable, time: f64, t_world_cam: &Isometry3<f64>) -> Rendering {
        let moment = self.moment(time, t_world_cam);
        let actors = self.actors.rig().posed(&moment.bones, &moment.lights);
        render::render(rays, &self.view(&moment, &actors, rays.pitch), self.config.antialias)
    }

    fn moment(&self, time: f64, t_world_cam: &Isometry3<f64>) -> Moment {
        let brightness = flicker::brightness(self.config.light.flicker, self.config.seed, time);
        let Poses { bones, occluders } = self.actors.poses(time);
        let t_cam_world = t_world_cam.inverse();
        let occluders = if self.config.light.moving_shadows { in_camera(&occluders, &t_cam_world) } else { Vec::new() };
        Moment { t_cam_world, brightness, lights: self.scene.lights.dimmed(brightness), bones, occluders }
    }

    fn view<'a>(&'a self, moment: &'a Moment, actors: &'a Mesh, pitch: [f32; 2]) -> View<'a> {
        View {
            meshes: [&self.scene.mesh, actors],
            carried: None,
            surfaces: &self.surfaces,
            brightness: moment.brightness,
            occluders: &moment.occluders,
            t_cam_world: moment.t_cam_world,
            r_cam_world: moment.t_cam_world.rotation.cast(),
            pitch,
        }
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
        let motion = |row: usize| self.motion(shutter, sensor.exposure_s, mount, row, height);
        let smeared =
            (sensor.exposure_s > 0.0).then(|| sensor::blur::smear(&rendering.color, &rendering.depth, rays, motion));
        let linear = smeared.as_ref().unwrap_or(&rendering.color);
        sensor::color::develop(linear, width, height, gain, sensor.color_noise, seed)
    }

    /// Returns the motion of the camera at `mount` while `row` of an image of `rows` rows is exposed.
    fn motion(
        &self,
        shutter: &Shutter,
        exposure_s: f64,
        mount: &Isometry3<f64>,
        row: usize,
        rows: usize,
    ) -> CameraMove {
        let time = shutter.time(row as f64, rows);
        let [open, close] = [-0.5, 0.5].map(|part| self.path.pose(time + part * exposure_s) * mount);
        CameraMove::between(&open, &close).with_line(shutter.line_s(rows) / exposure_s)
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

    /// Returns a small world with a perfect sensor except for its shutter.
    fn rolling(spec: &str, readout_ms: f64, antialias: bool) -> World {
        let mut config = crate::parse(&format!("{spec}&width=160&height=120")).unwrap();
        config.light.shadow_rays = 0;
        config.sensor = SensorConfig { readout_ms, ..SensorConfig::perfect() };
        config.antialias = antialias;
        World::new(&config).unwrap()
    }

    /// Returns the pixels of `row` in which rolling and global image differ in depth or instance, and the sum of the differences of
    /// their colours.
    fn differences(rolling: &Rendering, global: &Rendering, row: usize) -> (usize, f32) {
        let pixels = row * 160..(row + 1) * 160;
        let geometry = |k: &usize| {
            rolling.instance[*k] != global.instance[*k]
                || (rolling.depth[*k] - global.depth[*k]).abs() > 1e-6 * global.depth[*k]
        };
        let color = |k: usize| {
            let channels = rolling.color[k].iter().zip(global.color[k]);
            channels.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
        };
        (pixels.clone().filter(geometry).count(), pixels.map(color).sum())
    }

    #[test]
    fn every_row_is_that_of_the_global_image_at_its_time() {
        for (spec, readout_ms) in [
            ("walking_rpy?seed=2&people=2", 30.0),
            ("walking_xyz?seed=5&people=3&flicker=0.8&robots=1", -30.0),
            ("carried_box?seed=1&people=2&shake=20", 100.0),
            ("corridor_loop?seed=3&stereo=0.1", 20.0),
        ] {
            for antialias in [false, true] {
                let world = rolling(spec, readout_ms, antialias);
                let mount = Isometry3::translation(0.1, 0.0, 0.0);
                let shutter = world.color_shutter(31);
                let rolling = world.shoot(&world.rays, &shutter, &mount);
                for row in [0, 1, 17, 44, 59, 60, 93, 119] {
                    let time = shutter.time(row as f64, 120);
                    assert_eq!(world.row_pose(31, row as f64), world.path.pose(time));
                    let global = world.render(&world.rays, time, &(world.path.pose(time) * mount));
                    let (count, color) = differences(&rolling, &global, row);
                    assert!(count == 0 && color < 1e-3, "{spec}: {count} pixels and {color} of row {row} differ");
                }
            }
        }
    }
    /// Returns the squared difference of a blurred image from the mean of the images while the shutter is open, relative to that of
    /// a sharp image.
    fn blur_error(world: &World, shutter: &Shutter, exposure_s: f64) -> f32 {
        let mount = Isometry3::identity();
        // Lamps are clipped, or they would count for more than all the rest.
        let shoot = |middle_s: f64| {
            let mut image = world.shoot(&world.rays, &Shutter { middle_s, ..*shutter }, &mount);
            image.color.iter_mut().for_each(|rgb| *rgb = rgb.map(|c| c.min(1.0)));
            image
        };
        let sharp = shoot(shutter.middle_s);
        let mut mean = vec![[0.0f32; 3]; sharp.color.len()];
        for k in 0..15 {
            let one = shoot(shutter.middle_s + exposure_s * ((f64::from(k) + 0.5) / 15.0 - 0.5));
            mean.iter_mut().zip(&one.color).for_each(|(sum, rgb)| (0..3).for_each(|c| sum[c] += rgb[c] / 15.0));
        }
        let motion = |row| world.motion(shutter, exposure_s, &mount, row, 120);
        let blurred = sensor::blur::smear(&sharp.color, &sharp.depth, &world.rays, motion);
        let error = |image: &[[f32; 3]]| -> f32 {
            image.iter().zip(&mean).map(|(a, b)| (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f32>()).sum()
        };
        error(&blurred) / error(&sharp.color)
    }

    #[test]
    fn blur_is_the_mean_of_the_images_while_the_shutter_is_open() {
        for frame in [20, 45] {
            let world = rolling("walking_rpy?seed=2&people=0", 50.0, true);
            let shutter = world.color_shutter(frame);
            let rolling = blur_error(&world, &shutter, 0.06);
            let global = blur_error(&world, &Shutter { readout_s: 0.0, ..shutter }, 0.06);
            assert!(rolling < 0.5 && rolling < 1.1 * global, "frame {frame}: {rolling}, of a global shutter {global}");
        }
    }
}

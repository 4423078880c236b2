//! Random access to rendered frames of a synthetic world and their ground truth.
//!
//! In: a [`WorldConfig`]. Out: frames. A frame depends only on the configuration and its number: any order, any number of threads
//! and any machine of one kind give the same bits.

mod distance;

use std::sync::Arc;

use nalgebra::Isometry3;
use yfslam::{BoundingBox, Camera, DepthImage, Detection, Frame, Image, RgbImage};

use crate::actors::Actors;
use crate::bake::Baker;
use crate::camera_path::CameraPath;
use crate::config::{WorldConfig, WorldError, default_camera};
use crate::flicker;
use crate::light::Occluder;
use crate::render::rays::RayTable;
use crate::render::shade::View;
use crate::render::{self, Rendering};
use crate::rng::hash;
use crate::scene::Scene;
use crate::sensor;
use crate::sensor::blur::CameraMove;
use crate::sensor::exposure::Meter;
use crate::surfaces::Surfaces;

/// Width of the small renderings from which shares and brightness are estimated, px.
const SMALL_WIDTH: usize = 48;

/// A synthetic sequence, ready to render.
#[derive(Debug)]
pub struct World {
    config: WorldConfig,
    scene: Scene,
    actors: Actors,
    path: CameraPath,
    surfaces: Surfaces,
    rays: RayTable,
    /// Rays of a small rendering, for estimates over the whole view.
    small_rays: RayTable,
    meter: Meter,
    person_share: f64,
}

/// A rendered frame and its ground truth.
#[derive(Clone, Debug)]
pub struct SynthFrame {
    /// The input of a SLAM system. It has detections if [`WorldConfig::detections`] is set.
    pub frame: Frame,
    /// Time of the depth image, ns: that of the colour image plus [`SensorConfig::depth_offset_s`](crate::SensorConfig).
    pub depth_timestamp_ns: i64,
    /// Exact pose at the time of the colour image: world from camera.
    pub t_world_cam: Isometry3<f64>,
    /// 0 for the static world, k for actor k (from 1).
    pub instances: Image<u8>,
    /// Exact depth along the optical axis, m; 0 where nothing is visible.
    pub exact_depth: Image<f32>,
    /// Exact boxes of the sufficiently visible actors, in the order of their numbers: number, class (an index into
    /// [`CLASS_NAMES`](crate::CLASS_NAMES)), tight bounds of the visible pixels.
    pub boxes: Vec<(u8, usize, BoundingBox)>,
}

impl World {
    /// Builds the scene and plans the motion of all actors. Textures and light maps are computed when a frame first shows them.
    ///
    /// # Errors
    /// A value of the configuration is out of range.
    pub fn new(config: &WorldConfig) -> Result<Self, WorldError> {
        config.validate()?;
        let mut scene = Scene::new(config.scene, config.seed);
        let path = CameraPath::new(config, &scene);
        let actors = Actors::new(&mut scene, config, &path);
        // Textures for the default focal length suit any other if the number of texels scales with it.
        let sharpness = config.camera.fx.max(config.camera.fy) / default_camera().fx;
        let baker = Baker::new(&scene.mesh, scene.lights.clone(), config.light.shadow_rays);
        let palette = std::mem::take(&mut scene.palette);
        let surfaces = Surfaces::new(palette, sharpness.clamp(0.05, 3.0) as f32, &scene.mesh, baker);
        let rays = RayTable::new(&config.camera);
        let small_rays = RayTable::new(&shrink(&config.camera, SMALL_WIDTH));
        let seconds = config.frames as f64 / config.camera.fps;
        let meter = Meter::new(seconds, config.sensor.auto_exposure, hash(config.seed, 0xae));
        let config = config.clone();
        let mut world = Self { config, scene, actors, path, surfaces, rays, small_rays, meter, person_share: 0.0 };
        world.choose_distance();
        Ok(world)
    }

    /// Returns the configuration.
    pub fn config(&self) -> &WorldConfig {
        &self.config
    }

    /// Returns the number of frames.
    pub fn len(&self) -> usize {
        self.config.frames
    }

    /// Returns whether there are no frames, which is never the case.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the mean share of the image that actors cover over the sequence, estimated from small renderings of some frames.
    pub fn person_share(&self) -> f64 {
        self.person_share
    }

    /// Returns the time of frame `index`, ns.
    pub fn timestamp_ns(&self, index: usize) -> i64 {
        to_ns(self.seconds(index))
    }

    /// Returns the exact pose (world from camera) of frame `index`.
    pub fn pose(&self, index: usize) -> Isometry3<f64> {
        self.path.pose(self.seconds(index))
    }

    /// Renders frame `index`; numbers past the end continue the motion.
    pub fn frame(&self, index: usize) -> SynthFrame {
        let (time, t_world_cam) = (self.seconds(index), self.pose(index));
        let rendering = self.render(&self.rays, time, &t_world_cam);
        let noise = hash(self.config.seed, 0x4015_e000 + index as u64);
        let color = self.expose(&self.rays, &rendering, time, &Isometry3::identity(), hash(noise, 0));
        let mount = Isometry3::translation(self.config.stereo_m, 0.0, 0.0);
        let right = (self.config.stereo_m > 0.0).then(|| self.second(&self.rays, index, &mount));
        let depth = right.is_none().then(|| Arc::new(self.measure(&rendering, time, hash(noise, 1))));
        let (width, height) = (self.rays.width, self.rays.height);
        let boxes = self.boxes(&rendering.instance);
        let detections = self.config.detections.then(|| {
            boxes.iter().map(|&(_, class, bbox)| Detection { class, score: 1.0, bbox }).collect::<Vec<Detection>>()
        });
        let mut frame = Frame::mono(to_ns(time), color);
        (frame.depth, frame.right, frame.detections) = (depth, right.map(Arc::new), detections);
        SynthFrame {
            depth_timestamp_ns: to_ns(time + self.config.sensor.depth_offset_s),
            frame,
            t_world_cam,
            instances: image(width, height, rendering.instance),
            exact_depth: image(width, height, rendering.depth),
            boxes,
        }
    }

    /// Renders the image of a second camera, fixed to the first, at the time of frame `index`: `mount` is its pose in the frame of
    /// the first camera, `camera` its calibration with distortion.
    pub fn second_view(&self, index: usize, camera: &Camera, mount: &Isometry3<f64>) -> RgbImage {
        self.second(&RayTable::new(camera), index, mount)
    }

    fn second(&self, rays: &RayTable, index: usize, mount: &Isometry3<f64>) -> RgbImage {
        let time = self.seconds(index);
        let rendering = self.render(rays, time, &(self.pose(index) * mount));
        self.expose(rays, &rendering, time, mount, hash(hash(self.config.seed, 0x4015_e000 + index as u64), 2))
    }

    fn seconds(&self, index: usize) -> f64 {
        index as f64 / self.config.camera.fps
    }

    fn render(&self, rays: &RayTable, time: f64, t_world_cam: &Isometry3<f64>) -> Rendering {
        let brightness = flicker::brightness(self.config.light.flicker, self.config.seed, time);
        let (actors, occluders) = self.actors.at(time, &self.scene.lights.dimmed(brightness));
        let t_cam_world = t_world_cam.inverse();
        let nearby =
            if self.config.light.moving_shadows { self.in_camera(&occluders, &t_cam_world) } else { Vec::new() };
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
    /// development.
    fn expose(&self, rays: &RayTable, rendering: &Rendering, time: f64, mount: &Isometry3<f64>, seed: u64) -> RgbImage {
        let (sensor, (width, height)) = (&self.config.sensor, (rays.width, rays.height));
        let gain = self.config.light.exposure * self.meter.gain(time, |at| self.brightness(at));
        let smeared = (sensor.exposure_s > 0.0).then(|| {
            let [open, close] = [-0.5, 0.5].map(|part| self.path.pose(time + part * sensor.exposure_s) * mount);
            sensor::blur::smear(&rendering.color, &rendering.depth, rays, &CameraMove::between(&open, &close))
        });
        let linear = smeared.as_ref().unwrap_or(&rendering.color);
        sensor::color::develop(linear, width, height, gain, sensor.color_noise, seed)
    }

    /// Computes the depth image, which may show the world slightly later than the colour image.
    fn measure(&self, rendering: &Rendering, time: f64, seed: u64) -> DepthImage {
        let (camera, sensor) = (&self.config.camera, &self.config.sensor);
        let later = (sensor.depth_offset_s != 0.0).then(|| {
            let time = time + sensor.depth_offset_s;
            self.render(&self.rays, time, &self.path.pose(time))
        });
        let rendering = later.as_ref().unwrap_or(rendering);
        sensor::depth::measure(rendering, &self.rays, camera, self.config.depth_factor, sensor, seed)
    }

    /// Returns the mean brightness of the image, as measured by automatic exposure.
    fn brightness(&self, time: f64) -> f32 {
        let rendering = self.render(&self.small_rays, time, &self.path.pose(time));
        // White is clipped: a lamp in the image does not count for more.
        let sum: f32 = rendering.color.iter().map(|rgb| rgb.iter().map(|v| v.min(1.0)).sum::<f32>() / 3.0).sum();
        sum / rendering.color.len().max(1) as f32
    }

    fn in_camera(&self, occluders: &[Occluder], t_cam_world: &Isometry3<f64>) -> Vec<Occluder> {
        let pose: Isometry3<f32> = t_cam_world.cast();
        let moved = |o: &Occluder| (pose * nalgebra::Point3::from(o.center)).coords;
        occluders.iter().map(|o| Occluder { center: moved(o), ..*o }).collect()
    }

    /// Returns the boxes around the visible pixels of all actors with enough of them.
    fn boxes(&self, instances: &[u8]) -> Vec<(u8, usize, BoundingBox)> {
        let least = self.config.min_person_px as f64 * instances.len() as f64 / (640.0 * 480.0);
        let mut found = vec![(0usize, [usize::MAX, usize::MAX, 0, 0]); self.actors.len() + 1];
        for (i, &instance) in instances.iter().enumerate() {
            if instance > 0 {
                let (x, y) = (i % self.rays.width, i / self.rays.width);
                let (count, [x0, y0, x1, y1]) = &mut found[usize::from(instance)];
                *count += 1;
                (*x0, *y0, *x1, *y1) = ((*x0).min(x), (*y0).min(y), (*x1).max(x + 1), (*y1).max(y + 1));
            }
        }
        let visible = (0u8..).zip(&found).filter(|(_, (count, _))| *count > 0 && *count as f64 >= least);
        visible
            .map(|(instance, (_, [x0, y0, x1, y1]))| {
                let bbox = BoundingBox { x_min: *x0 as f32, y_min: *y0 as f32, x_max: *x1 as f32, y_max: *y1 as f32 };
                (instance, self.actors.class(instance) as usize, bbox)
            })
            .collect()
    }
}

/// Returns the camera for the same view in an image of the given width.
fn shrink(camera: &Camera, width: usize) -> Camera {
    let scale = camera.width as f64 / width as f64;
    let mut shrunk = camera.clone();
    shrunk.width = width;
    shrunk.height = ((camera.height as f64 / scale).round() as usize).max(1);
    (shrunk.fx, shrunk.fy) = (camera.fx / scale, camera.fy / scale);
    (shrunk.cx, shrunk.cy) = ((camera.cx + 0.5) / scale - 0.5, (camera.cy + 0.5) / scale - 0.5);
    shrunk
}

fn to_ns(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

fn image<T: Copy + Default>(width: usize, height: usize, data: Vec<T>) -> Image<T> {
    Image::from_vec(width, height, data).unwrap_or_default()
}

#[cfg(test)]
mod tests;

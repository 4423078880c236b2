//! Random access to rendered frames of a synthetic world and their ground truth.
//!
//! In: a [`WorldConfig`]. Out: frames. A frame depends only on the configuration and its number: any order, any number of threads
//! and any machine of one kind give the same bits.

mod distance;
mod shoot;

use std::sync::Arc;

use nalgebra::Isometry3;
use yfslam::{BoundingBox, Camera, Detection, Frame, Image, RgbImage};

use crate::actors::Actors;
use crate::bake::Baker;
use crate::camera_path::CameraPath;
use crate::config::{WorldConfig, WorldError, default_camera};
use crate::render::rays::RayTable;
use crate::rng::hash;
use crate::scene::Scene;
use crate::sensor::exposure::Meter;
use crate::sensor::shutter::Shutter;
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
    /// Exact pose at the time of the colour image, which is that of its middle row: world from camera. [`World::row_pose`] is that
    /// of any row.
    pub t_world_cam: Isometry3<f64>,
    /// What the colour image shows: 0 for the static world, k for actor k (from 1). Each row is that of its own time.
    pub instances: Image<u8>,
    /// Exact depth along the optical axis of what the colour image shows, m; 0 where nothing is visible. Each row is that of its
    /// own time.
    pub exact_depth: Image<f32>,
    /// Exact boxes of the sufficiently visible actors, in the order of their numbers: number, class (an index into
    /// [`CLASS_NAMES`](crate::CLASS_NAMES)), tight bounds of the pixels in `instances`.
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

    /// Returns the exact pose (world from camera) at which `row` of the colour image of frame `index` is read; rows may lie between
    /// pixels. That of every row is [`World::pose`] unless the shutter is a rolling one.
    pub fn row_pose(&self, index: usize, row: f64) -> Isometry3<f64> {
        self.path.pose(self.color_shutter(index).time(row, self.rays.height))
    }

    /// Returns the exact pose (world from camera) at which `row` of the depth image of frame `index` is read.
    pub fn depth_row_pose(&self, index: usize, row: f64) -> Isometry3<f64> {
        self.path.pose(self.depth_shutter(index).time(row, self.rays.height))
    }

    /// Renders frame `index`; numbers past the end continue the motion.
    pub fn frame(&self, index: usize) -> SynthFrame {
        let (time, shutter) = (self.seconds(index), self.color_shutter(index));
        let at_camera = Isometry3::identity();
        let rendering = self.shoot(&self.rays, &shutter, &at_camera);
        let noise = hash(self.config.seed, 0x4015_e000 + index as u64);
        let color = self.expose(&self.rays, &rendering, &shutter, &at_camera, hash(noise, 0));
        let mount = Isometry3::translation(self.config.stereo_m, 0.0, 0.0);
        let right = (self.config.stereo_m > 0.0).then(|| self.second(&self.rays, index, &mount));
        let depth = right.is_none().then(|| Arc::new(self.measure(&rendering, index, hash(noise, 1))));
        let (width, height) = (self.rays.width, self.rays.height);
        let boxes = self.boxes(&rendering.instance);
        let detections = self.config.detections.then(|| {
            boxes.iter().map(|&(_, class, bbox)| Detection { class, score: 1.0, bbox }).collect::<Vec<Detection>>()
        });
        let mut frame = Frame::mono(to_ns(time), color);
        let depth_timestamp_ns = to_ns(self.depth_shutter(index).middle_s);
        frame.depth_timestamp_ns = depth.is_some().then_some(depth_timestamp_ns);
        (frame.depth, frame.right, frame.detections) = (depth, right.map(Arc::new), detections);
        SynthFrame {
            depth_timestamp_ns,
            frame,
            t_world_cam: self.pose(index),
            instances: image(width, height, rendering.instance),
            exact_depth: image(width, height, rendering.depth),
            boxes,
        }
    }

    /// Renders the image of a second camera, fixed to the first, at the time of frame `index`: `mount` is its pose in the frame of
    /// the first camera, `camera` its calibration with distortion. Its shutter has the readout of the first, over its own rows.
    pub fn second_view(&self, index: usize, camera: &Camera, mount: &Isometry3<f64>) -> RgbImage {
        self.second(&RayTable::new(camera), index, mount)
    }

    fn second(&self, rays: &RayTable, index: usize, mount: &Isometry3<f64>) -> RgbImage {
        let shutter = self.color_shutter(index);
        let rendering = self.shoot(rays, &shutter, mount);
        self.expose(rays, &rendering, &shutter, mount, hash(hash(self.config.seed, 0x4015_e000 + index as u64), 2))
    }

    fn seconds(&self, index: usize) -> f64 {
        index as f64 / self.config.camera.fps
    }

    fn color_shutter(&self, index: usize) -> Shutter {
        Shutter { middle_s: self.seconds(index), readout_s: 1e-3 * self.config.sensor.readout_ms }
    }

    fn depth_shutter(&self, index: usize) -> Shutter {
        let sensor = &self.config.sensor;
        Shutter { middle_s: self.seconds(index) + sensor.depth_offset_s, readout_s: 1e-3 * sensor.depth_readout() }
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

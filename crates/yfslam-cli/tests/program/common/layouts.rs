//! Writes one small world in the layouts of data sets, as their own tools would.
#![allow(clippy::unwrap_used, reason = "a test may")]

use std::fmt::Write;
use std::fs;
use std::path::Path;

use nalgebra::Isometry3;
use yfslam::{Camera, Image, RgbImage};
use yfslam_io::time::format_stamp;
use yfslam_io::write::{write_color_png, write_depth_png};
use yfslam_synth::World;

/// A small world without people.
const WORLD: &str = "walking_xyz?people=0&width=320&height=240&frames=12";

/// One frame of the world.
pub struct Shot {
    pub stamp_ns: i64,
    pub color: RgbImage,
    pub depth: Image<u16>,
    pub t_world_cam: Isometry3<f64>,
}

/// The frames of the world, with the depth units of a data set.
pub struct Shots {
    pub camera: Camera,
    pub factor: f64,
    pub shots: Vec<Shot>,
}

impl Shots {
    /// Renders the world with `factor` depth units per metre.
    pub fn render(factor: f64) -> Self {
        // The baseline that layouts assume for an RGB-D camera.
        let camera = yfslam_synth::default_camera();
        let mut config = yfslam_synth::parse_with_camera(WORLD, camera, factor).unwrap();
        config.camera.bf = 0.075 * config.camera.fx;
        let world = World::new(&config).unwrap();
        let shot = |index: usize| {
            let shot = world.frame(index);
            Shot {
                stamp_ns: shot.frame.timestamp_ns,
                color: RgbImage::clone(&shot.frame.color),
                depth: shot.frame.depth.as_ref().unwrap().raw.clone(),
                t_world_cam: shot.t_world_cam,
            }
        };
        Self { camera: config.camera.clone(), factor, shots: (0..world.len()).map(shot).collect() }
    }

    /// Writes images to `color(k)` and `depth(k)` in `folder`.
    pub fn write_images(&self, folder: &Path, color: impl Fn(usize) -> String, depth: impl Fn(usize) -> String) {
        for (k, shot) in self.shots.iter().enumerate() {
            for name in [color(k), depth(k)] {
                fs::create_dir_all(folder.join(name).parent().unwrap()).unwrap();
            }
            write_color_png(&folder.join(color(k)), &shot.color).unwrap();
            write_depth_png(&folder.join(depth(k)), &shot.depth).unwrap();
        }
    }

    /// Writes `camera.toml`.
    pub fn write_camera(&self, folder: &Path) {
        let text = format!("depth_factor = {:?}\n{}", self.factor, toml::to_string(&self.camera).unwrap());
        fs::write(folder.join("camera.toml"), text).unwrap();
    }

    /// Returns lines made of each frame.
    pub fn lines(&self, line: impl Fn(usize, &Shot) -> String) -> String {
        self.shots.iter().enumerate().map(|(k, shot)| line(k, shot) + "\n").collect()
    }

    /// Returns the ground truth in the format of TUM.
    pub fn truth(&self) -> String {
        self.lines(|_, shot| format!("{} {}", format_stamp(shot.stamp_ns), tum_pose(&shot.t_world_cam)))
    }

    /// Writes the layout of TUM, with which the others are compared.
    pub fn write_tum(&self, folder: &Path) {
        let (color, depth) = (|k: usize| format!("rgb/{k}.png"), |k: usize| format!("depth/{k}.png"));
        self.write_images(folder, color, depth);
        self.write_list(folder, "rgb.txt", color);
        self.write_list(folder, "depth.txt", depth);
        fs::write(folder.join("groundtruth.txt"), self.truth()).unwrap();
        self.write_camera(folder);
    }

    /// Writes a list of `stamp file`.
    pub fn write_list(&self, folder: &Path, list: &str, name: impl Fn(usize) -> String) {
        let text = self.lines(|k, shot| format!("{} {}", format_stamp(shot.stamp_ns), name(k)));
        fs::write(folder.join(list), text).unwrap();
    }

    /// The form of Open3D's recorders: a matrix column by column.
    pub fn write_open3d(&self, folder: &Path, camera_file: &str) {
        self.write_images(folder, |k| format!("color/{k:06}.jpg"), |k| format!("depth/{k:06}.png"));
        let Camera { width, height, fx, fy, cx, cy, .. } = self.camera;
        let text = format!(
            "{{\"width\": {width}, \"height\": {height}, \"intrinsic_matrix\": [{fx:?}, 0, 0, 0, {fy:?}, 0, {cx:?}, {cy:?}, 1]}}"
        );
        fs::write(folder.join(camera_file), text).unwrap();
    }

    pub fn write_seven_scenes(&self, folder: &Path) {
        self.write_images(folder, |k| format!("frame-{k:06}.color.png"), |k| format!("frame-{k:06}.depth.png"));
        for (k, shot) in self.shots.iter().enumerate() {
            fs::write(folder.join(format!("frame-{k:06}.pose.txt")), matrix(&shot.t_world_cam, "\n")).unwrap();
        }
        self.write_camera(folder);
    }

    pub fn write_replica(&self, folder: &Path) {
        self.write_images(folder, |k| format!("results/frame{k:06}.jpg"), |k| format!("results/depth{k:06}.png"));
        fs::write(folder.join("traj.txt"), self.lines(|_, shot| matrix(&shot.t_world_cam, " "))).unwrap();
        let Camera { width: w, height: h, fx, fy, cx, cy, .. } = self.camera;
        let scale = self.factor;
        let text = format!(
            "{{\"camera\": {{\"w\": {w}, \"h\": {h}, \"fx\": {fx:?}, \"fy\": {fy:?}, \"cx\": {cx:?}, \"cy\": {cy:?}, \"scale\": {scale:?}}}}}"
        );
        fs::write(folder.join("cam_params.json"), text).unwrap();
    }

    /// With depth images of every `step`-th pixel.
    pub fn write_scannet(&self, folder: &Path, step: usize) {
        self.write_images(folder, |k| format!("color/{k}.jpg"), |k| format!("depth/{k}.png"));
        fs::create_dir_all(folder.join("pose")).unwrap();
        fs::create_dir_all(folder.join("intrinsic")).unwrap();
        for (k, shot) in self.shots.iter().enumerate() {
            let d = &shot.depth;
            let (width, height) = (d.width() / step, d.height() / step);
            let pixel = |i: usize| *d.get(i % width * step, i / width * step).unwrap();
            let small = Image::from_vec(width, height, (0..width * height).map(pixel).collect()).unwrap();
            write_depth_png(&folder.join(format!("depth/{k}.png")), &small).unwrap();
            fs::write(folder.join(format!("pose/{k}.txt")), matrix(&shot.t_world_cam, "\n")).unwrap();
        }
        let Camera { fx, fy, cx, cy, .. } = self.camera;
        for (name, by) in [("color", 1.0), ("depth", step as f64)] {
            let (fx, fy, cx, cy) = (fx / by, fy / by, cx / by, cy / by);
            let text = format!("{fx:?} 0 {cx:?} 0\n0 {fy:?} {cy:?} 0\n0 0 1 0\n0 0 0 1\n");
            fs::write(folder.join(format!("intrinsic/intrinsic_{name}.txt")), text).unwrap();
        }
    }

    /// Stamps are frame numbers, and the y axes of the ground truth point up.
    pub fn write_icl_nuim(&self, folder: &Path) {
        self.write_images(folder, |k| format!("rgb/{k}.png"), |k| format!("depth/{k}.png"));
        let pairs = self.lines(|k, _| format!("{k} depth/{k}.png {k} rgb/{k}.png"));
        fs::write(folder.join("associations.txt"), pairs).unwrap();
        let mirrored = |pose: &Isometry3<f64>| {
            let (t, q) = (pose.translation, pose.rotation);
            format!("{} {} {} {} {} {} {}", t.x, -t.y, t.z, -q.i, q.j, -q.k, q.w)
        };
        let truth = self.lines(|k, shot| format!("{k} {}", mirrored(&shot.t_world_cam)));
        fs::write(folder.join("livingRoom2.gt.freiburg"), truth).unwrap();
        self.write_camera(folder);
    }

    pub fn write_eth3d(&self, folder: &Path) {
        self.write_tum(folder);
        fs::remove_file(folder.join("camera.toml")).unwrap();
        let Camera { fx, fy, cx, cy, .. } = self.camera;
        fs::write(folder.join("calibration.txt"), format!("{fx:?} {fy:?} {cx:?} {cy:?}\n")).unwrap();
    }

    pub fn write_openloris(&self, folder: &Path) {
        let (color, depth) = (|k: usize| format!("color/{k}.png"), |k: usize| format!("aligned_depth/{k}.png"));
        self.write_images(folder, color, depth);
        self.write_list(folder, "color.txt", color);
        self.write_list(folder, "aligned_depth.txt", depth);
        fs::write(folder.join("groundtruth.txt"), self.truth()).unwrap();
        let Camera { width, height, fx, fy, cx, cy, .. } = self.camera;
        let text = format!(
            "%YAML:1.0\nd400_color_optical_frame:\n   fps: 30\n   width: {width}\n   height: {height}\n   intrinsics: !!opencv-matrix\n      \
             rows: 1\n      cols: 4\n      dt: d\n      data: [ {fx:?}, {cx:?}, {fy:?}, {cy:?} ]\nd400_depth_optical_frame:\n   fps: 90\n"
        );
        fs::write(folder.join("sensors.yaml"), text).unwrap();
    }

    /// Returns the camera as settings of ORB-SLAM; `y` is 1 or, if y points up, -1.
    pub fn orb_slam_settings(&self, y: f64) -> String {
        let Camera { width, height, fx, fy, cx, cy, bf, .. } = self.camera;
        let mut text = "%YAML:1.0\n".to_owned();
        for (key, value) in [("fx", fx), ("fy", y * fy), ("cx", cx), ("cy", cy), ("fps", 30.0), ("bf", bf)] {
            writeln!(text, "Camera.{key}: {value:?}").unwrap();
        }
        for key in ["k1", "k2", "p1", "p2"] {
            writeln!(text, "Camera.{key}: 0.0").unwrap();
        }
        writeln!(text, "Camera.width: {width}\nCamera.height: {height}\nDepthMapFactor: {:?}", self.factor).unwrap();
        text
    }

    pub fn write_vslam_lab(&self, folder: &Path) {
        self.write_images(folder, |k| format!("rgb_0/{k}.png"), |k| format!("depth_0/{k}.png"));
        let rows = self.lines(|k, shot| format!("{0},rgb_0/{k}.png,{0},depth_0/{k}.png", shot.stamp_ns));
        let header = "ts_rgb_0 (ns),path_rgb_0,ts_depth_0 (ns),path_depth_0\n";
        fs::write(folder.join("rgb.csv"), header.to_owned() + &rows).unwrap();
        let poses =
            self.lines(|_, shot| format!("{},{}", shot.stamp_ns, tum_pose(&shot.t_world_cam).replace(' ', ",")));
        fs::write(folder.join("groundtruth.csv"), "ts (ns),tx (m),ty (m),tz (m),qx,qy,qz,qw\n".to_owned() + &poses)
            .unwrap();
        fs::write(folder.join("calibration.yaml"), self.orb_slam_settings(1.0)).unwrap();
    }
}

/// Returns `tx ty tz qx qy qz qw`.
fn tum_pose(pose: &Isometry3<f64>) -> String {
    let (t, q) = (pose.translation, pose.rotation);
    format!("{} {} {} {} {} {} {}", t.x, t.y, t.z, q.i, q.j, q.k, q.w)
}

/// Returns a 4 × 4 matrix with its rows separated by `between`.
fn matrix(pose: &Isometry3<f64>, between: &str) -> String {
    let m = pose.to_homogeneous();
    let row = |r: usize| (0..4).map(|c| format!("{:e}", m[(r, c)])).collect::<Vec<_>>().join(" ");
    (0..4).map(row).collect::<Vec<_>>().join(between)
}

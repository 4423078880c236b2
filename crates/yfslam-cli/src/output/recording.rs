//! `--record`: a recording of what a run has computed, as messages of ROS 2 in a file of MCAP.
//!
//! In: every frame after tracking. Out: topics with the overlay, the camera, the pose, the trajectory and the landmarks. The frame `map` has z
//! up; `world` is the camera frame of the first keyframe; `camera` is the optical frame of the camera.

use std::path::Path;

use anyhow::Result;
use nalgebra::{Isometry3, Matrix3, Matrix6, Translation3, UnitQuaternion};
use yfslam::{Camera, Frame, RgbImage, Slam, Tracked};
use yfslam_io::bag::write::{McapWriter, Topic};
use yfslam_io::message::encode;
use yfslam_io::message::types::{CameraInfo, CompressedImage, Header};
use yfslam_io::message::wire::{Wire, Writer};
use yfslam_io::write::encode_jpeg;

use super::overlay::state_of;

/// Quality of the images.
const QUALITY: u8 = 85;
/// Least time between two messages with the whole trajectory and all landmarks, ns.
const MAP_EVERY_NS: i64 = 1_000_000_000;
/// Most poses of a trajectory; of more, every n-th is written.
const MAX_POSES: usize = 2000;
/// Most landmarks; of more, every n-th is written.
const MAX_LANDMARKS: usize = 100_000;
/// Where the frame of the world has its z axis: forward; `map` has it up.
const MAP: &str = "map";
const WORLD: &str = "world";
const CAMERA: &str = "camera";

/// Writes the recording of one run.
pub struct Recording {
    writer: McapWriter,
    camera: CameraInfo,
    topics: Topics,
    /// Time of the last messages with the trajectory and the landmarks, ns.
    last_map_ns: Option<i64>,
}

struct Topics {
    image: Topic,
    camera: Topic,
    tf: Topic,
    tf_static: Topic,
    odometry: Topic,
    path: Topic,
    landmarks: Topic,
    state: Topic,
}

impl Recording {
    /// Begins a recording.
    ///
    /// # Errors
    /// The file cannot be written; this holds for all functions that follow.
    pub fn create(path: &Path, camera: &Camera) -> Result<Self> {
        let mut writer = McapWriter::create(path)?;
        let topics = Topics {
            image: writer.topic("/yfslam/overlay/compressed", "sensor_msgs/CompressedImage")?,
            camera: writer.topic("/yfslam/overlay/camera_info", "sensor_msgs/CameraInfo")?,
            tf: writer.topic("/tf", "tf2_msgs/TFMessage")?,
            tf_static: writer.topic("/tf_static", "tf2_msgs/TFMessage")?,
            odometry: writer.topic("/yfslam/odometry", "nav_msgs/Odometry")?,
            path: writer.topic("/yfslam/path", "nav_msgs/Path")?,
            landmarks: writer.topic("/yfslam/landmarks", "sensor_msgs/PointCloud2")?,
            state: writer.topic("/yfslam/state", "std_msgs/String")?,
        };
        Ok(Self { writer, camera: camera_info(camera), topics, last_map_ns: None })
    }

    /// Writes the messages of a frame, with its overlay.
    pub fn write(&mut self, overlay: &RgbImage, frame: &Frame, tracked: &Tracked, slam: &Slam) -> Result<()> {
        let Self { writer, topics, .. } = self;
        let stamp_ns = frame.timestamp_ns;
        let header = |frame_id| Header { stamp_ns, frame_id };
        if self.last_map_ns.is_none() {
            let message = encode::transform(header(MAP), WORLD, &t_map_world());
            writer.message(topics.tf_static, stamp_ns, &message)?;
        }
        let jpeg = encode_jpeg(overlay, QUALITY).unwrap_or_default();
        let mut message = Writer::new(Wire::Cdr, false);
        CompressedImage { header: header(CAMERA), format: "jpeg", data: &jpeg }.write(&mut message);
        writer.message(topics.image, stamp_ns, &message.finish())?;
        let mut message = Writer::new(Wire::Cdr, false);
        self.camera.write(stamp_ns, &mut message);
        writer.message(topics.camera, stamp_ns, &message.finish())?;
        if let Some(pose) = &tracked.t_world_cam {
            writer.message(topics.tf, stamp_ns, &encode::transform(header(WORLD), CAMERA, pose))?;
            let t_map_cam = t_map_world() * pose;
            let covariance = tracked.covariance.as_ref().map(|covariance| turned(&t_map_cam, covariance));
            let message = encode::odometry(header(MAP), CAMERA, &t_map_cam, covariance.as_ref());
            writer.message(topics.odometry, stamp_ns, &message)?;
        }
        let mut message = Writer::new(Wire::Cdr, false);
        message.string(&state_of(tracked));
        writer.message(topics.state, stamp_ns, &message.finish())?;
        let is_due = self.last_map_ns.is_none_or(|last_ns| stamp_ns.saturating_sub(last_ns) >= MAP_EVERY_NS);
        if is_due { self.write_map(stamp_ns, slam) } else { Ok(()) }
    }

    /// Ends the recording with the final trajectory and landmarks.
    pub fn finish(mut self, last_ns: i64, slam: &Slam) -> Result<()> {
        self.write_map(last_ns, slam)?;
        Ok(self.writer.finish()?)
    }

    fn write_map(&mut self, stamp_ns: i64, slam: &Slam) -> Result<()> {
        let Self { writer, topics, .. } = self;
        self.last_map_ns = Some(stamp_ns);
        let header = Header { stamp_ns, frame_id: MAP };
        let poses = slam.trajectory();
        let step = poses.len().div_ceil(MAX_POSES).max(1);
        let poses = poses.into_iter().step_by(step).map(|(stamp_ns, pose)| (stamp_ns, t_map_world() * pose));
        writer.message(topics.path, stamp_ns, &encode::path(header, &poses.collect::<Vec<_>>()))?;
        let map = slam.map();
        let step = map.landmarks().count().div_ceil(MAX_LANDMARKS).max(1);
        let landmarks = map.landmarks().step_by(step).map(|(_, landmark)| (landmark.position.coords, landmark.color));
        let points: Vec<_> = landmarks.map(|(at, color)| (at.map(|v| v as f32).into(), color)).collect();
        let header = Header { frame_id: WORLD, ..header };
        Ok(writer.message(topics.landmarks, stamp_ns, &encode::point_cloud(header, points.into_iter()))?)
    }
}

/// Returns the pose of the world in the frame with z up: x forward, y to the left (REP 103).
fn t_map_world() -> Isometry3<f64> {
    let axes = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_matrix(&axes))
}

/// Turns the covariance of a pose from the axes of the camera to those of the frame in which the pose is given.
fn turned(pose: &Isometry3<f64>, covariance: &Matrix6<f64>) -> Matrix6<f64> {
    let rotation = pose.rotation.to_rotation_matrix();
    let mut turn = Matrix6::zeros();
    turn.fixed_view_mut::<3, 3>(0, 0).copy_from(rotation.matrix());
    turn.fixed_view_mut::<3, 3>(3, 3).copy_from(rotation.matrix());
    turn * covariance * turn.transpose()
}

fn camera_info(camera: &Camera) -> CameraInfo {
    let Camera { width, height, fx, fy, cx, cy, distortion, rational, .. } = camera;
    let is_rational = *rational != [0.0; 3];
    CameraInfo {
        frame_id: CAMERA.to_owned(),
        height: u32::try_from(*height).unwrap_or(u32::MAX),
        width: u32::try_from(*width).unwrap_or(u32::MAX),
        distortion_model: if is_rational { "rational_polynomial" } else { "plumb_bob" }.to_owned(),
        d: distortion.iter().chain(rational.iter().filter(|_| is_rational)).copied().collect(),
        k: [*fx, 0.0, *cx, 0.0, *fy, *cy, 0.0, 0.0, 1.0],
        r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: [*fx, 0.0, *cx, 0.0, 0.0, *fy, *cy, 0.0, 0.0, 0.0, 1.0, 0.0],
        ..CameraInfo::default()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::*;

    #[test]
    fn forward_is_x_and_up_is_z_in_the_map() {
        let map = t_map_world();
        assert!((map * Vector3::z() - Vector3::x()).norm() < 1e-12);
        assert!((map * Point3::new(0.0, -2.0, 0.0) - Point3::new(0.0, 0.0, 2.0)).norm() < 1e-12);
        let along_z = Matrix6::from_diagonal(&[0.0, 0.0, 4.0, 0.0, 0.0, 9.0].into());
        let expected = Matrix6::from_diagonal(&[4.0, 0.0, 0.0, 9.0, 0.0, 0.0].into());
        assert!((turned(&map, &along_z) - expected).norm() < 1e-12);
    }
}

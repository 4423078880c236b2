//! Where the camera is on the robot, and with it where the map frame is.
//!
//! The map frame is that of the base at the first image of the map: z points up if the base stands level, which also levels a camera that
//! looks down. It follows from the map and the mount alone, so that it is the same in every session with this map.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion};

use crate::parameters::Parameters;
use crate::tf_tree::StaticTf;

/// The camera on the robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Mount {
    /// Frame whose pose is published.
    pub base_frame: String,
    /// Pose of the camera's optical frame in it.
    pub t_base_cam: Isometry3<f64>,
    /// Pose of the world of SLAM, which is the first camera, in the map frame.
    pub t_map_world: Isometry3<f64>,
    /// Whether the node has to publish the mount on `/tf_static`, because no other node does.
    pub is_ours: bool,
    pub origin: &'static str,
}

/// Returns the rotation of an optical frame (x right, y down, z forward) in a frame with x forward, y left, z up (REP 103).
pub fn optical() -> UnitQuaternion<f64> {
    let axes = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
}

impl Mount {
    /// Finds the mount of `camera_frame`; `None` while the transform may still come, that is unless `is_late`.
    ///
    /// # Errors
    /// The parameter camera_pose is no pose.
    pub fn find(
        parameters: &Parameters,
        tf: &StaticTf,
        camera_frame: &str,
        is_late: bool,
    ) -> Result<Option<Self>, String> {
        let base = parameters.text("base_frame");
        let mount = |t_base_cam, is_ours, origin| Self {
            base_frame: base.into(),
            t_base_cam,
            t_map_world: t_base_cam,
            is_ours,
            origin,
        };
        if base.is_empty() || base == camera_frame {
            let level = Isometry3::from_parts(Translation3::identity(), optical());
            return Ok(Some(Self {
                base_frame: camera_frame.into(),
                t_base_cam: Isometry3::identity(),
                t_map_world: level,
                is_ours: false,
                origin: "the base is the camera",
            }));
        }
        let given = parameters.text("camera_pose");
        if !given.trim().is_empty() {
            return Ok(Some(mount(parse_pose(given)?, true, "parameter camera_pose")));
        }
        if let Some(pose) = tf.lookup(base, camera_frame) {
            return Ok(Some(mount(pose, false, "/tf_static")));
        }
        let forward = Isometry3::from_parts(Translation3::identity(), optical());
        Ok(is_late.then(|| mount(forward, true, "assumed: the camera is at the base and looks forward")))
    }
}

/// Reads `x y z roll pitch yaw`, as `static_transform_publisher` has them.
fn parse_pose(text: &str) -> Result<Isometry3<f64>, String> {
    let numbers: Vec<f64> =
        text.split([' ', ',']).filter(|part| !part.is_empty()).map_while(|part| part.parse().ok()).collect();
    match numbers.as_slice() {
        [x, y, z, roll, pitch, yaw] if numbers.iter().all(|v| v.is_finite()) => {
            let rotation = UnitQuaternion::from_euler_angles(*roll, *pitch, *yaw);
            Ok(Isometry3::from_parts(Translation3::new(*x, *y, *z), rotation))
        }
        _ => Err(format!("camera_pose is '{text}'; give six numbers: x y z roll pitch yaw, in m and rad")),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::*;
    use crate::messages::{Header, TfMessage, TransformStamped};
    use crate::parameters::Value;

    #[test]
    fn what_is_ahead_of_a_camera_that_looks_down_is_ahead_and_below_in_the_map() {
        let mut parameters = Parameters::default();
        // 1 m above the base, 30 degrees down: an optical frame turned about y of the base.
        let t_base_cam = Isometry3::from_parts(
            Translation3::new(0.0, 0.0, 1.0),
            UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_6) * optical(),
        );
        let mut tf = StaticTf::default();
        tf.add(&TfMessage {
            transforms: vec![TransformStamped {
                header: Header::new(0, "base_link"),
                child_frame_id: "cam".into(),
                transform: t_base_cam.into(),
            }],
        });
        let mount = Mount::find(&parameters, &tf, "cam", false).unwrap().unwrap();
        let floor = mount.t_map_world * Point3::new(0.0, 0.0, 2.0);
        assert!((floor - Point3::new(1.732, 0.0, 0.0)).norm() < 1e-3, "{floor}");
        assert_eq!(Mount::find(&parameters, &StaticTf::default(), "cam", false), Ok(None));
        assert!(Mount::find(&parameters, &StaticTf::default(), "cam", true).unwrap().unwrap().is_ours);
        parameters.set("camera_pose", &Value::Text("0.1 0 0.2 -1.5708 0 -1.5708".into())).unwrap();
        let mount = Mount::find(&parameters, &tf, "cam", false).unwrap().unwrap();
        assert!((mount.t_base_cam * Point3::new(0.0, 0.0, 1.0) - Point3::new(1.1, 0.0, 0.2)).norm() < 1e-4);
        parameters.set("camera_pose", &Value::Text("1 2 3".into())).unwrap();
        assert!(Mount::find(&parameters, &tf, "cam", false).is_err());
    }
}

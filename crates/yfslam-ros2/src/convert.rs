//! From poses and maps to messages.

use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, Vector3};
use yfslam::{Camera, Map, Region};
use yfslam_live::{Health, LiveState};

use crate::inbox::Received;
use crate::messages::{
    Bytes, CompressedImage, DiagnosticArray, DiagnosticStatus, Header, KeyValue, Marker, MarkerArray, Odometry, Path,
    PointCloud2, PointField, PoseStamped, PoseWithCovariance, PoseWithCovarianceStamped, Rgba, Time, TransformStamped,
    TwistWithCovariance, Xyz, rows,
};
use crate::odom_split::OdomStep;

/// Variance of what is not known, m² and rad²: large, but such that filters can compute with it.
const UNKNOWN: f64 = 1e3;

/// Of `visualization_msgs/Marker`.
const CUBE: i32 = 1;
const DELETE_ALL: i32 = 3;
const LINE_LIST: i32 = 5;
const LINE_WIDTH_M: f64 = 0.01;

/// `FLOAT32` of `sensor_msgs/PointField`.
const FLOAT32: u8 = 7;

/// Returns the covariance of the pose of the base along the axes of the parent frame, from that of the camera along its own axes.
pub fn base_covariance(
    camera: Option<&Matrix6<f64>>,
    t_parent_cam: &Isometry3<f64>,
    t_base_cam: &Isometry3<f64>,
) -> Matrix6<f64> {
    let Some(camera) = camera else { return Matrix6::identity() * UNKNOWN };
    let turn = t_parent_cam.rotation.to_rotation_matrix().into_inner();
    // The base is at this point of the camera: it moves when the camera turns.
    let base_in_cam = t_base_cam.inverse().translation.vector;
    let mut jacobian = Matrix6::zeros();
    jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&turn);
    jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-turn * cross(&base_in_cam)));
    jacobian.fixed_view_mut::<3, 3>(3, 3).copy_from(&turn);
    jacobian * camera * jacobian.transpose()
}

fn cross(v: &Vector3<f64>) -> Matrix3<f64> {
    v.cross_matrix()
}

/// Returns the odometry of a frame. `covariance` is that of the base along the axes of `odom`; `drift` is what the path adds to it.
pub fn odometry(header: Header, base_frame: &str, step: &OdomStep, covariance: &Matrix6<f64>, drift: f64) -> Odometry {
    let gained = (drift * step.path_m).powi(2);
    // The velocity follows from two poses, which have about the same covariance.
    let turn = step.t_odom_base.rotation.inverse().to_rotation_matrix().into_inner();
    let mut to_base = Matrix6::zeros();
    to_base.fixed_view_mut::<3, 3>(0, 0).copy_from(&turn);
    to_base.fixed_view_mut::<3, 3>(3, 3).copy_from(&turn);
    let twist = match step.step_s {
        Some(step_s) if !step.has_jumped => to_base * covariance * to_base.transpose() * (2.0 / (step_s * step_s)),
        _ => Matrix6::identity() * UNKNOWN,
    };
    Odometry {
        header,
        child_frame_id: base_frame.into(),
        pose: PoseWithCovariance {
            pose: step.t_odom_base.into(),
            covariance: rows(&(covariance + Matrix6::identity() * gained)),
        },
        twist: TwistWithCovariance {
            linear: step.velocity.linear_m_s.into(),
            angular: step.velocity.angular_rad_s.into(),
            covariance: rows(&twist),
        },
    }
}

/// Returns a pose in the map.
pub fn pose(header: Header, pose: Isometry3<f64>, covariance: &Matrix6<f64>) -> PoseWithCovarianceStamped {
    PoseWithCovarianceStamped { header, pose: PoseWithCovariance { pose: pose.into(), covariance: rows(covariance) } }
}

/// Returns a transform.
pub fn transform(header: Header, child: &str, pose: Isometry3<f64>) -> TransformStamped {
    TransformStamped { header, child_frame_id: child.into(), transform: pose.into() }
}

/// Returns the poses of the base at the keyframes, in the order of time.
pub fn path(header: Header, map: &Map, t_map_world: &Isometry3<f64>, t_base_cam: &Isometry3<f64>) -> Path {
    let mut keyframes: Vec<_> = map.keyframes().map(|(_, keyframe)| keyframe).collect();
    keyframes.sort_by_key(|keyframe| keyframe.sequence);
    let poses = keyframes.iter().map(|keyframe| {
        let t_map_base = t_map_world * keyframe.t_cam_world.inverse() * t_base_cam.inverse();
        PoseStamped { header: Header::new(keyframe.timestamp_ns, &header.frame_id), pose: t_map_base.into() }
    });
    Path { poses: poses.collect(), header }
}

/// Returns the landmarks as points with colour.
pub fn landmarks(header: Header, map: &Map, t_map_world: &Isometry3<f64>) -> PointCloud2 {
    let mut data = Vec::new();
    let mut count = 0_u32;
    for (_, landmark) in map.landmarks() {
        let point = t_map_world * landmark.position;
        let [r, g, b] = landmark.color;
        data.extend(point.iter().flat_map(|v| (*v as f32).to_le_bytes()));
        // The three bytes of the colour in the place of a number, as PCL has it.
        data.extend([b, g, r, 0]);
        count += 1;
    }
    let field = |(offset, name): (u32, &str)| PointField { name: name.into(), offset, datatype: FLOAT32, count: 1 };
    PointCloud2 {
        header,
        height: 1,
        width: count,
        fields: [(0, "x"), (4, "y"), (8, "z"), (12, "rgb")].map(field).to_vec(),
        is_bigendian: false,
        point_step: 16,
        row_step: count.saturating_mul(16),
        data: Bytes(data),
        is_dense: true,
    }
}

/// Returns the graph of the keyframes as lines: the spanning tree, and the loops.
pub fn graph(header: &Header, map: &Map, t_map_world: &Isometry3<f64>) -> MarkerArray {
    let place = |id| {
        map.keyframe(id).map(|keyframe| t_map_world * Point3::from(keyframe.t_cam_world.inverse().translation.vector))
    };
    let (mut tree, mut loops) = (Vec::new(), Vec::new());
    for (id, keyframe) in map.keyframes() {
        let Some(from) = place(id) else { continue };
        tree.extend(keyframe.parent.and_then(place).into_iter().flat_map(|to| [from, to]));
        // Each loop is known to both of its ends.
        let others = keyframe.loop_edges.iter().filter(|other| **other > id);
        loops.extend(others.filter_map(|other| place(*other)).flat_map(|to| [from, to]));
    }
    let lines = |(id, (ns, points, color)): (usize, (&str, Vec<Point3<f64>>, Rgba))| Marker {
        kind: LINE_LIST,
        scale: Xyz { x: LINE_WIDTH_M, y: 0.0, z: 0.0 },
        color,
        points: points.iter().map(|point| point.coords.into()).collect(),
        ..marker(header, ns, id)
    };
    let grey = Rgba { r: 0.6, g: 0.6, b: 0.6, a: 1.0 };
    let green = Rgba { r: 0.1, g: 0.8, b: 0.2, a: 1.0 };
    MarkerArray {
        markers: [("tree", tree, grey), ("loops", loops, green)].into_iter().enumerate().map(lines).collect(),
    }
}

/// Returns what moves as boxes along the axes of the camera, where its depth is known. The first marker removes those of the last image.
pub fn people(header: &Header, regions: &[Region], camera: &Camera, t_map_cam: &Isometry3<f64>) -> MarkerArray {
    let mut markers = vec![Marker { action: DELETE_ALL, ..marker(header, "people", 0) }];
    for Region { bbox, score, depth_m, .. } in regions {
        let Some([near, far]) =
            depth_m.map(|depth| depth.map(f64::from)).filter(|[near, far]| *near > 0.0 && far > near)
        else {
            continue;
        };
        let middle = 0.5 * (near + far);
        let x = [bbox.x_min, bbox.x_max].map(|x| (f64::from(x) - camera.cx) / camera.fx * middle);
        let y = [bbox.y_min, bbox.y_max].map(|y| (f64::from(y) - camera.cy) / camera.fy * middle);
        let center = Isometry3::translation(0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1]), middle);
        markers.push(Marker {
            kind: CUBE,
            pose: (t_map_cam * center).into(),
            scale: Xyz { x: (x[1] - x[0]).abs(), y: (y[1] - y[0]).abs(), z: far - near },
            color: Rgba { r: 1.0, g: 0.2, b: 0.1, a: 0.2 + 0.4 * score.clamp(0.0, 1.0) },
            ..marker(header, "people", markers.len())
        });
    }
    MarkerArray { markers }
}

fn marker(header: &Header, ns: &str, id: usize) -> Marker {
    Marker {
        header: header.clone(),
        ns: ns.into(),
        id: i32::try_from(id).unwrap_or(i32::MAX),
        kind: 0,
        action: 0,
        pose: Isometry3::identity().into(),
        scale: Xyz::default(),
        color: Rgba::default(),
        lifetime: Time::default(),
        frame_locked: false,
        points: Vec::new(),
        colors: Vec::new(),
        texture_resource: String::new(),
        texture: CompressedImage::default(),
        uv_coordinates: Vec::new(),
        text: String::new(),
        mesh_resource: String::new(),
        mesh_file_name: String::new(),
        mesh_file_data: Bytes::default(),
        mesh_use_embedded_materials: false,
    }
}

/// What a diagnostic message says beside the health of the session.
#[derive(Clone, Debug, Default)]
pub struct NodeNotes {
    pub node: String,
    /// What keeps the node from working, such as a missing calibration.
    pub problem: Option<String>,
    pub received: Received,
    /// Time that the last grid took, ms, and its cells.
    pub grid: Option<(f64, usize)>,
    pub is_localising: bool,
}

/// Returns the diagnostics.
pub fn diagnostics(header: Header, health: Option<&Health>, notes: &NodeNotes) -> DiagnosticArray {
    let state = health.map_or(LiveState::WaitingForCamera, |health| health.state);
    let (level, message) = match (&notes.problem, health, state) {
        (Some(problem), ..) => (2, problem.clone()),
        (None, Some(health), _) if health.mapping_has_ended => {
            (2, "mapping has ended by a fault of the program".into())
        }
        (None, _, LiveState::Tracking) => (0, state.to_string()),
        (None, Some(health), LiveState::Lost | LiveState::Initialising) => {
            (1, health.lost_reason.map_or(state.to_string(), |reason| format!("{state}: {reason}")))
        }
        (None, _, LiveState::CameraSilent) => (2, state.to_string()),
        _ => (1, state.to_string()),
    };
    let mut values = vec![("state", state.to_string())];
    let ms =
        |time: Option<std::time::Duration>| time.map_or("-".into(), |time| format!("{:.1}", time.as_secs_f64() * 1e3));
    if let Some(health) = health {
        values.extend([
            ("camera rate, Hz", format!("{:.1}", health.camera_hz)),
            ("latency image to pose, median, ms", ms(health.latency_p50)),
            ("latency image to pose, 99 %, ms", ms(health.latency_p99)),
            ("tracking, median, ms", ms(health.tracking_p50)),
            ("frames", health.frames.to_string()),
            ("frames with a pose", health.tracked.to_string()),
            ("frames dropped for a newer one", health.dropped.to_string()),
            ("frames late or repeated", health.late.to_string()),
            ("frames that cannot be used", health.unusable.to_string()),
            ("last reason for that", health.last_unusable.clone().unwrap_or_default()),
            ("clock jumps", health.clock_jumps.to_string()),
            ("camera came back", health.camera_returns.to_string()),
            ("features", health.features.to_string()),
            ("inliers", health.inliers.to_string()),
            ("keyframes", health.keyframes.to_string()),
            ("landmarks", health.landmarks.to_string()),
            ("loops", health.loops.to_string()),
            ("maps begun anew", health.resets.to_string()),
        ]);
    }
    let received = &notes.received;
    values.extend([
        ("colour images", received.color.to_string()),
        ("depth images", received.depth.to_string()),
        ("pairs", received.pairs.to_string()),
        ("colour images without depth", received.unpaired[0].to_string()),
        ("messages that cannot be read", received.damaged.to_string()),
        ("map", if notes.is_localising { "stays as it is" } else { "is extended" }.into()),
    ]);
    if let Some((took_ms, cells)) = notes.grid {
        values.extend([("grid, ms", format!("{took_ms:.1}")), ("grid, cells", cells.to_string())]);
    }
    let values = values.into_iter().map(|(key, value)| KeyValue { key: key.into(), value }).collect();
    let name = format!("{}: SLAM", notes.node.trim_start_matches('/'));
    DiagnosticArray {
        header,
        status: vec![DiagnosticStatus { level, name, message, hardware_id: "yfslam".into(), values }],
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector6};

    use super::*;

    #[test]
    fn the_covariance_of_the_base_follows_from_that_of_the_camera_by_small_motions() {
        let t_parent_cam = Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.3, -0.7, 0.2));
        let t_base_cam = Isometry3::new(Vector3::new(0.2, 0.0, 0.5), Vector3::new(-1.2, 1.2, -1.2));
        let sigma = Vector6::new(0.01, 0.02, 0.03, 0.001, 0.002, 0.003);
        let found =
            base_covariance(Some(&Matrix6::from_diagonal(&sigma.component_mul(&sigma))), &t_parent_cam, &t_base_cam);
        // By finite differences: the change of the base when the camera moves along each of its axes.
        let base = t_parent_cam * t_base_cam.inverse();
        let mut jacobian = Matrix6::zeros();
        let step = 1e-6;
        for axis in 0..6 {
            let mut delta = Vector6::zeros();
            delta[axis] = step;
            let turn = UnitQuaternion::from_scaled_axis(delta.fixed_rows::<3>(3).into_owned());
            let moved = t_parent_cam
                * Isometry3::from_parts(delta.fixed_rows::<3>(0).into_owned().into(), turn)
                * t_base_cam.inverse();
            let column = Vector6::from_iterator(
                (moved.translation.vector - base.translation.vector)
                    .iter()
                    .copied()
                    .chain((moved.rotation * base.rotation.inverse()).scaled_axis().iter().copied())
                    .map(|v| v / step),
            );
            jacobian.set_column(axis, &column);
        }
        let expected = jacobian * Matrix6::from_diagonal(&sigma.component_mul(&sigma)) * jacobian.transpose();
        assert!((found - expected).norm() < 1e-6 * expected.norm(), "{found} {expected}");
    }

    #[test]
    fn what_moves_is_a_box_where_its_depth_is_and_nothing_where_it_is_not_known() {
        let camera = Camera::pinhole(640, 480, 500.0, 500.0, 320.0, 240.0);
        let bbox = yfslam::BoundingBox { x_min: 320.0, y_min: 140.0, x_max: 420.0, y_max: 340.0 };
        let region = |depth_m| Region { bbox, score: 0.9, misses: 0, depth_m };
        let regions = [region(Some([1.8, 2.2])), region(None)];
        let up = Isometry3::translation(0.0, 0.0, 5.0);
        let markers = people(&Header::default(), &regions, &camera, &up).markers;
        assert_eq!((markers.len(), markers[0].action, markers[1].kind), (2, DELETE_ALL, CUBE));
        let (place, size) = (markers[1].pose.position, markers[1].scale);
        let near =
            |found: Xyz, x: f64, y: f64, z: f64| (found.x - x).abs() + (found.y - y).abs() + (found.z - z).abs() < 1e-6;
        assert!(near(place, 0.2, 0.0, 7.0) && near(size, 0.4, 0.8, 0.4), "{place:?} {size:?}");
    }

    #[test]
    fn a_pose_without_covariance_is_marked_as_unknown() {
        let one = Isometry3::identity();
        assert_eq!(base_covariance(None, &one, &one)[(0, 0)], UNKNOWN);
    }

    #[test]
    fn diagnostics_say_what_is_wrong() {
        let notes = NodeNotes { problem: Some("no camera_info on /x".into()), ..NodeNotes::default() };
        let array = diagnostics(Header::default(), None, &notes);
        assert_eq!((array.status[0].level, array.status[0].message.as_str()), (2, "no camera_info on /x"));
        let waiting = diagnostics(Header::default(), None, &NodeNotes::default());
        assert_eq!((waiting.status[0].level, waiting.status[0].message.as_str()), (1, "waiting for the camera"));
    }
}

//! Messages of ROS 2 that programs for display read, with the text of their types.
//!
//! In: poses and points. Out: the bytes of a message in CDR, and the definition of its type as `ros2msg` text.

use nalgebra::{Isometry3, Matrix6};

use super::types::Header;
use super::wire::{Wire, Writer};

/// The types, each with its fields and the types that these need.
const DEFINITIONS: [(&str, &str, &[&str]); 21] = [
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec", &[]),
    ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id", &["builtin_interfaces/Time"]),
    ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z", &[]),
    ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z", &[]),
    ("geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1", &[]),
    (
        "geometry_msgs/Pose",
        "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation",
        &["geometry_msgs/Point", "geometry_msgs/Quaternion"],
    ),
    ("geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose pose\nfloat64[36] covariance", &["geometry_msgs/Pose"]),
    (
        "geometry_msgs/PoseStamped",
        "std_msgs/Header header\ngeometry_msgs/Pose pose",
        &["std_msgs/Header", "geometry_msgs/Pose"],
    ),
    ("geometry_msgs/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular", &["geometry_msgs/Vector3"]),
    (
        "geometry_msgs/TwistWithCovariance",
        "geometry_msgs/Twist twist\nfloat64[36] covariance",
        &["geometry_msgs/Twist"],
    ),
    (
        "geometry_msgs/Transform",
        "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation",
        &["geometry_msgs/Vector3", "geometry_msgs/Quaternion"],
    ),
    (
        "geometry_msgs/TransformStamped",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform",
        &["std_msgs/Header", "geometry_msgs/Transform"],
    ),
    ("tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms", &["geometry_msgs/TransformStamped"]),
    (
        "nav_msgs/Odometry",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist",
        &["std_msgs/Header", "geometry_msgs/PoseWithCovariance", "geometry_msgs/TwistWithCovariance"],
    ),
    (
        "nav_msgs/Path",
        "std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses",
        &["std_msgs/Header", "geometry_msgs/PoseStamped"],
    ),
    ("sensor_msgs/PointField", "string name\nuint32 offset\nuint8 datatype\nuint32 count", &[]),
    (
        "sensor_msgs/PointCloud2",
        "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\nbool is_bigendian\nuint32 point_step\n\
         uint32 row_step\nuint8[] data\nbool is_dense",
        &["std_msgs/Header", "sensor_msgs/PointField"],
    ),
    (
        "sensor_msgs/RegionOfInterest",
        "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify",
        &[],
    ),
    (
        "sensor_msgs/CameraInfo",
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\nfloat64[9] r\n\
         float64[12] p\nuint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi",
        &["std_msgs/Header", "sensor_msgs/RegionOfInterest"],
    ),
    ("sensor_msgs/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data", &["std_msgs/Header"]),
    ("std_msgs/String", "string data", &[]),
];

/// Returns the definition of a type such as `nav_msgs/Odometry` with those of all types in it; `None` for a type that is not known.
pub fn definition(name: &str) -> Option<String> {
    let find = |name: &str| DEFINITIONS.iter().find(|(known, ..)| *known == name);
    let (_, fields, needs) = find(name)?;
    let mut text = format!("{fields}\n");
    let mut waiting: Vec<&str> = needs.iter().rev().copied().collect();
    let mut written: Vec<&str> = Vec::new();
    while let Some(next) = waiting.pop() {
        if written.contains(&next) {
            continue;
        }
        written.push(next);
        let (_, fields, needs) = find(next)?;
        text += &format!("{}\nMSG: {next}\n{fields}\n", "=".repeat(80));
        waiting.extend(needs.iter().rev());
    }
    Some(text)
}

fn begin(header: Header) -> Writer {
    let mut to = Writer::new(Wire::Cdr, false);
    header.write(&mut to);
    to
}

fn position_and_rotation(pose: &Isometry3<f64>, to: &mut Writer) {
    let (t, q) = (pose.translation.vector, pose.rotation.coords);
    to.f64s(&[t.x, t.y, t.z, q.x, q.y, q.z, q.w]);
}

/// Encodes a `nav_msgs/Odometry`: the pose of `child` in the frame of the header, with the covariance along the axes of that frame, of
/// (translation, rotation). The velocity is not known, which its covariance says.
pub fn odometry(header: Header, child: &str, pose: &Isometry3<f64>, covariance: Option<&Matrix6<f64>>) -> Vec<u8> {
    const UNKNOWN: f64 = 1e9;
    let unknown = Matrix6::from_diagonal_element(UNKNOWN);
    let mut to = begin(header);
    to.string(child);
    position_and_rotation(pose, &mut to);
    to.f64s(covariance.unwrap_or(&unknown).as_slice());
    to.f64s(&[0.0; 6]);
    to.f64s(unknown.as_slice());
    to.finish()
}

/// Encodes a `tf2_msgs/TFMessage` with one transform.
pub fn transform(header: Header, child: &str, t_parent_child: &Isometry3<f64>) -> Vec<u8> {
    let mut to = Writer::new(Wire::Cdr, false);
    to.u32(1);
    header.write(&mut to);
    to.string(child);
    position_and_rotation(t_parent_child, &mut to);
    to.finish()
}

/// Encodes a `nav_msgs/Path`; each pose has its time, ns.
pub fn path(header: Header, poses: &[(i64, Isometry3<f64>)]) -> Vec<u8> {
    let mut to = begin(header);
    to.u32(u32::try_from(poses.len()).unwrap_or(u32::MAX));
    for (stamp_ns, pose) in poses.iter().take(u32::MAX as usize) {
        Header { stamp_ns: *stamp_ns, ..header }.write(&mut to);
        position_and_rotation(pose, &mut to);
    }
    to.finish()
}

/// Encodes a `sensor_msgs/PointCloud2` with the fields x, y, z and rgb.
pub fn point_cloud(header: Header, points: impl ExactSizeIterator<Item = ([f32; 3], [u8; 3])>) -> Vec<u8> {
    /// Datatype of numbers in floating point of 32 bits.
    const FLOAT32: u8 = 7;
    const POINT_BYTES: u32 = 16;
    let count = u32::try_from(points.len()).unwrap_or(u32::MAX);
    let mut to = begin(header);
    to.u32(1);
    to.u32(count);
    to.u32(4);
    for (name, offset) in [("x", 0), ("y", 4), ("z", 8), ("rgb", 12)] {
        to.string(name);
        to.u32(offset);
        to.u8(FLOAT32);
        to.u32(1);
    }
    to.u8(0);
    to.u32(POINT_BYTES);
    to.u32(POINT_BYTES.saturating_mul(count));
    let mut data = Vec::with_capacity(POINT_BYTES as usize * points.len());
    for (position, [r, g, b]) in points {
        data.extend(position.into_iter().flat_map(f32::to_le_bytes));
        // Programs read the colour as the bits of a number, blue first.
        data.extend([b, g, r, 0]);
    }
    to.bytes(&data);
    to.u8(1);
    to.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::types::Transform;
    use crate::message::wire::Reader;

    #[test]
    fn a_definition_has_every_type_that_it_needs_once() {
        for (name, ..) in DEFINITIONS {
            let text = definition(name).unwrap();
            let mut parts: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("MSG: ")).collect();
            let count = parts.len();
            parts.sort_unstable();
            parts.dedup();
            assert_eq!(parts.len(), count, "{name}");
            let is_known = |kind: &str| !kind.contains('/') || parts.contains(&kind.trim_end_matches("[]"));
            let fields = text.lines().filter(|line| !line.starts_with("MSG") && !line.starts_with('='));
            assert!(fields.filter_map(|line| line.split(' ').next()).all(is_known), "{text}");
        }
        assert_eq!(definition("std_msgs/Nothing"), None);
    }

    #[test]
    fn the_reader_of_recordings_reads_odometry_and_transforms() {
        let pose = Isometry3::new([1.0, -2.0, 0.5].into(), [0.1, 0.2, -0.3].into());
        let header = Header { stamp_ns: 1_500_000_007, frame_id: "map" };
        let bytes = odometry(header, "camera", &pose, None);
        let read = Transform::read_with_child(&mut Reader::new(Wire::Cdr, &bytes).unwrap()).unwrap();
        assert_eq!((read.stamp_ns, read.parent.as_str(), read.child.as_str()), (1_500_000_007, "map", "camera"));
        assert!((read.t_parent_child.inverse() * pose).translation.vector.norm() < 1e-12);
        // Header and child with padding, then 7 + 36 + 6 + 36 numbers.
        assert_eq!(bytes.len(), 4 + 32 + 8 * 85);
    }
}

//! The messages of ROS that a recording for SLAM has, read and written in either form.
//!
//! In: the bytes of a message. Out: its fields; texts and pixels are borrowed.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use super::wire::{Reader, Wire, WireError, Writer};

/// `std_msgs/Header`: when and in which frame something was measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Header<'a> {
    /// Time of the measurement, ns.
    pub stamp_ns: i64,
    /// Name of the frame.
    pub frame_id: &'a str,
}

impl<'a> Header<'a> {
    /// Reads a header.
    ///
    /// # Errors
    /// The message is shorter than its fields; this holds for all messages.
    pub fn read(from: &mut Reader<'a>) -> Result<Self, WireError> {
        if from.wire() == Wire::Ros1 {
            from.u32("seq")?;
        }
        Ok(Self { stamp_ns: from.time_ns("stamp")?, frame_id: from.string("frame_id")? })
    }

    /// Writes a header; the sequence number of ROS 1 is 0.
    pub fn write(&self, to: &mut Writer) {
        if to.wire() == Wire::Ros1 {
            to.u32(0);
        }
        to.time_ns(self.stamp_ns);
        to.string(self.frame_id);
    }
}

/// `sensor_msgs/Image`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Image<'a> {
    /// Time and frame.
    pub header: Header<'a>,
    /// Rows.
    pub height: u32,
    /// Pixels per row.
    pub width: u32,
    /// How a pixel is stored, such as `rgb8` or `16UC1`.
    pub encoding: &'a str,
    /// Whether the bytes of a pixel of 16 or 32 bits begin with the highest.
    pub is_bigendian: bool,
    /// Bytes per row.
    pub step: u32,
    /// The pixels.
    pub data: &'a [u8],
}

impl<'a> Image<'a> {
    /// Reads an image.
    pub fn read(from: &mut Reader<'a>) -> Result<Self, WireError> {
        let image = Self::read_head(from)?;
        let (is_bigendian, step) = (from.u8("is_bigendian")? != 0, from.u32("step")?);
        Ok(Self { is_bigendian, step, data: from.bytes("data")?, ..image })
    }

    /// Reads the fields up to the encoding.
    pub fn read_head(from: &mut Reader<'a>) -> Result<Self, WireError> {
        let header = Header::read(from)?;
        let (height, width) = (from.u32("height")?, from.u32("width")?);
        Ok(Self { header, height, width, encoding: from.string("encoding")?, ..Default::default() })
    }

    /// Writes an image.
    pub fn write(&self, to: &mut Writer) {
        self.header.write(to);
        to.u32(self.height);
        to.u32(self.width);
        to.string(self.encoding);
        to.u8(u8::from(self.is_bigendian));
        to.u32(self.step);
        to.bytes(self.data);
    }
}

/// `sensor_msgs/CompressedImage`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CompressedImage<'a> {
    /// Time and frame.
    pub header: Header<'a>,
    /// How the image is stored, such as `jpeg` or `16UC1; compressedDepth png`.
    pub format: &'a str,
    /// The file.
    pub data: &'a [u8],
}

impl<'a> CompressedImage<'a> {
    /// Reads a compressed image.
    pub fn read(from: &mut Reader<'a>) -> Result<Self, WireError> {
        let image = Self::read_head(from)?;
        Ok(Self { data: from.bytes("data")?, ..image })
    }

    /// Reads the fields up to the format.
    pub fn read_head(from: &mut Reader<'a>) -> Result<Self, WireError> {
        Ok(Self { header: Header::read(from)?, format: from.string("format")?, data: &[] })
    }

    /// Writes a compressed image.
    pub fn write(&self, to: &mut Writer) {
        self.header.write(to);
        to.string(self.format);
        to.bytes(self.data);
    }
}

/// `sensor_msgs/CameraInfo`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraInfo {
    /// Name of the frame of the camera.
    pub frame_id: String,
    /// Rows.
    pub height: u32,
    /// Pixels per row.
    pub width: u32,
    /// Name of the distortion model, such as `plumb_bob`.
    pub distortion_model: String,
    /// Parameters of the distortion.
    pub d: Vec<f64>,
    /// Intrinsic matrix of the images as they are, row by row.
    pub k: [f64; 9],
    /// Rotation from the camera to the rectified camera, row by row.
    pub r: [f64; 9],
    /// Projection of the rectified images, row by row.
    pub p: [f64; 12],
    /// How many pixels of the sensor make one of the image, along the row and along the column; 0 means 1.
    pub binning: [u32; 2],
    /// Part of the sensor that the image shows: x, y, height, width; zeros mean all of it.
    pub roi: [u32; 4],
}

impl CameraInfo {
    /// Reads the calibration of a camera.
    pub fn read(from: &mut Reader<'_>) -> Result<Self, WireError> {
        let header = Header::read(from)?;
        let (height, width) = (from.u32("height")?, from.u32("width")?);
        let distortion_model = from.string("distortion_model")?.to_owned();
        let count = from.length("D", 8)?;
        let d = (0..count).map(|_| from.f64("D")).collect::<Result<_, _>>()?;
        let (k, r, p) = (from.f64s("K")?, from.f64s("R")?, from.f64s("P")?);
        let binning = [from.u32("binning_x")?, from.u32("binning_y")?];
        let roi = [from.u32("roi")?, from.u32("roi")?, from.u32("roi")?, from.u32("roi")?];
        Ok(Self { frame_id: header.frame_id.into(), height, width, distortion_model, d, k, r, p, binning, roi })
    }

    /// Writes the calibration with the time `stamp_ns`.
    pub fn write(&self, stamp_ns: i64, to: &mut Writer) {
        Header { stamp_ns, frame_id: &self.frame_id }.write(to);
        to.u32(self.height);
        to.u32(self.width);
        to.string(&self.distortion_model);
        to.u32(self.d.len() as u32);
        to.f64s(&self.d);
        to.f64s(&self.k);
        to.f64s(&self.r);
        to.f64s(&self.p);
        self.binning.iter().chain(&self.roi).for_each(|&value| to.u32(value));
        to.u8(0);
    }
}

/// A pose with its time and frames, as several messages have it.
#[derive(Clone, Debug, PartialEq)]
pub struct Transform {
    /// Time, ns.
    pub stamp_ns: i64,
    /// The frame in which the pose is given.
    pub parent: String,
    /// The frame whose pose it is; empty where the message does not name it.
    pub child: String,
    /// Transforms points of the child into the parent.
    pub t_parent_child: Isometry3<f64>,
}

impl Transform {
    /// Reads a `geometry_msgs/PoseStamped` or `PoseWithCovarianceStamped`.
    pub fn read_pose_stamped(from: &mut Reader<'_>) -> Result<Self, WireError> {
        let header = Header::read(from)?;
        Self::read_after(from, header, "")
    }

    /// Reads a `geometry_msgs/TransformStamped` or `nav_msgs/Odometry`.
    pub fn read_with_child(from: &mut Reader<'_>) -> Result<Self, WireError> {
        let header = Header::read(from)?;
        let child = from.string("child_frame_id")?;
        Self::read_after(from, header, child)
    }

    /// Reads a `tf2_msgs/TFMessage`.
    pub fn read_tf(from: &mut Reader<'_>) -> Result<Vec<Self>, WireError> {
        // Two texts and a time precede the seven numbers.
        let count = from.length("transforms", 7 * 8 + 16)?;
        (0..count).map(|_| Self::read_with_child(from)).collect()
    }

    fn read_after(from: &mut Reader<'_>, header: Header<'_>, child: &str) -> Result<Self, WireError> {
        let ([x, y, z], [i, j, k, w]) = (from.f64s("translation")?, from.f64s("rotation")?);
        // A rotation of zeros is what a sender leaves that never set it.
        let rotation = UnitQuaternion::try_new(Quaternion::new(w, i, j, k), 1e-6).unwrap_or_default();
        let t_parent_child = Isometry3::from_parts(Translation3::new(x, y, z), rotation);
        Ok(Self { stamp_ns: header.stamp_ns, parent: header.frame_id.into(), child: child.into(), t_parent_child })
    }

    /// Writes a `geometry_msgs/PoseStamped`.
    pub fn write_pose_stamped(&self, to: &mut Writer) {
        Header { stamp_ns: self.stamp_ns, frame_id: &self.parent }.write(to);
        self.write_numbers(to);
    }

    /// Writes a `geometry_msgs/TransformStamped`.
    pub fn write_transform_stamped(&self, to: &mut Writer) {
        Header { stamp_ns: self.stamp_ns, frame_id: &self.parent }.write(to);
        to.string(&self.child);
        self.write_numbers(to);
    }

    /// Writes a `nav_msgs/Odometry` without covariances and velocities.
    pub fn write_odometry(&self, to: &mut Writer) {
        self.write_transform_stamped(to);
        to.f64s(&[0.0; 36 + 6 + 36]);
    }

    /// Writes a `tf2_msgs/TFMessage`.
    pub fn write_tf(transforms: &[Self], to: &mut Writer) {
        to.u32(transforms.len() as u32);
        transforms.iter().for_each(|transform| transform.write_transform_stamped(to));
    }

    fn write_numbers(&self, to: &mut Writer) {
        to.f64s(self.t_parent_child.translation.vector.as_slice());
        // Stored as x, y, z, w, as in the message.
        to.f64s(self.t_parent_child.rotation.coords.as_slice());
    }
}

/// Returns the name of a frame without the slash that early versions of tf wrote.
pub fn frame_name(frame: &str) -> String {
    frame.trim_start_matches('/').to_owned()
}

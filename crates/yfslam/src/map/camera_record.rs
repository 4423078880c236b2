//! A camera in the records of saved maps, which have no field names.

use std::fmt;

use serde::de::{Error, SeqAccess, Visitor};
use serde::ser::SerializeTuple;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::camera::Camera;

/// Written in the place of the depth factor: files are then the same as those of earlier programs for cameras like those of TUM.
const RESERVED: f64 = 5000.0;

/// Written in its place if k4, k5 and k6 follow at the end of the record. No depth factor is negative.
const RATIONAL: f64 = -8.0;

/// A camera in a format without field names, in which only the last field, k4 to k6, is optional.
#[derive(Debug)]
pub(crate) struct CameraRecord(Camera);

impl CameraRecord {
    pub(crate) fn of(camera: &Camera) -> Self {
        Self(camera.clone())
    }

    /// Returns the camera.
    ///
    /// # Errors
    /// No camera can have the calibration: a file may have been written by anyone.
    pub(crate) fn into_camera(self) -> Result<Camera, String> {
        self.0.check().map_err(|error| format!("the camera: {error}"))?;
        Ok(self.0)
    }
}

impl Serialize for CameraRecord {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self(camera) = self;
        let is_rational = camera.rational != [0.0; 3];
        let mut record = serializer.serialize_tuple(if is_rational { 7 } else { 6 })?;
        record.serialize_element(&[camera.width as u32, camera.height as u32])?;
        record.serialize_element(&[camera.fx, camera.fy, camera.cx, camera.cy])?;
        record.serialize_element(&camera.distortion)?;
        record.serialize_element(if is_rational { &RATIONAL } else { &RESERVED })?;
        record.serialize_element(&camera.fps)?;
        record.serialize_element(&camera.bf)?;
        if is_rational {
            record.serialize_element(&camera.rational)?;
        }
        record.end()
    }
}

impl<'de> Deserialize<'de> for CameraRecord {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_tuple(7, RecordVisitor)
    }
}

struct RecordVisitor;

impl<'de> Visitor<'de> for RecordVisitor {
    type Value = CameraRecord;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a camera")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut fields: A) -> Result<CameraRecord, A::Error> {
        fn field<'de, T: Deserialize<'de>, A: SeqAccess<'de>>(fields: &mut A) -> Result<T, A::Error> {
            fields.next_element()?.ok_or_else(|| A::Error::custom("the camera is incomplete"))
        }
        let [width, height]: [u32; 2] = field(&mut fields)?;
        let [fx, fy, cx, cy]: [f64; 4] = field(&mut fields)?;
        let mut camera = Camera::pinhole(width as usize, height as usize, fx, fy, cx, cy);
        camera.distortion = field(&mut fields)?;
        let reserved: f64 = field(&mut fields)?;
        camera.fps = field(&mut fields)?;
        camera.bf = field(&mut fields)?;
        if reserved == RATIONAL {
            camera.rational = field(&mut fields)?;
        }
        Ok(CameraRecord(camera))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_with_a_polynomial_takes_the_bytes_it_always_took_and_a_rational_one_is_read_back() {
        let camera =
            Camera::pinhole(640, 480, 535.4, 539.2, 320.1, 247.6).with_distortion([0.1, -0.2, 0.001, 0.002, 0.0]);
        let bytes = postcard::to_allocvec(&CameraRecord::of(&camera)).unwrap();
        let parts = ([640u32, 480], [535.4, 539.2, 320.1, 247.6], [0.1, -0.2, 0.001, 0.002, 0.0], 5000.0, 30.0, 40.0);
        assert_eq!(bytes, postcard::to_allocvec(&parts).unwrap());
        for camera in [camera.clone(), Camera { rational: [0.3, 0.0, 0.02], ..camera }] {
            // The record stands among others.
            let bytes = postcard::to_allocvec(&(CameraRecord::of(&camera), 7u64)).unwrap();
            let (record, next): (CameraRecord, u64) = postcard::from_bytes(&bytes).unwrap();
            assert_eq!((record.0, next), (camera, 7));
        }
    }
}

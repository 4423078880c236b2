//! The map frame: the axes in which everything that is made of a map is written.

#[cfg(feature = "persist")]
use nalgebra::Quaternion;
use nalgebra::UnitQuaternion;

use crate::dense::{DenseMap, Up, gravity};
#[cfg(feature = "persist")]
use crate::map::container::{ContainerError, FRAME, PackedSection};

/// The frame `map`: z points up, x to the front of the first image, y to its left (ROS, REP 103); the origin is that of the world of the
/// keyframes, the first camera. It is fixed when a map is saved for the first time, and later sessions keep it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapFrame {
    /// Turns the world of the keyframes into this frame.
    pub r_map_world: UnitQuaternion<f64>,
    /// What gave the up direction: [`Up::Level`], or [`Up::Camera`] where no surfaces were measured.
    pub up: Up,
}

impl Default for MapFrame {
    /// Returns the frame of a map whose first image was upright.
    fn default() -> Self {
        Self { r_map_world: gravity::of_camera(), up: Up::Camera }
    }
}

impl MapFrame {
    /// Returns the frame whose z-axis is perpendicular to the level surfaces of a dense map; that of the camera if it is empty.
    pub(crate) fn of_dense_map(dense_map: &DenseMap) -> Self {
        if dense_map.patches.is_empty() {
            return Self::default();
        }
        Self { r_map_world: dense_map.turn(Up::Level), up: Up::Level }
    }

    /// Returns the section of a saved map.
    ///
    /// # Errors
    /// If it cannot be encoded, which would be a fault of this program.
    #[cfg(feature = "persist")]
    pub(crate) fn to_bytes(self) -> Result<Vec<u8>, ContainerError> {
        let [x, y, z, w] = self.r_map_world.coords.into();
        FRAME.pack(&([x, y, z, w], self.up == Up::Level))
    }

    /// Reads the section of a saved map.
    ///
    /// # Errors
    /// If the records cannot be deserialised, or do not hold a rotation.
    #[cfg(feature = "persist")]
    pub(crate) fn from_section(packed: PackedSection<'_>) -> Result<Self, ContainerError> {
        let ([x, y, z, w], is_level): ([f64; 4], bool) = packed.unpack()?;
        let quaternion = Quaternion::new(w, x, y, z);
        let error = (quaternion.norm() - 1.0).abs();
        if error.is_nan() || error > 1e-6 {
            let what = format!("the map frame has the rotation {x} {y} {z} {w}, which is no unit quaternion");
            return Err(ContainerError::Records(what));
        }
        // Not normalised again: the frame of a map stays the same bits over any number of sessions.
        let r_map_world = UnitQuaternion::new_unchecked(quaternion);
        Ok(Self { r_map_world, up: if is_level { Up::Level } else { Up::Camera } })
    }
}

#[cfg(all(test, feature = "persist"))]
mod tests {
    use super::*;

    #[test]
    fn a_frame_read_back_is_the_same_and_a_wrong_rotation_is_refused() {
        let r_map_world = UnitQuaternion::from_euler_angles(0.1, -0.4, 1.3);
        let frame = MapFrame { r_map_world, up: Up::Level };
        let read = |bytes: &[u8]| MapFrame::from_section(FRAME.split(bytes).unwrap().0);
        assert_eq!(read(&frame.to_bytes().unwrap()).unwrap(), frame);
        for wrong in [[0.0; 4], [0.5, 0.5, 0.5, f64::NAN], [2.0, 0.0, 0.0, 0.0]] {
            let error = read(&FRAME.pack(&(wrong, true)).unwrap()).unwrap_err().to_string();
            assert!(error.contains("no unit quaternion"), "{error}");
        }
    }
}

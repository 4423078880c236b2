//! Saved maps: keyframes and landmarks as bytes.
//!
//! In: a map, and the camera and feature configuration with which it was made. Out: bytes; and the reverse. The records hold only what
//! cannot be computed: search grids, observation lists and covisibility are computed when a map is read. This module does not access files.

use nalgebra::{Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use slotmap::SecondaryMap;

use crate::camera::Camera;
use crate::config::{Config, FeatureConfig};
use crate::features::{Descriptor, Feature, FrameFeatures, ImageBounds, OrbExtractor};
use crate::geometry::Pose;
use crate::map::camera_record::CameraRecord;
use crate::map::container::{MAP, Sections};
use crate::map::{KeyFrameId, LandmarkId, Map};

/// Reason why bytes cannot be read as a saved map.
pub use crate::map::container::ContainerError as MapError;

/// A map with the camera and the feature configuration with which it was made.
#[derive(Clone, Debug)]
pub(crate) struct MapParts {
    /// Map.
    pub map: Map,
    /// Camera.
    pub camera: Camera,
    /// Feature configuration; with another one descriptors would not match.
    pub features: FeatureConfig,
}

#[derive(Serialize, Deserialize)]
struct Records {
    camera: CameraRecord,
    features: FeatureConfig,
    keyframes_ever: u64,
    keyframes: Vec<KeyFrameRecord>,
    landmarks: Vec<LandmarkRecord>,
}

#[derive(Serialize, Deserialize)]
struct KeyFrameRecord {
    timestamp_ns: i64,
    sequence: u64,
    /// `t_cam_world`: x y z, quaternion x y z w.
    pose: [f64; 7],
    features: Vec<FeatureRecord>,
    /// Index of the landmark that each feature observes.
    landmarks: Vec<Option<u32>>,
    parent: Option<u32>,
    loop_edges: Vec<u32>,
}

#[derive(Serialize, Deserialize)]
struct FeatureRecord {
    raw: [f32; 2],
    undistorted: [f32; 2],
    octave: u8,
    angle_rad: f32,
    depth_m: Option<f32>,
    trust: f32,
    descriptor: [u8; 32],
}

#[derive(Serialize, Deserialize)]
struct LandmarkRecord {
    position: [f64; 3],
    reference: u32,
    born: u64,
    visible: u32,
    found: u32,
    color: [u8; 3],
}

/// Returns the map as bytes.
///
/// # Errors
/// If serialisation fails, which would be a fault of this program.
pub(crate) fn encode(map: &Map, camera: &Camera, features: &FeatureConfig) -> Result<Vec<u8>, MapError> {
    MAP.of_camera(camera).pack(&Records::of(map, camera, features))
}

/// Reads and checks a map. The sections before it are verified and skipped.
///
/// # Errors
/// If the bytes are not a map, have another version, are truncated or altered, or if the records are inconsistent.
pub(crate) fn decode(bytes: &[u8]) -> Result<MapParts, MapError> {
    let packed = Sections::of(bytes, MAP)?.map.ok_or(MapError::Foreign(MAP.magic))?;
    packed.unpack::<Records>()?.into_map().map_err(MapError::Records)
}

impl Records {
    fn of(map: &Map, camera: &Camera, features: &FeatureConfig) -> Self {
        // In the order of insertion, so that the bytes do not depend on removed items in the arenas.
        let mut keyframes: Vec<(u64, KeyFrameId)> = map.keyframes().map(|(id, k)| (k.sequence, id)).collect();
        keyframes.sort_unstable();
        let number = |i: usize| i as u32;
        let keyframe_index: SecondaryMap<KeyFrameId, u32> =
            keyframes.iter().enumerate().map(|(i, (_, id))| (*id, number(i))).collect();
        let landmark_index: SecondaryMap<LandmarkId, u32> =
            map.landmarks().enumerate().map(|(i, (id, _))| (id, number(i))).collect();
        let of_keyframe = |id: &KeyFrameId| keyframe_index.get(*id).copied();
        Self {
            camera: CameraRecord::of(camera),
            features: features.clone(),
            keyframes_ever: map.keyframes_ever(),
            keyframes: keyframes
                .iter()
                .filter_map(|(_, id)| map.keyframe(*id))
                .map(|k| KeyFrameRecord {
                    timestamp_ns: k.timestamp_ns,
                    sequence: k.sequence,
                    pose: pose_record(&k.t_cam_world),
                    features: k.features.features.iter().zip(&k.features.descriptors).map(FeatureRecord::of).collect(),
                    landmarks: k.landmarks.iter().map(|l| landmark_index.get((*l)?).copied()).collect(),
                    parent: k.parent.as_ref().and_then(of_keyframe),
                    loop_edges: k.loop_edges.iter().filter_map(of_keyframe).collect(),
                })
                .collect(),
            landmarks: map
                .landmarks()
                .map(|(_, l)| LandmarkRecord {
                    position: l.position.coords.into(),
                    reference: of_keyframe(&l.reference).unwrap_or(u32::MAX),
                    born: l.born,
                    visible: l.visible,
                    found: l.found,
                    color: l.color,
                })
                .collect(),
        }
    }

    fn into_map(self) -> Result<MapParts, String> {
        let camera = self.camera.into_camera()?;
        let config = Config { features: self.features.clone(), ..Default::default() };
        config.validate().map_err(|error| error.to_string())?;
        let extractor = OrbExtractor::new(&self.features);
        let scale_factors = extractor.scale_factors();
        let bounds = ImageBounds::of(&camera);
        let mut map = Map::default();
        let mut ids = Vec::with_capacity(self.keyframes.len());
        for (i, record) in self.keyframes.iter().enumerate() {
            if record.landmarks.len() != record.features.len() {
                let (features, landmarks) = (record.features.len(), record.landmarks.len());
                return Err(format!(
                    "keyframe {i} has {features} features but {landmarks} entries for their landmarks"
                ));
            }
            let pose = pose_of(&record.pose)
                .ok_or_else(|| format!("the pose of keyframe {i} is invalid: {:?}", record.pose))?;
            let (features, descriptors) = record.features.iter().map(FeatureRecord::feature).unzip();
            ids.push(map.restore_keyframe(
                record.timestamp_ns,
                record.sequence,
                pose,
                FrameFeatures::from_parts(features, descriptors, bounds),
            ));
        }
        map.restore_count(self.keyframes_ever)?;
        let mut observers: Vec<Vec<(KeyFrameId, usize)>> = vec![Vec::new(); self.landmarks.len()];
        for (id, record) in ids.iter().zip(&self.keyframes) {
            for (feature, landmark) in record.landmarks.iter().enumerate() {
                let Some(landmark) = *landmark else { continue };
                let observers = observers.get_mut(landmark as usize);
                observers
                    .ok_or_else(|| {
                        format!("a feature observes landmark {landmark}, but there are only {}", self.landmarks.len())
                    })?
                    .push((*id, feature));
            }
        }
        for (i, (record, observations)) in self.landmarks.iter().zip(&observers).enumerate() {
            let position = Point3::from(record.position);
            let reference = ids.get(record.reference as usize).copied();
            let first = observations.iter().find(|(k, _)| Some(*k) == reference);
            let (Some(&(keyframe, feature)), true) = (first, position.coords.iter().all(|c| c.is_finite())) else {
                return Err(format!(
                    "landmark {i} at {position} is not observed by its reference keyframe {}",
                    record.reference
                ));
            };
            let restored = map.insert_landmark(position, keyframe, feature, record.color, scale_factors);
            let id = restored.ok_or_else(|| format!("landmark {i} cannot be inserted"))?;
            for (keyframe, feature) in observations {
                map.add_observation(id, *keyframe, *feature);
            }
            map.restore_history(id, record.born, record.visible, record.found);
            map.update_landmark(id, scale_factors);
        }
        for (id, record) in ids.iter().zip(&self.keyframes) {
            let of_number = |number: &u32| ids.get(*number as usize).copied();
            let missing =
                |number: u32| format!("a keyframe refers to keyframe {number}, but there are only {}", ids.len());
            if let Some(parent) = record.parent {
                map.restore_parent(*id, of_number(&parent).ok_or_else(|| missing(parent))?)?;
            }
            for number in &record.loop_edges {
                map.add_loop_edge(*id, of_number(number).ok_or_else(|| missing(*number))?);
            }
        }
        for id in &ids {
            map.update_covisibility(*id);
        }
        map.validate()?;
        Ok(MapParts { map, camera, features: self.features })
    }
}

impl FeatureRecord {
    fn of((feature, descriptor): (&Feature, &Descriptor)) -> Self {
        let mut bytes = [0; 32];
        for (chunk, word) in bytes.chunks_exact_mut(8).zip(&descriptor.0) {
            chunk.copy_from_slice(&word.to_le_bytes());
        }
        Self {
            raw: feature.raw,
            undistorted: [feature.u, feature.v],
            octave: feature.octave,
            angle_rad: feature.angle_rad,
            depth_m: feature.depth_m,
            trust: feature.trust,
            descriptor: bytes,
        }
    }

    fn feature(&self) -> (Feature, Descriptor) {
        let mut words = [0; 4];
        for (word, chunk) in words.iter_mut().zip(self.descriptor.as_chunks::<8>().0) {
            *word = u64::from_le_bytes(*chunk);
        }
        let [u, v] = self.undistorted;
        let Self { raw, octave, angle_rad, depth_m, trust, .. } = *self;
        (Feature { raw, u, v, octave, angle_rad, depth_m, trust }, Descriptor(words))
    }
}

pub(crate) fn pose_record(pose: &Pose) -> [f64; 7] {
    let (t, q) = (pose.translation.vector, pose.rotation.coords);
    [t.x, t.y, t.z, q.x, q.y, q.z, q.w]
}

pub(crate) fn pose_of([x, y, z, i, j, k, w]: &[f64; 7]) -> Option<Pose> {
    let quaternion = Quaternion::new(*w, *i, *j, *k);
    let is_valid = Vector3::new(*x, *y, *z).iter().all(|c| c.is_finite()) && (quaternion.norm() - 1.0).abs() < 1e-6;
    // The quaternion is not normalised again, so that a map that is read has the same bits as the map that was written.
    is_valid.then(|| Pose::from_parts(Translation3::new(*x, *y, *z), UnitQuaternion::new_unchecked(quaternion)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::se3_exp;
    use nalgebra::Vector6;

    fn camera() -> Camera {
        Camera::pinhole(640, 480, 535.4, 539.2, 320.1, 247.6).with_distortion([0.1, -0.2, 0.001, 0.002, 0.0])
    }

    /// Returns a map of five keyframes and forty landmarks, from which one of each was removed.
    fn map() -> Map {
        let mut map = Map::default();
        let scales = [1.0, 1.2, 1.44, 1.728, 2.07, 2.49, 2.99, 3.58];
        let mut landmarks = Vec::new();
        let mut removed = None;
        for k in 0..5u32 {
            let features = (0..50u32).map(|i| Feature {
                raw: [i as f32, k as f32],
                u: 12.0 * i as f32,
                v: 9.0 * i as f32,
                octave: (i % 8) as u8,
                angle_rad: 0.1 * i as f32,
                depth_m: (i % 3 > 0).then_some(1.0 + 0.1 * i as f32),
                trust: 1.0,
            });
            let descriptors = (0..50).map(|i| Descriptor([i, u64::MAX / (i + 1), u64::from(k), i << 40]));
            let parts =
                FrameFeatures::from_parts(features.collect(), descriptors.collect(), ImageBounds::of(&camera()));
            let pose = se3_exp(&(Vector6::new(0.1, 0.0, 0.02, 0.0, 0.03, 0.0) * f64::from(k)));
            let id = map.insert_keyframe(i64::from(k) * 1_000_000_007, pose, parts);
            for i in 0..40usize {
                if k == 0 {
                    let position = Point3::new(0.1 * i as f64 - 2.0, 0.3, 3.0 + 0.01 * i as f64);
                    landmarks.extend(map.insert_landmark(position, id, i, [i as u8, 2, 3], &scales));
                } else {
                    map.add_observation(landmarks[i], id, i);
                    map.update_landmark(landmarks[i], &scales);
                }
            }
            map.update_covisibility(id);
            removed = if k == 2 { Some(id) } else { removed };
        }
        let ids: Vec<KeyFrameId> = map.keyframes().map(|(id, _)| id).collect();
        map.add_loop_edge(ids[0], ids[4]);
        assert!(removed.is_some_and(|id| map.remove_keyframe(id)));
        map.remove_landmark(landmarks[7]);
        map
    }

    #[test]
    fn a_map_that_is_read_equals_the_map_that_was_written() {
        let (map, features) = (map(), FeatureConfig::default());
        let bytes = encode(&map, &camera(), &features).unwrap();
        let read = decode(&bytes).unwrap();
        assert_eq!((&read.camera, &read.features), (&camera(), &features));
        assert_eq!((read.map.keyframe_count(), read.map.landmark_count()), (4, 39));
        assert_eq!(read.map.keyframes_ever(), 5);
        for ((_, a), (_, b)) in map.keyframes().zip(read.map.keyframes()) {
            assert_eq!((a.timestamp_ns, a.sequence, a.t_cam_world), (b.timestamp_ns, b.sequence, b.t_cam_world));
            assert_eq!(a.features.features, b.features.features);
            assert_eq!(a.features.descriptors, b.features.descriptors);
            assert_eq!((a.parent.is_some(), a.loop_edges.len()), (b.parent.is_some(), b.loop_edges.len()));
        }
        for ((_, a), (_, b)) in map.landmarks().zip(read.map.landmarks()) {
            assert_eq!((a.position, a.color, a.visible), (b.position, b.color, b.visible));
            assert_eq!(a.observations.len(), b.observations.len());
        }
        assert_eq!(encode(&read.map, &read.camera, &read.features).unwrap(), bytes);
    }

    #[test]
    fn truncated_bytes_and_flipped_bits_are_refused() {
        let bytes = encode(&map(), &camera(), &FeatureConfig::default()).unwrap();
        for length in (0..bytes.len()).step_by(97).chain(0..40) {
            assert!(decode(&bytes[..length]).is_err(), "truncated to {length} bytes");
        }
        for bit in (0..8 * bytes.len()).step_by(53).chain(0..8 * 64) {
            let mut altered = bytes.clone();
            altered[bit / 8] ^= 1 << (bit % 8);
            assert!(decode(&altered).is_err(), "bit {bit} flipped");
        }
    }

    #[test]
    fn errors_describe_what_is_wrong_with_the_bytes() {
        let bytes = encode(&map(), &camera(), &FeatureConfig::default()).unwrap();
        assert_eq!(decode(b"PK\x03\x04").unwrap_err(), MapError::Foreign(MAP.magic));
        let mut newer = bytes.clone();
        newer[MAP.magic.len()] = 9;
        assert_eq!(decode(&newer).unwrap_err(), MapError::Version { magic: MAP.magic, found: 9, version: MAP.version });
        let announced = bytes.len() as u64;
        assert_eq!(decode(&bytes[..100]).unwrap_err(), MapError::Length { found: 100, announced });
    }
}

//! The dense map as bytes, as `yfslam run --dense` saves it.
//!
//! In: a dense map. Out: bytes, and back. The bytes are a file of their own, or the first part of a saved map, before the part of
//! [`crate::map::persist`], whose keyframes they name. The map frame follows in a section of its own. Depth and colour are stored as differences to the cell on the left, which
//! compress better.

use serde::{Deserialize, Serialize};

use crate::dense::keyframe_patch::{CellGrid, KeyframePatch};
use crate::dense::{DenseMap, MapFrame, PlacedPatch};
use crate::map::camera_record::CameraRecord;
use crate::map::container::{ContainerError, DENSE_MAP, Sections};
use crate::map::persist::{pose_of, pose_record};

/// Most cells of a map without patches.
const MAX_CELLS: usize = 1 << 22;

#[derive(Serialize, Deserialize)]
struct Records {
    camera: CameraRecord,
    stride_px: u32,
    /// Names of the classes of patches, from class 1 on.
    class_names: Vec<String>,
    patches: Vec<PatchRecord>,
    /// With their index among all patches.
    unmerged: Vec<(u32, PatchRecord)>,
}

#[derive(Serialize, Deserialize)]
struct PatchRecord {
    timestamp_ns: i64,
    keyframe: u64,
    /// `t_world_cam`: x y z, quaternion x y z w.
    pose: [f64; 7],
    depth: Vec<i16>,
    color: Vec<u8>,
    /// As in the patch: empty, or one for each cell.
    class: Vec<u8>,
}

/// Encodes a dense map.
///
/// # Errors
/// If it cannot be encoded, which would be a fault of this program.
pub(super) fn encode(dense_map: &DenseMap) -> Result<Vec<u8>, ContainerError> {
    let mut bytes = DENSE_MAP.of_camera(dense_map.grid.camera()).pack(&Records {
        camera: CameraRecord::of(dense_map.grid.camera()),
        stride_px: dense_map.grid.stride_px() as u32,
        class_names: dense_map.class_names.clone(),
        patches: dense_map.patches.iter().map(PatchRecord::of).collect(),
        unmerged: dense_map.unmerged.iter().map(|(at, placed)| (*at as u32, PatchRecord::of(placed))).collect(),
    })?;
    if let Some(frame) = &dense_map.frame {
        bytes.extend(frame.to_bytes()?);
    }
    Ok(bytes)
}

/// Decodes and checks the dense map in `bytes`: a file of its own, or part of a saved map.
///
/// # Errors
/// If the bytes are not a dense map, are of another version, truncated, altered or inconsistent, or are a map without a dense map.
pub(super) fn decode(bytes: &[u8]) -> Result<DenseMap, ContainerError> {
    let sections = Sections::of(bytes, DENSE_MAP)?;
    let packed = sections.dense_map.ok_or(ContainerError::NoPieces)?;
    let Records { camera, stride_px, class_names, patches, unmerged } = packed.unpack()?;
    let frame = sections.frame.map(MapFrame::from_section).transpose()?;
    let camera = camera.into_camera().map_err(ContainerError::Records)?;
    let invalid = |what: String| Err(ContainerError::Records(what));
    if stride_px == 0 || stride_px as usize > camera.width.min(camera.height) {
        return invalid(format!("cells of {stride_px} px in an image of {} × {}", camera.width, camera.height));
    }
    // The grid is allocated from these numbers, so each patch must have as many cells, and a map without patches a usual number.
    let cells = (camera.width / stride_px as usize) * (camera.height / stride_px as usize);
    let all = || patches.iter().chain(unmerged.iter().map(|(_, record)| record));
    if cells > MAX_CELLS && all().all(|record| record.depth.len() != cells) {
        return invalid(format!("there are no patches with the {cells} cells that its camera has"));
    }
    let grid = CellGrid::new(&camera, stride_px as usize);
    let patch = |record: PatchRecord| record.into_patch(&grid, class_names.len());
    let patches = patches.into_iter().map(patch).collect::<Result<_, _>>()?;
    let unmerged = unmerged.into_iter().map(|(at, record)| Ok((at as usize, patch(record)?)));
    let unmerged = unmerged.collect::<Result<_, _>>()?;
    Ok(DenseMap { patches, unmerged, grid, class_names, frame })
}

impl PatchRecord {
    fn of(placed: &PlacedPatch) -> Self {
        let KeyframePatch { depth, color, class } = &placed.patch;
        let (mut last_depth, mut last_color) = (0u16, [0u8; 3]);
        Self {
            timestamp_ns: placed.timestamp_ns,
            keyframe: placed.keyframe,
            pose: pose_record(&placed.t_world_cam),
            depth: depth.iter().map(|&d| d.wrapping_sub(std::mem::replace(&mut last_depth, d)) as i16).collect(),
            color: color
                .iter()
                .flat_map(|&rgb| {
                    let last = std::mem::replace(&mut last_color, rgb);
                    [0, 1, 2].map(|channel| rgb[channel].wrapping_sub(last[channel]))
                })
                .collect(),
            class: class.clone(),
        }
    }

    fn into_patch(self, grid: &CellGrid, classes: usize) -> Result<PlacedPatch, ContainerError> {
        let cells = grid.columns() * grid.rows();
        if self.depth.len() != cells || self.color.len() != 3 * cells {
            let (depth, color) = (self.depth.len(), self.color.len());
            return Err(ContainerError::Records(format!(
                "the patch of keyframe {} has {depth} depths and {color} colour values for {cells} cells",
                self.keyframe
            )));
        }
        let unnamed = self.class.iter().find(|class| usize::from(**class) > classes);
        if let Some(class) = unnamed.filter(|_| self.class.len() == cells) {
            return Err(ContainerError::Records(format!("class {class} has no name: there are {classes} names")));
        }
        if self.class.len() != cells && !self.class.is_empty() {
            let (found, keyframe) = (self.class.len(), self.keyframe);
            return Err(ContainerError::Records(format!("{found} classes for {cells} cells of keyframe {keyframe}")));
        }
        let Some(t_world_cam) = pose_of(&self.pose) else {
            let Self { keyframe, pose, .. } = self;
            return Err(ContainerError::Records(format!(
                "the pose of the patch of keyframe {keyframe} is not valid: {pose:?}"
            )));
        };
        let (mut depth, mut color) = (0u16, [0u8; 3]);
        let depths = self.depth.iter().map(|&step| {
            depth = depth.wrapping_add(step as u16);
            depth
        });
        let depth = depths.collect();
        let colors = self.color.as_chunks::<3>().0.iter().map(|step| {
            color = [0, 1, 2].map(|channel| color[channel].wrapping_add(step[channel]));
            color
        });
        let color = colors.collect();
        let Self { timestamp_ns, keyframe, class, .. } = self;
        Ok(PlacedPatch { timestamp_ns, keyframe, t_world_cam, patch: KeyframePatch { depth, color, class } })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::*;
    use crate::config::FeatureConfig;
    use crate::dense::scene;
    use crate::map::Map;
    use crate::map::container::MAP;
    use crate::map::scene::Scene;

    fn dense_map() -> DenseMap {
        let grid = CellGrid::new(&scene::camera(), 4);
        let patch = |number: i64| PlacedPatch {
            timestamp_ns: number * 1_000_000_007,
            keyframe: 2 * number as u64,
            t_world_cam: Isometry3::new(Vector3::new(0.1 * number as f64, 0.0, 0.3), Vector3::y() * 0.2),
            patch: scene::wall(&grid, 2.5, Some(1.0 + 0.1 * number as f32)),
        };
        let mut patches: Vec<_> = (0..3).map(patch).collect();
        patches[1].patch.color.iter_mut().enumerate().for_each(|(i, rgb)| *rgb = [i as u8, (i * 7) as u8, 255]);
        patches[2].patch.depth.iter_mut().for_each(|d| *d |= 1 << 15);
        patches[0].patch = patches[0].patch.clone().with_classes(&grid, |[x, _]| u8::from(x < 20.0) * 2);
        let class_names = vec!["chair".to_owned(), "tv".to_owned()];
        let frame = Some(MapFrame::default());
        DenseMap { patches, unmerged: vec![(1, patch(7))], grid, class_names, frame }
    }

    /// Returns the bytes of a map of one keyframe.
    fn map() -> Vec<u8> {
        let (scene, mut map) = (Scene::new(), Map::default());
        scene.add(&mut map, 0, &scene.pose(0), &[]);
        crate::map::persist::encode(&map, &scene.sensor.camera, &FeatureConfig::default()).unwrap()
    }

    #[test]
    fn a_dense_map_read_back_equals_the_one_that_was_written() {
        let dense_map = dense_map();
        let read = decode(&encode(&dense_map).unwrap()).unwrap();
        assert_eq!(read, dense_map);
    }

    #[test]
    fn a_camera_that_no_lens_has_and_a_grid_without_patches_are_refused_before_they_take_memory() {
        let records = |camera: crate::Camera| {
            let camera = CameraRecord::of(&camera);
            let (class_names, patches, unmerged) = (Vec::new(), Vec::new(), Vec::new());
            DENSE_MAP.pack(&Records { camera, stride_px: 1, class_names, patches, unmerged }).unwrap()
        };
        let pinhole = crate::Camera::pinhole;
        for (camera, expected) in [
            (pinhole(45, 660_907, 500.0, 500.0, 20.0, 300.0), "height is 660907"),
            (pinhole(640, 480, 500.0, 500.0, 320.0, 1e9), "cy is 1000000000"),
            (pinhole(16_384, 16_384, 16e3, 16e3, 8e3, 8e3), "no patches with the 268435456 cells"),
        ] {
            let error = decode(&records(camera)).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }

    #[test]
    fn a_class_without_a_name_is_refused() {
        let mut dense_map = dense_map();
        dense_map.class_names.truncate(1);
        let error = decode(&encode(&dense_map).unwrap()).unwrap_err().to_string();
        assert!(error.contains("class 2 has no name"), "{error}");
    }

    #[test]
    fn a_saved_map_holds_the_map_and_the_dense_map() {
        let (patches, map) = (encode(&dense_map()).unwrap(), map());
        let both = [patches.clone(), map.clone()].concat();
        assert_eq!(decode(&both).unwrap(), dense_map());
        assert_eq!(crate::map::persist::decode(&both).unwrap().map.keyframe_count(), 1);
        assert_eq!(decode(&map).unwrap_err(), ContainerError::NoPieces);
        let error = crate::map::persist::decode(&patches).unwrap_err();
        assert_eq!(error, ContainerError::Foreign(MAP.magic), "a dense map alone has no landmarks");
    }

    #[test]
    fn truncation_and_flipped_bits_are_detected() {
        let patches = encode(&dense_map()).unwrap();
        let both = [patches.clone(), map()].concat();
        for length in (0..both.len()).step_by(97).filter(|length| *length != patches.len()) {
            assert!(decode(&both[..length]).is_err(), "cut to {length} bytes");
        }
        for length in (0..both.len()).step_by(97).chain([patches.len()]) {
            assert!(crate::map::persist::decode(&both[..length]).is_err(), "cut to {length} bytes");
        }
        for bit in (0..8 * both.len()).step_by(101) {
            let mut altered = both.clone();
            altered[bit / 8] ^= 1 << (bit % 8);
            assert!(decode(&altered).is_err(), "bit {bit} flipped");
            assert!(crate::map::persist::decode(&altered).is_err(), "bit {bit} flipped");
        }
    }

    #[test]
    fn an_earlier_version_is_refused_with_its_number() {
        let mut bytes = encode(&dense_map()).unwrap();
        bytes[DENSE_MAP.magic.len()] = 1;
        let error = decode(&bytes).unwrap_err().to_string();
        assert!(error.contains("version 1"), "{error}");
    }
}

//! Features, landmarks and keyframes as arrays.

use std::collections::BTreeMap;

use numpy::PyArray1;
use pyo3::prelude::*;
use yfslam::{Feature, KeyFrame, KeyFrameId, Landmark, Map, Pose, Region};

use crate::arrays::{self, rows};
use crate::results::tuple;

/// A landmark in numbers.
pub struct LandmarkRow {
    position: [f64; 3],
    color: [u8; 3],
    observations: u32,
}

/// A keyframe in numbers.
pub struct KeyframeRow {
    id: KeyFrameId,
    timestamp_ns: i64,
    sequence: u64,
    t_world_cam: Pose,
    covisible: Vec<(KeyFrameId, usize)>,
    loop_edges: Vec<KeyFrameId>,
}

/// The last frame in numbers.
pub struct FeatureRows {
    pub features: Vec<Feature>,
    pub matched: Vec<bool>,
}

/// Copies the landmarks of a map.
pub fn landmark_rows(map: &Map) -> Vec<LandmarkRow> {
    let row = |landmark: &Landmark| LandmarkRow {
        position: landmark.position.coords.into(),
        color: landmark.color,
        observations: u32::try_from(landmark.observations.len()).unwrap_or(u32::MAX),
    };
    map.landmarks().map(|(_, landmark)| row(landmark)).collect()
}

/// Copies the keyframes of a map, in the order of their insertion.
pub fn keyframe_rows(map: &Map) -> Vec<KeyframeRow> {
    let row = |(id, keyframe): (KeyFrameId, &KeyFrame)| KeyframeRow {
        id,
        timestamp_ns: keyframe.timestamp_ns,
        sequence: keyframe.sequence,
        t_world_cam: keyframe.t_cam_world.inverse(),
        covisible: keyframe.covisible.clone(),
        loop_edges: keyframe.loop_edges.clone(),
    };
    let mut rows: Vec<KeyframeRow> = map.keyframes().map(row).collect();
    rows.sort_by_key(|row| row.sequence);
    rows
}

pub fn landmarks<'py>(py: Python<'py>, of: &[LandmarkRow]) -> PyResult<Bound<'py, PyAny>> {
    let positions = rows(py, of.iter().map(|row| row.position))?;
    let colors = rows(py, of.iter().map(|row| row.color))?;
    let observations = PyArray1::from_iter(py, of.iter().map(|row| row.observations));
    tuple(py, "Landmarks", (positions, colors, observations))
}

pub fn keyframes<'py>(py: Python<'py>, of: &[KeyframeRow]) -> PyResult<Bound<'py, PyAny>> {
    let index: BTreeMap<KeyFrameId, i64> = (0..).zip(of).map(|(at, row)| (row.id, at)).collect();
    let stamps = PyArray1::from_iter(py, of.iter().map(|row| row.timestamp_ns));
    let poses = arrays::poses(py, of.iter().map(|row| row.t_world_cam))?;
    // Each edge once.
    let edges = |row: &KeyframeRow, others: &[(KeyFrameId, usize)]| -> Vec<[i64; 3]> {
        let from = index.get(&row.id).copied();
        let edge = |(other, weight): &(KeyFrameId, usize)| {
            let (from, to) = (from?, *index.get(other)?);
            (from < to).then_some([from, to, i64::try_from(*weight).unwrap_or(i64::MAX)])
        };
        others.iter().filter_map(edge).collect()
    };
    let covisible = rows(py, of.iter().flat_map(|row| edges(row, &row.covisible)))?;
    let loops = of.iter().flat_map(|row| {
        let others: Vec<(KeyFrameId, usize)> = row.loop_edges.iter().map(|other| (*other, 0)).collect();
        edges(row, &others).into_iter().map(|[from, to, _]| [from, to]).collect::<Vec<_>>()
    });
    let loops = rows(py, loops)?;
    tuple(py, "Keyframes", (stamps, poses, covisible, loops))
}

pub fn features<'py>(py: Python<'py>, of: &FeatureRows) -> PyResult<Bound<'py, PyAny>> {
    let of_features = || of.features.iter();
    let pixels = rows(py, of_features().map(|feature| feature.raw))?;
    let depth_m = PyArray1::from_iter(py, of_features().map(|feature| feature.depth_m.unwrap_or(f32::NAN)));
    let trust = PyArray1::from_iter(py, of_features().map(|feature| feature.trust));
    let matched = PyArray1::from_iter(py, of.matched.iter().copied());
    tuple(py, "Features", (pixels, depth_m, trust, matched))
}

/// Returns regions that move as N × 6: x_min, y_min, x_max, y_max, least and greatest depth in m; NaN where the whole box moves.
pub fn regions<'py>(py: Python<'py>, of: &[Region]) -> PyResult<Bound<'py, PyAny>> {
    let row = |region: &Region| {
        let [near, far] = region.depth_m.unwrap_or([f32::NAN; 2]);
        [region.bbox.x_min, region.bbox.y_min, region.bbox.x_max, region.bbox.y_max, near, far]
    };
    Ok(rows(py, of.iter().map(row))?.into_any())
}

//! Measures how many synthetic people the official detector finds. In: worlds. Out: the numbers of visible and of found people, per
//! condition. A person counts if the box of the visible pixels is taller than 30 % of the image, and is found if a detection of
//! class `person` with a score of at least 0.3 overlaps that box with an IoU of at least 0.5; each detection finds one person.
#![allow(dead_code, clippy::unwrap_used, reason = "shared by a test and an example, of which each uses a part")]

use std::collections::BTreeMap;
use std::path::PathBuf;

use yfslam::{BoundingBox, Detection, Detector};
use yfslam_detect::{DetectorConfig, YoloFastestV2};
use yfslam_synth::{SynthFrame, World};

/// Least height of a person, relative to the image.
pub const TALL: f32 = 0.3;
/// Least overlap.
pub const IOU: f32 = 0.5;

/// Returns the official model if the data folder has it.
pub fn official_detector() -> Option<YoloFastestV2> {
    let beside = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let data = std::env::var_os("YFSLAM_DATA").map_or(beside, PathBuf::from);
    let path = data.join("models/yolo-fastestv2-coco.onnx");
    path.is_file().then(|| YoloFastestV2::load(&path, &DetectorConfig::default()).unwrap())
}

/// A visible person and the overlap of the detection that found it.
#[derive(Clone, Copy, Debug)]
pub struct VisiblePerson {
    pub instance: u8,
    pub bbox: BoundingBox,
    /// Distance of the nearest visible pixel, m.
    pub nearest_m: f32,
    /// Share of the box that the person's pixels fill.
    pub filled: f32,
    pub found: bool,
}

impl VisiblePerson {
    /// Returns the conditions of the person: one of distance, one of truncation.
    pub fn circumstances(&self, width: f32, height: f32) -> [&'static str; 2] {
        let b = &self.bbox;
        let distance = match self.nearest_m {
            z if z < 1.0 => "nearer than 1 m",
            z if z < 2.0 => "1 m to 2 m",
            _ => "farther than 2 m",
        };
        let sides = usize::from(b.x_min <= 0.0) + usize::from(b.x_max >= width);
        let cut = match (b.y_min <= 0.0, b.y_max >= height, sides) {
            (false, false, 0) => "whole",
            (false, true, 0) => "cut below",
            (true, _, 0) => "head cut off",
            (false, _, _) => "cut at a side",
            (true, _, _) => "head cut off and at a side",
        };
        [distance, cut]
    }
}

/// Returns all people in `shot` who are tall enough, and whether `detections` find them.
pub fn visible_people(shot: &SynthFrame, detections: &[Detection]) -> Vec<VisiblePerson> {
    let height = shot.instances.height() as f32;
    let mut pairs = Vec::new();
    let people: Vec<(u8, BoundingBox)> = shot
        .boxes
        .iter()
        .filter(|(_, class, b)| *class == 0 && b.y_max - b.y_min > TALL * height)
        .map(|&(instance, _, bbox)| (instance, bbox))
        .collect();
    for (p, (_, bbox)) in people.iter().enumerate() {
        for (d, detection) in detections.iter().enumerate().filter(|(_, d)| d.class == 0) {
            let iou = detection.bbox.iou(bbox);
            if iou >= IOU {
                pairs.push((iou, p, d));
            }
        }
    }
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (mut found, mut used) = (vec![false; people.len()], vec![false; detections.len()]);
    for (_, p, d) in pairs {
        if !found[p] && !used[d] {
            (found[p], used[d]) = (true, true);
        }
    }
    let pixels = || shot.instances.data().iter().zip(shot.exact_depth.data());
    let visible_person = |(&(instance, bbox), found): (&(u8, BoundingBox), bool)| {
        let own = || pixels().filter(|(k, _)| **k == instance);
        let nearest_m = own().map(|(_, z)| *z).fold(f32::INFINITY, f32::min);
        let filled = own().count() as f32 / bbox.area();
        VisiblePerson { instance, bbox, nearest_m, filled, found }
    };
    people.iter().zip(found).map(visible_person).collect()
}

/// Numbers of visible people and of found ones.
#[derive(Clone, Copy, Debug, Default)]
pub struct Count {
    pub seen: usize,
    pub found: usize,
}

impl Count {
    /// Counts one person.
    pub fn add(&mut self, found: bool) {
        self.seen += 1;
        self.found += usize::from(found);
    }

    /// Returns the share that was found; 1 without people.
    pub fn recall(&self) -> f64 {
        if self.seen == 0 { 1.0 } else { self.found as f64 / self.seen as f64 }
    }
}

/// Counts per world and per condition.
pub type Table = BTreeMap<String, Count>;

/// Adds the visible people of every `step`-th frame to `table`; `each` is called for every frame.
pub fn measure(
    world: &World,
    name: &str,
    step: usize,
    detector: &mut YoloFastestV2,
    table: &mut Table,
    mut each: impl FnMut(usize, &SynthFrame, &[Detection], &[VisiblePerson]),
) {
    let mut detections = Vec::new();
    for index in (0..world.len()).step_by(step) {
        let shot = world.frame(index);
        detector.detect(&shot.frame.color, &mut detections).unwrap();
        let seen = visible_people(&shot, &detections);
        for s in &seen {
            let [distance, cut] = s.circumstances(shot.instances.width() as f32, shot.instances.height() as f32);
            for key in [name, "all", distance, cut] {
                table.entry(key.to_owned()).or_default().add(s.found);
            }
            if s.filled < 0.35 {
                table.entry("fills less than 35 % of its box".to_owned()).or_default().add(s.found);
            }
        }
        each(index, &shot, &detections, &seen);
    }
}

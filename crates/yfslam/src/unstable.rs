//! Parts for those who measure the system itself. They may change in any release.

use std::sync::Arc;

use crate::camera::Camera;
use crate::config::Config;
use crate::context::Context;
use crate::dynamic::{FilterInput, filter_for};
use crate::features::FrameFeatures;
use crate::frame::Frame;
use crate::image::DepthImage;
use crate::loops::PlaceRecogniser;
use crate::map::{KeyFrame, KeyFrameId, Map};

pub use crate::features::{Descriptor, Features, KeyPoint, OrbExtractor};
pub use crate::image::{GrayImage, gray_from_rgb};
pub use crate::worker::{Requests, Worker};

/// Place recognition on a finished map, one query after another.
pub struct PlaceProbe {
    context: Context,
    recogniser: PlaceRecogniser,
    extractor: OrbExtractor,
    gray: GrayImage,
    extracted: Features,
    features: FrameFeatures,
}

impl PlaceProbe {
    /// Enters the keyframes of a map.
    pub fn new(config: &Config, camera: &Camera, map: &Map) -> Self {
        let extractor = OrbExtractor::new(&config.features);
        let mut recogniser = PlaceRecogniser::default();
        map.keyframes().for_each(|(id, _)| recogniser.add_keyframe(map, id));
        Self {
            context: Context::new(camera, config, extractor.scale_factors()),
            recogniser,
            extractor,
            gray: GrayImage::default(),
            extracted: Features::default(),
            features: FrameFeatures::default(),
        }
    }

    /// Extracts the features of a frame, without those in the boxes of its detections, and returns their descriptors.
    pub fn extract(&mut self, frame: &Frame) -> Vec<Descriptor> {
        let Context { sensor, config } = &self.context;
        let depth = frame.depth.clone().unwrap_or_else(|| Arc::new(DepthImage::default()));
        gray_from_rgb(&frame.color, &mut self.gray);
        self.extractor.extract(&self.gray, &mut self.extracted);
        self.features.fill(&self.extracted, &depth, &sensor.camera, sensor.bounds);
        let movable = frame.detections.as_deref().unwrap_or_default();
        let input = FilterInput { movable, detected: true, mask: None, gray: &self.gray, depth: &depth, sensor };
        filter_for(crate::Method::Boxes, 0).before_pose(&config.dynamic, &input, &mut self.features);
        trusted(&self.features)
    }

    /// Returns the keyframe most like the frame extracted last, and the number of matches with it and its neighbours.
    pub fn best(&mut self, map: &Map) -> Option<(KeyFrameId, usize)> {
        let candidates =
            self.recogniser.candidates(&self.context.config.place_recognition, map, &self.features, |_| true);
        candidates.first().map(|best| (best.keyframe, best.matches.len()))
    }
}

/// Returns the descriptors of the static features of a keyframe.
pub fn descriptors_of(keyframe: &KeyFrame) -> Vec<Descriptor> {
    trusted(&keyframe.features)
}

/// Checks the invariants of a map.
///
/// # Errors
/// The first invariant that does not hold.
pub fn check_map(map: &Map) -> Result<(), String> {
    map.validate()
}

fn trusted(features: &FrameFeatures) -> Vec<Descriptor> {
    let pairs = features.features.iter().zip(&features.descriptors);
    pairs.filter(|(feature, _)| feature.trust > 0.0).map(|(_, descriptor)| *descriptor).collect()
}

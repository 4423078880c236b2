//! The detections of the last frame: those of movable objects, and those of static objects.
//!
//! In: detections of all classes of the detector. Out: movable objects for the dynamic filter; static objects for the classes of the dense
//! map.

use crate::config::DynamicConfig;
use crate::detect::{Detection, Detector, DetectorOutput, mask_of_classes};
use crate::image::Image;
use crate::system::SetupError;

/// The detections of a frame. Buffers are reused.
#[derive(Default)]
pub(super) struct FrameDetections {
    /// Names of the detector's classes; none without a detector.
    pub class_names: Vec<String>,
    /// Indices of the classes that can move.
    movable_classes: Vec<usize>,
    /// Detections of movable objects, at any score.
    pub movable: Vec<Detection>,
    /// Pixels of movable objects, from a detector that segments.
    pub mask: Option<Image<u8>>,
    /// Detections of objects that cannot move, at any score.
    static_objects: Vec<Detection>,
    /// Whether a detector with such classes has processed the frame.
    detected: bool,
}

impl FrameDetections {
    /// Prepares for the classes of a detector.
    ///
    /// # Errors
    /// If the detector lacks a movable class.
    pub(super) fn new(config: &DynamicConfig, detector: Option<&dyn Detector>) -> Result<Self, SetupError> {
        let Some(detector) = detector else { return Ok(Self::default()) };
        let class_names = detector.class_names().to_vec();
        let index = |name: &String| {
            let unknown = || SetupError::UnknownClass { name: name.clone(), known: class_names.join(", ") };
            class_names.iter().position(|known| known == name).ok_or_else(unknown)
        };
        let movable_classes = config.movable.iter().map(index).collect::<Result<_, _>>()?;
        Ok(Self { class_names, movable_classes, ..Self::default() })
    }

    /// Returns whether the detector has classes of objects that cannot move.
    pub(super) fn detects_static_classes(&self) -> bool {
        (0..self.class_names.len()).any(|class| !self.movable_classes.contains(&class))
    }

    /// Empties the buffers for the next frame.
    pub(super) fn clear(&mut self) {
        self.movable.clear();
        self.static_objects.clear();
        (self.mask, self.detected) = (None, false);
    }

    /// Takes the output of the detector.
    pub(super) fn take(&mut self, output: &DetectorOutput) {
        let can_move = |one: &&Detection| self.movable_classes.contains(&one.class);
        self.movable.extend(output.detections.iter().filter(can_move));
        self.static_objects.extend(output.detections.iter().filter(|one| !can_move(one)));
        self.mask = output.mask.as_ref().map(|mask| mask_of_classes(mask, &self.movable_classes));
        self.detected = self.detects_static_classes();
    }

    /// Returns the detections of objects that cannot move, at any score; `None` where no detector with such classes has processed the
    /// frame.
    pub(super) fn static_objects(&self) -> Option<&[Detection]> {
        self.detected.then_some(&self.static_objects)
    }
}

//! What the detector found in the last frame: boxes of what can move, and of what else it knows.
//!
//! In: boxes of all its classes. Out: those of movable objects, which the dynamic filter asks for, apart from the others, which tell only
//! dense maps something.

use crate::config::DynamicConfig;
use crate::detection::{Detection, Detector, mask_of_classes};
use crate::detector_thread::Seen;
use crate::image::Image;
use crate::system::SetupError;

/// What was found in a frame. Buffers are reused.
#[derive(Default)]
pub struct Found {
    /// Names of the detector's classes; none without one.
    pub class_names: Vec<String>,
    /// Indices of those that can move.
    movable_classes: Vec<usize>,
    /// Boxes of movable objects, at any score.
    pub movable: Vec<Detection>,
    /// Pixels of movable objects, from a detector that segments.
    pub mask: Option<Image<u8>>,
    /// Boxes of what cannot move, at any score.
    things: Vec<Detection>,
    /// Whether a detector that knows such things looked.
    looked: bool,
}

impl Found {
    /// Nothing yet, of the classes that a detector knows.
    ///
    /// # Errors
    /// If it does not know a movable class.
    pub fn new(config: &DynamicConfig, detector: Option<&dyn Detector>) -> Result<Self, SetupError> {
        let Some(detector) = detector else { return Ok(Self::default()) };
        let class_names = detector.class_names().to_vec();
        let index = |name: &String| {
            let unknown = || SetupError::UnknownClass { name: name.clone(), known: class_names.join(", ") };
            class_names.iter().position(|known| known == name).ok_or_else(unknown)
        };
        let movable_classes = config.movable.iter().map(index).collect::<Result<_, _>>()?;
        Ok(Self { class_names, movable_classes, ..Self::default() })
    }

    /// Whether the detector knows more than what can move.
    pub fn knows_things(&self) -> bool {
        (0..self.class_names.len()).any(|class| !self.movable_classes.contains(&class))
    }

    /// Comes to the next frame.
    pub fn clear(&mut self) {
        self.movable.clear();
        self.things.clear();
        (self.mask, self.looked) = (None, false);
    }

    /// Takes note of what the detector saw.
    pub fn take(&mut self, seen: &Seen) {
        let can_move = |one: &&Detection| self.movable_classes.contains(&one.class);
        self.movable.extend(seen.boxes.iter().filter(can_move));
        self.things.extend(seen.boxes.iter().filter(|one| !can_move(one)));
        self.mask = seen.mask.as_ref().map(|mask| mask_of_classes(mask, &self.movable_classes));
        self.looked = self.knows_things();
    }

    /// Boxes of what cannot move, at any score; `None` where nobody looked for any.
    pub fn things(&self) -> Option<&[Detection]> {
        self.looked.then_some(&self.things)
    }
}

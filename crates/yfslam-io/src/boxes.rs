//! The detections file `boxes.json` of a recording: the bounding boxes of the objects that can move, for each frame.
//!
//! `instance` is the grey value of the object in `masks/`.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};
use yfslam::{BoundingBox, Detection};

use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};
use crate::text::read_text;

/// Name of the detections file in a sequence folder.
pub const BOXES_FILE: &str = "boxes.json";

/// The detections file of a recording.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoxList {
    /// Names of the classes, in the order of [`Detection::class`].
    pub classes: Vec<String>,
    /// The frames, in the order of their stamps.
    pub frames: Vec<FrameBoxes>,
}

/// The boxes of one frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameBoxes {
    /// Time of the colour image, ns.
    pub timestamp_ns: i64,
    /// The visible objects.
    pub boxes: Vec<InstanceBox>,
}

/// One object in one frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InstanceBox {
    /// Number of the object, the same in all frames and in the masks.
    pub instance: u8,
    /// Class of the object, one of [`BoxList::classes`].
    pub class: String,
    /// Left, top, right and bottom edge, px; pixel (x, y) is inside if left ≤ x < right and top ≤ y < bottom.
    pub bbox: [f32; 4],
}

/// The detections of a perfect detector by the time of the frame, ns.
pub type KnownDetections = BTreeMap<i64, Vec<Detection>>;

impl BoxList {
    /// Reads a `boxes.json`.
    ///
    /// # Errors
    /// The file cannot be read, has another form, or uses a class that is missing in its list of classes.
    pub fn read(path: &Path) -> Result<Self> {
        let text = read_text(path)?;
        let cure = "write it with `yfslam synth`, or remove it and use a detector";
        let list: Self = serde_json::from_str(&text)
            .map_err(|error| Error::line(path, error.line(), format!("is not a detections file: {error}"), cure))?;
        let mut boxes = list.frames.iter().flat_map(|frame| &frame.boxes);
        match boxes.find(|b| !list.classes.contains(&b.class)) {
            Some(unknown) => Err(Error::content(path, format!("class '{}' is not in 'classes'", unknown.class), cure)),
            None => Ok(list),
        }
    }

    /// Writes a `boxes.json` with one frame per line.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        write_atomically(path, |file| {
            write!(file, "{{\"classes\":{},\"frames\":[", serde_json::to_string(&self.classes)?)?;
            for (k, frame) in self.frames.iter().enumerate() {
                write!(file, "{}\n{}", if k == 0 { "" } else { "," }, serde_json::to_string(frame)?)?;
            }
            writeln!(file, "\n]}}")
        })
    }

    /// Returns the boxes of `classes` as detections with score 1.
    pub fn detections(&self, classes: &[String]) -> KnownDetections {
        let class = |name: &str| self.classes.iter().position(|known| known == name).unwrap_or(self.classes.len());
        let detection = |b: &InstanceBox| {
            let [x_min, y_min, x_max, y_max] = b.bbox;
            Detection { class: class(&b.class), score: 1.0, bbox: BoundingBox { x_min, y_min, x_max, y_max } }
        };
        let wanted = |b: &&InstanceBox| classes.contains(&b.class);
        let detections = |frame: &FrameBoxes| frame.boxes.iter().filter(wanted).map(detection).collect();
        self.frames.iter().map(|frame| (frame.timestamp_ns, detections(frame))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_are_the_same_after_writing_and_reading() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(BOXES_FILE);
        let person = InstanceBox { instance: 2, class: "person".into(), bbox: [1.0, 2.5, 30.0, 40.0] };
        let frames = vec![
            FrameBoxes { timestamp_ns: 33_333_333, boxes: vec![person] },
            FrameBoxes { timestamp_ns: 66_666_667, boxes: vec![] },
        ];
        let list = BoxList { classes: vec!["chair".into(), "person".into()], frames };
        list.write(&path).unwrap();
        let again = BoxList::read(&path).unwrap();
        assert_eq!(again, list);
        let detections = again.detections(&["person".to_owned()]);
        assert_eq!(detections[&33_333_333][0].class, 1);
        assert_eq!(detections[&33_333_333][0].bbox.x_max, 30.0);
        assert!(detections[&66_666_667].is_empty());
    }

    #[test]
    fn a_file_of_another_form_is_refused_with_line_and_cure() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(BOXES_FILE);
        for (text, words) in [
            ("[1]", "boxes.json:1"),
            (
                r#"{"classes":[],"frames":[{"timestamp_ns":1,"boxes":[{"instance":1,"class":"cat","bbox":[0,0,1,1]}]}]}"#,
                "'cat' is not in 'classes'",
            ),
        ] {
            std::fs::write(&path, text).unwrap();
            let error = BoxList::read(&path).unwrap_err().to_string();
            assert!(error.contains(words) && error.contains("yfslam synth"), "{error}");
        }
    }
}

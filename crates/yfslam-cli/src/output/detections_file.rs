//! Detections in a set of images: as the JSON file `boxes.json`, drawn on the images, and as text.

use std::fmt;
use std::path::Path;

use anyhow::Result;
use serde::Serialize;
use yfslam::{Detection, Image, RgbImage};
use yfslam_io::write_atomically;

use super::rle::Rle;
use crate::draw::shapes::{Color, bar, rectangle, stain};
use crate::draw::text::{label, line_height};
use crate::input::detector::ModelIdentity;

/// Colours of the classes, in their order; they repeat.
const COLORS: [Color; 6] =
    [[255, 220, 0], [0, 200, 255], [255, 90, 200], [60, 255, 60], [255, 120, 30], [170, 130, 255]];
/// Pixels of the image's longer side for each pixel of the width of an outline.
const LINE_SHARE: usize = 320;
/// Share of the class's colour in the pixels of an object.
const MASK_SHARE: f32 = 0.45;

/// The content of the detections file.
#[derive(Serialize)]
pub struct DetectionsFile<'a> {
    /// Version of this program.
    pub yfslam: &'static str,
    pub model: &'a ModelIdentity,
    /// Lowest score of a box.
    pub score_threshold: f32,
    /// Names of the classes in this file.
    pub classes: Vec<&'a str>,
    #[serde(skip)]
    pub images: Vec<ImageDetections>,
}

/// The detections in one image.
#[derive(Serialize)]
pub struct ImageDetections {
    pub file: String,
    #[serde(flatten)]
    pub result: ImageResult,
}

/// The result for one image.
#[derive(Serialize)]
#[serde(untagged)]
pub enum ImageResult {
    Detected {
        /// px.
        width: usize,
        /// px.
        height: usize,
        /// Highest score first.
        boxes: Vec<ObjectBox>,
    },
    /// The image could not be read.
    Unreadable { error: String },
}

/// One detected object.
#[derive(Serialize)]
pub struct ObjectBox {
    pub class: String,
    /// In (0, 1).
    pub score: f32,
    /// Left, top, right and bottom edge, px; pixel (x, y) is inside if left ≤ x < right and top ≤ y < bottom.
    pub bbox: [f32; 4],
    /// The pixels of the object, from a network that segments. Where objects overlap, a pixel belongs to the one with the highest score.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mask: Option<Rle>,
}

impl ObjectBox {
    /// Converts a detection of class `name`; its pixels in `mask` have the value 1 + `class`.
    pub fn new(Detection { class, score, bbox }: Detection, name: &str, mask: Option<&Image<u8>>) -> Self {
        let mask = mask.zip(u8::try_from(class + 1).ok()).map(|(mask, value)| Rle::encode(mask, value));
        Self { class: name.to_owned(), score, bbox: [bbox.x_min, bbox.y_min, bbox.x_max, bbox.y_max], mask }
    }
}

impl ImageDetections {
    /// Returns the detected objects.
    pub fn boxes(&self) -> &[ObjectBox] {
        match &self.result {
            ImageResult::Detected { boxes, .. } => boxes,
            ImageResult::Unreadable { .. } => &[],
        }
    }

    pub fn is_unreadable(&self) -> bool {
        matches!(self.result, ImageResult::Unreadable { .. })
    }
}

impl fmt::Display for ImageDetections {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match &self.result {
            ImageResult::Detected { width, height, .. } => write!(f, "{} ({width}×{height} px): ", self.file)?,
            ImageResult::Unreadable { error } => return f.write_str(error),
        }
        if self.boxes().is_empty() {
            return f.write_str("no detections");
        }
        for (index, ObjectBox { class, score, bbox: [left, top, right, bottom], .. }) in self.boxes().iter().enumerate()
        {
            let comma = if index == 0 { "" } else { ", " };
            write!(f, "{comma}{class} {score:.2} at {left:.0},{top:.0}–{right:.0},{bottom:.0}")?;
        }
        Ok(())
    }
}

impl DetectionsFile<'_> {
    /// Writes the file with one line for each image.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        let head = serde_json::to_string(self)?;
        let head = head.strip_suffix('}').unwrap_or(&head);
        Ok(write_atomically(path, |file| {
            write!(file, "{head},\"images\":[")?;
            for (index, image) in self.images.iter().enumerate() {
                write!(file, "{}\n{}", if index == 0 { "" } else { "," }, serde_json::to_string(image)?)?;
            }
            writeln!(file, "\n]}}")
        })?)
    }

    /// Returns a line with the number of images and objects.
    pub fn summary(&self) -> String {
        let count =
            |class: &str| self.images.iter().flat_map(ImageDetections::boxes).filter(|b| b.class == class).count();
        let counts = self.classes.iter().map(|class| (count(class), class)).filter(|(count, _)| *count > 0);
        let found: Vec<String> = counts.map(|(count, class)| format!("{count} × {class}")).collect();
        let found = if found.is_empty() { "nothing".to_owned() } else { found.join(", ") };
        format!("{found} found in {} images", self.images.len())
    }

    /// Draws boxes and masks on a copy of `image`.
    pub fn draw(&self, image: &RgbImage, boxes: &[ObjectBox]) -> RgbImage {
        let mut drawn = image.clone();
        let line = (image.width().max(image.height()) / LINE_SHARE).max(1) as i64 + 1;
        let color = |class: &str| {
            let index = self.classes.iter().position(|known| *known == class).unwrap_or(0);
            COLORS[index % COLORS.len()]
        };
        for ObjectBox { class, mask, .. } in boxes {
            if let Some(mask) = mask {
                stain(&mut drawn, &mask.decode(), color(class), MASK_SHARE);
            }
        }
        for ObjectBox { class, score, bbox, .. } in boxes.iter().rev() {
            let color = color(class);
            // A float cast saturates.
            let [left, top, right, bottom] = bbox.map(|edge| edge as i64);
            rectangle(&mut drawn, [left, top], [right - 1, bottom - 1], line, color);
            let length = (f64::from(*score) * (right - left) as f64) as i64;
            bar(&mut drawn, [left, top], [left + length - 1, top + 3 * line], color);
            // Above the box, or inside where there is no room.
            let above = top - line_height(&drawn);
            let top = if above >= 0 { above } else { top + 3 * line + 1 };
            label(&mut drawn, [left, top], &format!("{class} {score:.2}"), color, [0; 3]);
        }
        drawn
    }
}

#[cfg(test)]
mod tests {
    use yfslam::BoundingBox;

    use super::*;

    #[test]
    fn boxes_have_the_colour_of_their_class_and_a_bar_as_long_as_the_score() {
        let model = ModelIdentity { file: "x".into(), bytes: 1, sha256: String::new(), classes: 2, integers: false };
        let list = DetectionsFile {
            yfslam: "",
            model: &model,
            score_threshold: 0.3,
            classes: vec!["person", "dog"],
            images: vec![],
        };
        let bbox = BoundingBox { x_min: 10.0, y_min: 10.0, x_max: 60.0, y_max: 50.0 };
        let found = [ObjectBox::new(Detection { class: 1, score: 0.5, bbox }, "dog", None)];
        let drawn = list.draw(&RgbImage::new(80, 60), &found);
        let is_drawn = |x, y| drawn.get(x, y) == Some(&COLORS[1]);
        assert!([(10, 10), (59, 10), (10, 49), (59, 49), (58, 48)].iter().all(|&(x, y)| is_drawn(x, y)));
        assert!(is_drawn(34, 15) && !is_drawn(35, 15) && !is_drawn(9, 10) && !is_drawn(60, 20) && !is_drawn(30, 30));
        assert!(serde_json::to_value(&found[0]).unwrap().get("mask").is_none());
    }

    #[test]
    fn pixels_of_an_object_are_tinted_in_the_colour_of_its_class_and_run_length_encoded() {
        let model = ModelIdentity { file: "x".into(), bytes: 1, sha256: String::new(), classes: 1, integers: false };
        let list =
            DetectionsFile { yfslam: "", model: &model, score_threshold: 0.3, classes: vec!["person"], images: vec![] };
        // Of two objects, 1 in the upper and 2 in the lower half of a box, the second is drawn.
        let mask = Image::from_vec(40, 40, (0..1600).map(|index| 1 + u8::from(index >= 800)).collect()).unwrap();
        let bbox = BoundingBox { x_min: 0.0, y_min: 0.0, x_max: 40.0, y_max: 40.0 };
        let found = [ObjectBox::new(Detection { class: 1, score: 0.5, bbox }, "person", Some(&mask))];
        let drawn = list.draw(&RgbImage::new(40, 40), &found);
        let [beside, edge, inside] = [19, 20, 30].map(|y| *drawn.get(20, y).unwrap());
        assert_eq!((beside, edge, inside), ([0; 3], COLORS[0], COLORS[0].map(|value| (f32::from(value) * 0.45) as u8)));
        let json = serde_json::to_value(&found[0]).unwrap();
        assert_eq!(json["mask"]["size"], serde_json::json!([40, 40]));
        assert_eq!(json["mask"]["counts"], serde_json::json!(vec![20; 80]));
    }
}

//! Class names and anchors from the metadata of a model file.

use super::coco::COCO_NAMES;
use crate::config::DetectorConfig;
use crate::engine::onnx::Model;

/// Returns the names of the classes: those of the configuration, else those of the model, else those of COCO.
pub(crate) fn class_names(model: &Model, config: &DetectorConfig, classes: usize) -> Result<Vec<String>, String> {
    let names = match model.metadata.get("names") {
        _ if !config.class_names.is_empty() => config.class_names.clone(),
        Some(text) => parse_names(text),
        None if classes == COCO_NAMES.len() => COCO_NAMES.map(String::from).into(),
        None => return Err(format!("the model has {classes} classes without names; set `class_names`")),
    };
    if names.len() == classes {
        Ok(names)
    } else {
        Err(format!("the model has {classes} classes, but {} names are given", names.len()))
    }
}

/// Parses class names in the metadata of a model: `{0: 'person', 1: 'chair'}`, `["person", "chair"]` or `person, chair`.
pub(crate) fn parse_names(text: &str) -> Vec<String> {
    let inner = text.trim().trim_matches(['{', '}', '[', ']']);
    let name = |entry: &str| {
        let name = entry.split_once(':').map_or(entry, |(_, name)| name);
        name.trim().trim_matches(['\'', '"']).to_owned()
    };
    inner.split(',').map(name).filter(|name| !name.is_empty()).collect()
}

/// Parses anchors in the metadata of a model: six pairs of width and height with any brackets and commas.
pub(super) fn parse_anchors(text: &str) -> Option<Vec<Vec<[f32; 2]>>> {
    let numbers = text.split(|c: char| !(c.is_ascii_digit() || c == '.')).filter(|word| !word.is_empty());
    let numbers: Vec<f32> = numbers.map(|word| word.parse().ok().filter(|side| *side > 0.0)).collect::<Option<_>>()?;
    let (pairs, rest) = numbers.as_chunks::<2>();
    let (grids, odd) = pairs.as_chunks::<3>();
    (grids.len() == 2 && rest.is_empty() && odd.is_empty()).then(|| grids.iter().map(|grid| grid.to_vec()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metadata_is_read_in_the_usual_spellings() {
        for text in ["{0: 'person', 1: 'dining table'}", r#"["person", "dining table"]"#, "person,dining table"] {
            assert_eq!(parse_names(text), ["person", "dining table"], "{text}");
        }
        let anchors = parse_anchors("[[[1,2],[3,4.5],[5,6]],[[7,8],[9,10],[11,12]]]").unwrap();
        assert_eq!(anchors, [[[1.0, 2.0], [3.0, 4.5], [5.0, 6.0]], [[7.0, 8.0], [9.0, 10.0], [11.0, 12.0]]]);
        assert_eq!(parse_anchors("1,2,3"), None);
    }
}

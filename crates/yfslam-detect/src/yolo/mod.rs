//! YOLO-FastestV2 as a `Detector`. In: a model file and images. Out: detections.

pub(crate) mod coco;
pub(crate) mod decode;
pub(crate) mod metadata;
pub(crate) mod preprocess;

use std::path::Path;

use fearless_simd::Level;
use yfslam::{Detection, Detector, DetectorError, RgbImage};

use crate::config::DetectorConfig;
use crate::engine::graph;
use crate::engine::onnx::Model;
use crate::engine::plan::{Map, Plan};
use crate::error::ModelError;
use crate::network::Network;
use coco::COCO_ANCHORS;
use decode::{Grid, fuse, suppress};
use metadata::{class_names, parse_anchors};
use preprocess::Stretch;

/// The detector network, ready to run. It runs on the calling thread and, after the first image of a size, allocates nothing except
/// for the growth of the output list.
#[derive(Debug)]
pub struct YoloFastestV2 {
    plan: Plan,
    grids: Vec<Grid>,
    config: DetectorConfig,
    class_names: Vec<String>,
    stretch: Stretch,
    candidates: Vec<Detection>,
}

/// One output of the network after the last convolution, for verification.
#[derive(Clone, Debug, PartialEq)]
pub struct RawOutput {
    /// Name in the model file.
    pub name: String,
    /// Channels, height, width.
    pub shape: [usize; 3],
    /// Logits, row-major.
    pub values: Vec<f32>,
}

/// Largest file of a network, bytes.
const MAX_FILE: u64 = 1 << 30;

/// Reads a regular file: a device or a pipe might never end.
fn read(path: &Path) -> std::io::Result<Vec<u8>> {
    let metadata = std::fs::metadata(path)?;
    if !metadata.is_file() || metadata.len() > MAX_FILE {
        return Err(std::io::Error::other(format!("not a regular file of at most {} MiB", MAX_FILE >> 20)));
    }
    std::fs::read(path)
}

impl YoloFastestV2 {
    /// Loads an ONNX file.
    ///
    /// # Errors
    /// The file cannot be read, is not an ONNX model, has another architecture, or does not fit `config`.
    pub fn load(path: &Path, config: &DetectorConfig) -> Result<Self, ModelError> {
        let name = path.display().to_string();
        let bytes = read(path).map_err(|source| ModelError::Io { path: name.clone(), source })?;
        Self::from_bytes(&name, &bytes, config)
    }

    /// Loads a network from the contents of an ONNX file; `name` stands for the file in error messages.
    ///
    /// # Errors
    /// As for [`YoloFastestV2::load`].
    pub fn from_bytes(name: &str, bytes: &[u8], config: &DetectorConfig) -> Result<Self, ModelError> {
        let mismatch = |what: String| ModelError::Mismatch { model: name.into(), what };
        config.check().map_err(mismatch)?;
        let model = Model::parse(bytes).map_err(|error| ModelError::NotOnnx { model: name.into(), what: error.0 })?;
        let mut config = config.clone();
        if config.anchors.is_empty() {
            config.anchors = match model.metadata.get("anchors") {
                Some(text) => {
                    parse_anchors(text).ok_or_else(|| mismatch(format!("cannot read the anchors \"{text}\"")))?
                }
                None => COCO_ANCHORS.map(Vec::from).into(),
            };
        }
        let plan = Plan::new(name, graph::lower(name, &model)?, Level::new(), config.integers)?;
        let (grids, classes) = Grid::find(name, &plan, &config.anchors)?;
        let class_names = class_names(&model, &config, classes).map_err(mismatch)?;
        // Room for a box of every anchor in every cell.
        let candidates = Vec::with_capacity(grids.iter().map(|grid| grid.most_candidates(&plan)).sum());
        Ok(Self { plan, grids, config, class_names, stretch: Stretch::default(), candidates })
    }

    /// Selects the instruction set `level` instead of the best one, for comparisons and tests.
    #[must_use]
    pub fn with_level(mut self, level: Level) -> Self {
        self.plan.level = level;
        self
    }

    /// Returns the height and width of the network input, px.
    pub fn input_size(&self) -> (usize, usize) {
        self.plan.input_size
    }

    /// Runs only the forward pass on `[3, height, width]` values: blue, green, red, each in [0, 1].
    ///
    /// # Errors
    /// `input` has another length.
    pub fn forward(&mut self, input: &[f32]) -> Result<(), DetectorError> {
        let (height, width) = self.plan.input_size;
        if input.len() != 3 * height * width {
            return Err(DetectorError(format!("{} values given, 3 × {height} × {width} expected", input.len())));
        }
        for (plane, values) in self.plan.input_mut().into_iter().zip(input.chunks_exact(height * width)) {
            plane.copy_from_slice(values);
        }
        self.plan.run();
        Ok(())
    }

    /// Returns the raw outputs of the last image or forward pass, in the order of the model file.
    pub fn raw_outputs(&self) -> Vec<RawOutput> {
        let output = |map: &Map| RawOutput {
            name: map.name.clone(),
            shape: [map.planes.len(), map.size.0, map.size.1],
            values: (0..map.planes.len()).flat_map(|plane| self.plan.plane(map, plane)).copied().collect(),
        };
        self.plan.outputs.iter().map(output).collect()
    }
}

impl Network for YoloFastestV2 {}

impl Detector for YoloFastestV2 {
    fn class_names(&self) -> &[String] {
        &self.class_names
    }

    fn detect(&mut self, image: &RgbImage, out: &mut Vec<Detection>) -> Result<(), DetectorError> {
        out.clear();
        let (image_width, image_height) = (image.width(), image.height());
        if image_width == 0 || image_height == 0 {
            return Err(DetectorError(format!("the image is empty ({image_width} × {image_height} px)")));
        }
        let (height, width) = self.plan.input_size;
        self.stretch.run(self.plan.level, image, (height, width), self.plan.input_mut());
        self.plan.run();

        self.candidates.clear();
        for grid in &self.grids {
            grid.candidates(&self.plan, self.config.score_threshold, &mut self.candidates);
        }
        suppress(&mut self.candidates, &self.config, out);
        fuse(&self.candidates, &self.config, out);
        let [image_width, image_height] = [image_width, image_height].map(|side| side as f32);
        let scale = [image_width / width as f32, image_height / height as f32];
        for Detection { bbox, .. } in out.iter_mut() {
            [bbox.x_min, bbox.x_max] = [bbox.x_min, bbox.x_max].map(|x| (x * scale[0]).clamp(0.0, image_width));
            [bbox.y_min, bbox.y_max] = [bbox.y_min, bbox.y_max].map(|y| (y * scale[1]).clamp(0.0, image_height));
        }
        out.retain(|detection| detection.bbox.area() > 0.0);
        Ok(())
    }
}

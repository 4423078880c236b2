//! YOLO networks of other architectures with the runtime `rten`. In: an ONNX file and images. Out: detections, and masks from a
//! network that segments.
//!
//! The input is red, green, blue in [0, 1], with grey margins where the shape of the image differs; the output is one of three
//! [`Layout`]s.

mod layout;
mod letterbox;
mod masks;

use fearless_simd::Level;
use rten::{Model as Runtime, Value, ValueOrView};
use rten_tensor::Layout as _;
use rten_tensor::prelude::*;
use rten_tensor::{NdTensorView, TensorView};
use yfslam::{Detection, Detector, DetectorError, Image, RgbImage};

use crate::config::DetectorConfig;
use crate::engine::onnx::Model;
use crate::error::ModelError;
use crate::network::Network;
use crate::yolo::decode::suppress;
use crate::yolo::metadata::{class_names, parse_names};
use layout::Layout;
use letterbox::Letterbox;
use masks::Prototypes;

/// Allowed sides of the network input, px.
const SIDES: std::ops::RangeInclusive<usize> = 32..=4096;

/// A YOLO network of any architecture that `rten` supports, on all cores: versions 5 to 12 and 26, exported to ONNX by their
/// training code with a fixed input size and 32-bit floats. It allocates while it runs.
///
/// ```no_run
/// use yfslam::Detector;
/// use yfslam_detect::{AnyYolo, DetectorConfig};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let image = yfslam::RgbImage::new(640, 480);
/// let mut detector = AnyYolo::from_bytes("yolo.onnx", &std::fs::read("yolo.onnx")?, &DetectorConfig::default())?;
/// let mut detections = Vec::new();
/// detector.detect(&image, &mut detections)?;
/// # Ok(()) }
/// ```
pub struct AnyYolo {
    runtime: Runtime,
    layout: Layout,
    letterbox: Letterbox,
    config: DetectorConfig,
    class_names: Vec<String>,
    candidates: Vec<(Detection, usize)>,
    /// The object of each pixel of the last image, and its class, if the network segments.
    objects: Option<Image<u16>>,
    mask: Option<Image<u8>>,
}

impl AnyYolo {
    /// Loads a network from the contents of an ONNX file and runs it once; `name` stands for the file in error messages.
    ///
    /// # Errors
    /// The file is not an ONNX model, `rten` cannot run it, its input or output has another form, or it does not fit `config`.
    pub fn from_bytes(name: &str, bytes: &[u8], config: &DetectorConfig) -> Result<Self, ModelError> {
        let mismatch = |what: String| ModelError::Mismatch { model: name.into(), what };
        config.check().map_err(mismatch)?;
        if config.integers {
            return Err(mismatch("integers are supported for YOLO-FastestV2 only (`integers`), and this is another network; set it to false".into()));
        }
        let model = Model::parse(bytes).map_err(|error| ModelError::NotOnnx { model: name.into(), what: error.0 })?;
        let (height, width) = input_size(&model).map_err(mismatch)?;
        let runtime =
            Runtime::load(bytes.to_vec()).map_err(|error| mismatch(format!("rten cannot load it: {error}")))?;
        let letterbox = Letterbox::new(height, width);
        let outputs = run(&runtime, &letterbox).map_err(|what| mismatch(format!("rten cannot run it: {what}")))?;
        let shapes: Vec<Vec<usize>> = outputs.iter().map(|output| output.shape().to_vec()).collect();
        let layout = Layout::find(&shapes).map_err(mismatch)?;
        // Where classes are numbers in the output, only the names give their count.
        let classes = layout.classes().unwrap_or_else(|| match config.class_names.len() {
            0 => model.metadata.get("names").map_or(0, |text| parse_names(text).len()),
            given => given,
        });
        let class_names = class_names(&model, config, classes).map_err(mismatch)?;
        let (candidates, objects, mask) = Default::default();
        Ok(Self { runtime, layout, letterbox, config: config.clone(), class_names, candidates, objects, mask })
    }
}

impl Detector for AnyYolo {
    fn class_names(&self) -> &[String] {
        &self.class_names
    }

    fn detect(&mut self, image: &RgbImage, out: &mut Vec<Detection>) -> Result<(), DetectorError> {
        out.clear();
        let sides = [image.width(), image.height()];
        if sides.contains(&0) {
            return Err(DetectorError(format!("the image is empty ({} × {} px)", sides[0], sides[1])));
        }
        self.letterbox.put(Level::new(), image);
        let outputs = run(&self.runtime, &self.letterbox).map_err(DetectorError)?;
        let (shape, values) = floats(outputs.first())
            .ok_or_else(|| DetectorError("the network's first output holds no floats".into()))?;
        self.candidates.clear();
        self.layout.candidates(&shape, &values, self.config.score_threshold, &mut self.candidates);
        // Boxes that were suppressed already are all kept.
        let iou_threshold = if self.layout == Layout::Final { 1.0 } else { self.config.iou_threshold };
        let mut boxes: Vec<Detection> = self.candidates.iter().map(|(found, _)| *found).collect();
        suppress(&mut boxes, &DetectorConfig { iou_threshold, ..DetectorConfig::default() }, out);
        let number = |found: &Detection| self.candidates.iter().find(|(other, _)| other == found).map(|(_, n)| *n);
        let mut numbers: Vec<_> = out.iter().map(number).collect();
        out.iter_mut().for_each(|found| found.bbox = self.letterbox.to_image(found.bbox, sides));
        let is_kept = |found: &Detection| found.class < self.class_names.len() && found.bbox.area() > 0.0;
        let mut kept = out.iter().map(is_kept);
        numbers.retain(|_| kept.next().unwrap_or_default());
        out.retain(is_kept);
        // Only prototypes have four dimensions.
        let prototypes = outputs.iter().skip(1).filter_map(|o| floats(Some(o))).find(|(shape, _)| shape.len() == 4);
        self.objects = prototypes.map(|(whole, prototypes)| {
            let prototypes = Prototypes { values: &prototypes, shape: [whole[1], whole[2], whole[3]] };
            let mut objects = Image::new(sides[0], sides[1]);
            for ((found, n), mark) in out.iter().zip(&numbers).zip(1..=u16::MAX) {
                let coefficients = n.map(|n| self.layout.coefficients(&shape, &values, n, whole[1]));
                prototypes.draw(&coefficients.unwrap_or_default(), &found.bbox, &self.letterbox, mark, &mut objects);
            }
            objects
        });
        self.mask = self.objects.as_ref().map(|objects| masks::classes(objects, out));
        Ok(())
    }

    fn mask(&self) -> Option<&Image<u8>> {
        self.mask.as_ref()
    }
}

impl Network for AnyYolo {
    fn objects(&self) -> Option<&Image<u16>> {
        self.objects.as_ref()
    }
}

/// Returns the shape and values of an output.
fn floats(output: Option<&Value>) -> Option<(Vec<usize>, Vec<f32>)> {
    let output: TensorView<f32> = output?.try_into().ok()?;
    Some((output.shape().to_vec(), output.to_vec()))
}

/// Returns the height and width of the only input.
fn input_size(model: &Model) -> Result<(usize, usize), String> {
    let inputs: Vec<_> = model.inputs.iter().filter(|info| !model.initializers.contains_key(info.name)).collect();
    match inputs.as_slice() {
        [input] => match input.dims.as_slice() {
            [None | Some(1), Some(3), Some(height), Some(width)] if SIDES.contains(height) && SIDES.contains(width) => {
                Ok((*height, *width))
            }
            dims => {
                Err(format!("the input has the shape {dims:?}; [1, 3, height, width] with fixed numbers is expected"))
            }
        },
        inputs => Err(format!("the graph has {} inputs; one image is expected", inputs.len())),
    }
}

/// Runs the network on the image that was put into `letterbox` last.
fn run(runtime: &Runtime, letterbox: &Letterbox) -> Result<Vec<Value>, String> {
    let (height, width) = letterbox.size;
    let view = NdTensorView::from_data([1, 3, height, width], &letterbox.input[..]);
    let inputs = runtime.input_ids().iter().map(|id| (*id, ValueOrView::from(view))).collect();
    runtime.run(inputs, runtime.output_ids(), None).map_err(|error| error.to_string())
}

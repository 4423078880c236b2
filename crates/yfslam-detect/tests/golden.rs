//! The official COCO weights give the same results as in ONNX Runtime (numbers from `make_golden.py`); skipped without the data.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests fail and report as tests do")]

use std::path::{Path, PathBuf};

use serde::Deserialize;
use yfslam::{BoundingBox, Detection, Detector, RgbImage};
use yfslam_detect::{DetectorConfig, YoloFastestV2, available_levels};

#[derive(Deserialize)]
struct Golden {
    score_threshold: f32,
    iou_threshold: f32,
    raw: Vec<Raw>,
    boxes: Vec<Boxes>,
}

#[derive(Deserialize)]
struct Raw {
    input: String,
    maps: Vec<RawMap>,
}

#[derive(Deserialize)]
struct RawMap {
    name: String,
    shape: [usize; 3],
    sum: f64,
    absolute_sum: f64,
    samples: Vec<(usize, f32)>,
}

#[derive(Deserialize)]
struct Boxes {
    file: String,
    pixel_sum: u64,
    found: Vec<Found>,
}

#[derive(Debug, Deserialize)]
struct Found {
    class: usize,
    score: f32,
    #[serde(rename = "box")]
    corners: [f32; 4],
}

impl From<&Detection> for Found {
    fn from(Detection { class, score, bbox }: &Detection) -> Self {
        Self { class: *class, score: *score, corners: [bbox.x_min, bbox.y_min, bbox.x_max, bbox.y_max] }
    }
}

impl Found {
    /// The same box up to rounding.
    fn equals(&self, other: &Self) -> bool {
        let distance = self.corners.iter().zip(other.corners).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        self.class == other.class && distance < 2e-3 && (self.score - other.score).abs() < 2e-5
    }

    /// The same object.
    fn resembles(&self, other: &Self) -> bool {
        let [a, b] = [self, other].map(|found| {
            let [x_min, y_min, x_max, y_max] = found.corners;
            BoundingBox { x_min, y_min, x_max, y_max }
        });
        self.class == other.class && a.iou(&b) > 0.65 && (self.score - other.score).abs() < 0.02
    }
}

fn golden() -> Golden {
    serde_json::from_str(include_str!("golden.json")).unwrap()
}

/// Returns the folder with real data; prints a message and returns `None` if it is missing.
fn data() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let data = std::env::var_os("YFSLAM_DATA").map_or(beside, PathBuf::from);
    let present = data.join("models/yolo-fastestv2-coco.onnx").is_file();
    if !present {
        println!("skipped: no YOLO-FastestV2 weights in {}; set YFSLAM_DATA", data.display());
    }
    present.then_some(data)
}

fn detector(data: &Path, config: &DetectorConfig) -> YoloFastestV2 {
    YoloFastestV2::load(&data.join("models/yolo-fastestv2-coco.onnx"), config).unwrap()
}

fn procedural(kind: &str) -> Vec<f32> {
    let value = |index: usize| match kind {
        "noise" => (index * 2_654_435_761 % (1 << 32)) >> 24,
        _ => {
            let (channel, y, x) = (index / (352 * 352), index / 352 % 352, index % 352);
            (x * (channel + 1) + y * 3 / 2 + channel * 50) % 256
        }
    };
    (0..3 * 352 * 352).map(|index| value(index) as f32 / 255.0).collect()
}

#[test]
fn raw_outputs_equal_those_of_onnx_runtime_at_every_level() {
    let Some(data) = data() else { return };
    for level in available_levels() {
        let mut detector = detector(&data, &DetectorConfig::default()).with_level(level);
        for raw in golden().raw {
            detector.forward(&procedural(&raw.input)).unwrap();
            let mut worst = 0.0_f32;
            for (map, output) in raw.maps.iter().zip(detector.raw_outputs()) {
                assert_eq!((&map.name, map.shape), (&output.name, output.shape));
                for (index, expected) in &map.samples {
                    let error = (output.values[*index] - expected).abs();
                    worst = worst.max(error);
                    assert!(error < 2e-4, "{level:?} {} {}[{index}]: {error}", raw.input, map.name);
                }
                let sum: f64 = output.values.iter().map(|value| f64::from(*value)).sum();
                let absolute: f64 = output.values.iter().map(|value| f64::from(value.abs())).sum();
                let count = output.values.len() as f64;
                assert!((sum - map.sum).abs() / count < 2e-5, "{} {}: {sum} {}", raw.input, map.name, map.sum);
                assert!((absolute - map.absolute_sum).abs() / count < 2e-5, "{} {}", raw.input, map.name);
            }
            println!("{level:?}, {}: largest difference of a sample {worst:.1e}", raw.input);
        }
    }
}

fn read_image(path: &Path) -> RgbImage {
    let bytes = std::fs::read(path).unwrap();
    let (width, height, pixels) = if path.extension().is_some_and(|extension| extension == "webp") {
        let mut decoder = image_webp::WebPDecoder::new(std::io::Cursor::new(bytes)).unwrap();
        let mut pixels = vec![0; decoder.output_buffer_size().unwrap()];
        decoder.read_image(&mut pixels).unwrap();
        let (width, height) = decoder.dimensions();
        (width as usize, height as usize, pixels)
    } else {
        let mut decoder = zune_jpeg::JpegDecoder::new(zune_jpeg::zune_core::bytestream::ZCursor::new(bytes));
        let pixels = decoder.decode().unwrap();
        let (width, height) = decoder.dimensions().unwrap();
        (width, height, pixels)
    };
    RgbImage::from_vec(width, height, pixels.as_chunks::<3>().0.to_vec()).unwrap()
}

/// WebP photos are decoded to the same pixels by both programs. JPEG decoders differ in the upsampling of chroma, by a tenth of a
/// grey level on average, which may also decide which of two overlapping boxes wins: for them objects are compared and not corners.
#[test]
fn boxes_on_real_images_equal_those_of_onnx_runtime() {
    let Some(data) = data() else { return };
    let golden = golden();
    let (score_threshold, iou_threshold) = (golden.score_threshold, golden.iou_threshold);
    let config = DetectorConfig { score_threshold, iou_threshold, fuse_iou: 1.0, ..DetectorConfig::default() };
    let mut detector = detector(&data, &config);
    let mut found = Vec::new();
    for Boxes { file, pixel_sum, found: expected } in golden.boxes {
        let image = read_image(&data.join(&file));
        let same_pixels = image.data().iter().flatten().map(|value| u64::from(*value)).sum::<u64>() == pixel_sum;
        assert_eq!(same_pixels, file.ends_with("webp"), "{file}");
        detector.detect(&image, &mut found).unwrap();
        let found: Vec<Found> = found.iter().map(Found::from).collect();
        let least = if same_pixels { 0.0 } else { 0.3 };
        for (from, to) in [(&expected, &found), (&found, &expected)] {
            for wanted in from.iter().filter(|wanted| wanted.score > least) {
                let counterpart =
                    to.iter().any(|other| if same_pixels { wanted.equals(other) } else { wanted.resembles(other) });
                assert!(counterpart, "{file}: {wanted:?} is not in {to:?}");
            }
        }
        println!("{file}: {} boxes agree, the same pixels: {same_pixels}", found.len());
    }
}

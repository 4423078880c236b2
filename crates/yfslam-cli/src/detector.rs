//! The detector that the user named, timed.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use clap::Args;
use serde::Serialize;
use yfslam::image::RgbImage;
use yfslam::{Config, Detection, Detector, DetectorError};
use yfslam_detect::{DetectorConfig, YoloFastestV2};

use crate::cpu;

/// Which network finds people.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "System")]
pub struct DetectorArgs {
    /// Network that finds people: YOLO-FastestV2 as ONNX. Methods `boxes` and `yf` need it on recorded sequences.
    #[arg(long, value_name = "FILE.onnx")]
    pub detector: Option<PathBuf>,
    /// Names of the network's classes, in its order [default: those in the file, else those of COCO].
    #[arg(long, value_name = "NAME,NAME", value_delimiter = ',', requires = "detector")]
    detector_classes: Vec<String>,
}

/// Which model found the boxes.
#[derive(Clone, Debug, Serialize)]
pub struct ModelIdentity {
    /// The file.
    pub file: PathBuf,
    /// Its size.
    pub bytes: usize,
    /// CRC-32 (IEEE 802.3) of the file, hexadecimal.
    pub crc32: String,
    /// Number of classes it knows.
    pub classes: usize,
}

/// A detector ready to run.
pub struct LoadedDetector {
    pub detector: Box<dyn Detector>,
    /// One for each image it has seen.
    pub times: Receiver<Took>,
    pub identity: ModelIdentity,
}

/// How long one image took.
#[derive(Clone, Copy, Debug)]
pub struct Took {
    pub wall: Duration,
    /// Processor time; `None` where the system does not tell.
    pub cpu: Option<Duration>,
}

/// Loads a YOLO-FastestV2 model, set to report every box that the dynamic filter of `config` may use.
///
/// # Errors
/// The file cannot be read, is no ONNX model, or holds another network.
pub fn load(args: &DetectorArgs, file: &Path, config: &Config) -> Result<LoadedDetector> {
    let bytes =
        std::fs::read(file).with_context(|| format!("cannot read the detector {}; check the path", file.display()))?;
    let score_threshold = config.dynamic.keep_score.min(config.dynamic.open_score);
    ensure!(
        score_threshold > 0.0 && score_threshold < 1.0,
        "dynamic.keep_score and dynamic.open_score are {} and {}; set them between 0 and 1",
        config.dynamic.keep_score,
        config.dynamic.open_score
    );
    let class_names = args.detector_classes.clone();
    let detector_config = DetectorConfig { score_threshold, class_names, ..Default::default() };
    let network = YoloFastestV2::from_bytes(&file.display().to_string(), &bytes, &detector_config)?;
    let identity = ModelIdentity {
        file: file.into(),
        bytes: bytes.len(),
        crc32: format!("{:08x}", crc32fast::hash(&bytes)),
        classes: network.class_names().len(),
    };
    let (sender, times) = channel();
    Ok(LoadedDetector { detector: Box::new(Timed { network, times: sender }), times, identity })
}

/// Tells how long each image took.
struct Timed {
    network: YoloFastestV2,
    times: Sender<Took>,
}

impl Detector for Timed {
    fn class_names(&self) -> &[String] {
        self.network.class_names()
    }

    fn detect(&mut self, image: &RgbImage, out: &mut Vec<Detection>) -> Result<(), DetectorError> {
        let started = Instant::now();
        let (result, cpu) = cpu::timed(|| self.network.detect(image, out));
        // Whoever stopped listening does not need the time.
        let _ = self.times.send(Took { wall: started.elapsed(), cpu });
        result
    }
}

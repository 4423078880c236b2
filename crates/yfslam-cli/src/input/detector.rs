//! Loading the detector, and timing it.

use std::borrow::Cow;
use std::convert::Infallible;
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use clap::Args;
use serde::Serialize;
use sha2::{Digest, Sha256};
use yfslam::{Config, Detection, Detector, DetectorError, Image, RgbImage};
use yfslam_detect::{DetectorConfig, EMBEDDED_MODEL, Network, YoloFastestV2};
use yfslam_io::read_file;

use crate::stats::cpu;

/// Name of the network in this program.
const EMBEDDED: &str = "embedded";
/// Digits of a hash in messages; the whole hash is in `--version` and in the files.
const SHORT_HASH: usize = 12;

/// The network that detects people.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "System")]
pub struct DetectorArgs {
    /// Network that detects people: `embedded` or an ONNX file [default: embedded; in `run` the boxes of the sequence, if it has any].
    #[arg(long, value_name = "FILE.onnx|embedded")]
    pub detector: Option<Model>,
    /// Class names of the network, in its order [default: the names in the file, else those of COCO].
    #[arg(long, value_name = "NAME,NAME", value_delimiter = ',', requires = "detector")]
    pub detector_classes: Vec<String>,
    /// Use 8-bit integers: slightly less accurate, faster on processors with AVX-512 VNNI and much slower on others.
    #[arg(long)]
    pub integers: bool,
}

/// A network.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Model {
    /// The network in this program.
    Embedded,
    File(PathBuf),
}

impl FromStr for Model {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(if text == EMBEDDED { Self::Embedded } else { Self::File(text.into()) })
    }
}

/// The model that was used.
#[derive(Clone, Debug, Serialize)]
pub struct ModelIdentity {
    /// File, or `embedded`.
    pub file: PathBuf,
    /// Size of the file.
    pub bytes: usize,
    /// SHA-256 (FIPS 180-4) of the file, hexadecimal.
    pub sha256: String,
    /// Number of classes.
    pub classes: usize,
    /// Whether it uses 8-bit integers.
    pub integers: bool,
}

impl fmt::Display for ModelIdentity {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let name = self.file.file_name().unwrap_or(self.file.as_os_str()).to_string_lossy();
        let start = self.sha256.get(..SHORT_HASH).unwrap_or(&self.sha256);
        let arithmetic = if self.integers { ", integers" } else { "" };
        write!(f, "{name} network (SHA-256 {start}…, {} kB{arithmetic})", self.bytes.div_ceil(1000))
    }
}

/// Describes the network in this program in a line.
pub fn describe_embedded() -> String {
    format!("embedded network: SHA-256 {}, {} kB", sha256(EMBEDDED_MODEL), EMBEDDED_MODEL.len().div_ceil(1000))
}

fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A detector that is ready to run.
pub struct LoadedDetector {
    pub detector: Box<dyn Network>,
    /// Durations, one for each image.
    pub times: Receiver<DetectorTime>,
    pub identity: ModelIdentity,
}

/// Duration of the detection in one image.
#[derive(Clone, Copy, Debug)]
pub struct DetectorTime {
    pub wall: Duration,
    /// Processor time; `None` where the system does not measure it.
    pub cpu: Option<Duration>,
}

/// Loads a network that reports all boxes that the dynamic filter of `config` may use.
///
/// # Errors
/// As [`load`].
pub fn load_for(args: &DetectorArgs, config: &Config) -> Result<LoadedDetector> {
    let for_filter = DetectorConfig::for_filter(config);
    let score_threshold = for_filter.score_threshold;
    ensure!(
        score_threshold > 0.0 && score_threshold < 1.0,
        "dynamic.keep_score and dynamic.open_score are {} and {}; set them between 0 and 1",
        config.dynamic.keep_score,
        config.dynamic.open_score
    );
    load(args, for_filter)
}

/// Loads the requested network, else the embedded one.
///
/// # Errors
/// The file cannot be read, is not an ONNX model, or holds an unsupported network.
pub fn load(args: &DetectorArgs, config: DetectorConfig) -> Result<LoadedDetector> {
    let (class_names, integers) = (args.detector_classes.clone(), args.integers);
    let config = DetectorConfig { class_names, integers, ..config };
    let (network, file, bytes): (Box<dyn Network>, _, _) = match &args.detector {
        None | Some(Model::Embedded) => {
            (Box::new(YoloFastestV2::embedded(&config)?), EMBEDDED.into(), EMBEDDED_MODEL.into())
        }
        Some(Model::File(file)) => {
            let bytes = read_file(file)
                .with_context(|| format!("cannot read the detector {}; check the path", file.display()))?;
            let network = yfslam_detect::load(&file.display().to_string(), &bytes, &config)?;
            (network, file.clone(), Cow::from(bytes))
        }
    };
    let (sha256, classes) = (sha256(&bytes), network.class_names().len());
    let identity = ModelIdentity { file, bytes: bytes.len(), sha256, classes, integers };
    let (sender, times) = channel();
    Ok(LoadedDetector { detector: Box::new(Timed { network, times: sender }), times, identity })
}

/// Measures the duration of each detection.
struct Timed {
    network: Box<dyn Network>,
    times: Sender<DetectorTime>,
}

impl Detector for Timed {
    fn class_names(&self) -> &[String] {
        self.network.class_names()
    }

    fn detect(&mut self, image: &RgbImage, out: &mut Vec<Detection>) -> Result<(), DetectorError> {
        let started = Instant::now();
        let (result, cpu) = cpu::timed(|| self.network.detect(image, out));
        // The receiver may be gone at the end of a run.
        let _ = self.times.send(DetectorTime { wall: started.elapsed(), cpu });
        result
    }

    fn mask(&self) -> Option<&Image<u8>> {
        self.network.mask()
    }
}

impl Network for Timed {
    fn objects(&self) -> Option<&Image<u16>> {
        self.network.objects()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_equal_those_of_the_standard() {
        // The example of FIPS 180-4, and the empty message.
        assert_eq!(sha256(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
        assert_eq!(sha256(b""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    }
}

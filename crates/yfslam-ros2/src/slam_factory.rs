//! Builds the SLAM system from the parameters.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use yfslam::{Camera, Config, Execution, MapUse, Method, SavedMap, Slam};
use yfslam_detect::{DetectorConfig, YoloFastestV2};
use yfslam_io::read_file;

use crate::parameters::Parameters;

/// Builds SLAM systems of one configuration.
#[derive(Clone, Debug)]
pub struct SlamFactory {
    config: Config,
    execution: Execution,
    has_grid: bool,
}

impl SlamFactory {
    /// Reads the configuration.
    ///
    /// # Errors
    /// The file of the configuration cannot be read or used.
    pub fn new(parameters: &Parameters) -> Result<Self> {
        let file = parameters.text("config");
        let mut config = if file.is_empty() {
            Config::default()
        } else {
            let text = read_file(Path::new(file)).with_context(|| format!("parameter config is {file}"))?;
            let text = String::from_utf8(text).with_context(|| format!("{file} is not UTF-8"))?;
            Config::from_toml(&text).with_context(|| format!("{file}: see `yfslam config` for all keys"))?
        };
        // A method in the file counts, unless the parameter asks for another one.
        if parameters.text("method") != "full" || file.is_empty() {
            config.dynamic.method = method(parameters.text("method"));
        }
        config.dynamic.detect_every = usize::try_from(parameters.integer("detect_every")).unwrap_or(1);
        config.dynamic.detect_async |= parameters.flag("detect_async");
        config.validate()?;
        let execution = if parameters.flag("threaded") { Execution::Threaded } else { Execution::Inline };
        Ok(Self { config, execution, has_grid: parameters.flag("grid") })
    }

    /// Builds a system, in a map of an earlier session if there is one.
    ///
    /// # Errors
    /// The map does not fit, or a part cannot be made.
    pub fn build(&self, camera: &Camera, map: Option<(SavedMap, MapUse)>) -> Result<Slam> {
        let mut builder = Slam::builder(camera.clone()).config(self.config.clone()).execution(self.execution);
        if self.config.dynamic.method.needs_boxes() {
            let dynamic = &self.config.dynamic;
            let score_threshold = dynamic.keep_score.min(dynamic.open_score);
            ensure!(
                score_threshold > 0.0 && score_threshold < 1.0,
                "dynamic.keep_score and open_score are out of range"
            );
            builder =
                builder.detector(YoloFastestV2::embedded(&DetectorConfig { score_threshold, ..Default::default() })?);
        }
        if self.has_grid {
            builder = builder.dense(self.config.dense.clone());
        }
        if let Some((saved, map_use)) = map {
            builder = builder.map(saved, map_use);
        }
        Ok(builder.build()?)
    }
}

/// Reads a saved map.
///
/// # Errors
/// The file cannot be read or is no map.
pub fn load_map(path: &str) -> Result<SavedMap> {
    let bytes = read_file(Path::new(path)).with_context(|| format!("the map {path} cannot be read"))?;
    SavedMap::from_bytes(&bytes).with_context(|| format!("{path} cannot be used as a map"))
}

fn method(name: &str) -> Method {
    match name {
        "none" => Method::None,
        "boxes" => Method::Boxes,
        "yf" => Method::YfSlam,
        "ds" => Method::DsSlam,
        "dyna" => Method::DynaSlam,
        "dms" => Method::DmsSlam,
        _ => Method::Full,
    }
}

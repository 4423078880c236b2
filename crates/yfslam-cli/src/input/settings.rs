//! The configuration: flags override the file, and the file overrides the defaults.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::{Args, ValueEnum, value_parser};
use yfslam::config::Grouping;
use yfslam::{Config, Method};
use yfslam_io::read_text;

/// Settings of the system.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "System")]
pub struct SettingsArgs {
    /// How the depth group of a person is found in a box [default: exact].
    #[arg(long, value_enum, value_name = "GROUPING")]
    pub grouping: Option<GroupingArg>,
    /// Seed of all random draws [default: 0].
    #[arg(long, value_name = "N", value_parser = value_parser!(u64).range(..=i64::MAX as u64))]
    pub seed: Option<u64>,
    /// Run the detector on every N-th frame [default: 1]; tracks of people are predicted in between.
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1000))]
    pub detect_every: Option<u32>,
    /// Run the detector only when it is needed, but at least at this interval, s, such as 0.15: when a track is uncertain, something moves that
    /// no track covers, or the view has changed [default: 0, on every frame].
    #[arg(long, value_name = "S")]
    pub detect_gap: Option<f64>,
    /// Do not wait for the detector: use boxes when they are ready, for live use with --threaded.
    #[arg(long)]
    pub detect_async: bool,
    /// Configuration file with the settings that differ from the defaults; `yfslam config` prints all settings.
    #[arg(short, long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
}

/// Methods for dynamic scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MethodArg {
    /// All features are trusted, as in ORB-SLAM2.
    None,
    /// All features in boxes are dropped.
    Boxes,
    /// YF-SLAM: in a box, features in the depth group of the person are dropped, those of the background are kept.
    Yf,
    /// DS-SLAM: people are dropped in frames in which a feature on them violates the epipolar geometry.
    Ds,
    /// DynaSLAM: people are dropped, and what is nearer than earlier keyframes have measured.
    Dyna,
    /// DMS-SLAM: features that do not move like their neighbours are dropped; it needs no boxes.
    Dms,
    /// Segmented people are dropped, and whatever else has moved since earlier frames.
    Full,
}

/// How the depth group of a person is found.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum GroupingArg {
    /// A search over all depths, which does not depend on the seed.
    Exact,
    /// The Geometric Depth RANSAC of the paper, which depends on the seed.
    Ransac,
}

impl MethodArg {
    /// Returns the method.
    pub fn method(self) -> Method {
        match self {
            Self::None => Method::None,
            Self::Boxes => Method::Boxes,
            Self::Yf => Method::YfSlam,
            Self::Ds => Method::DsSlam,
            Self::Dyna => Method::DynaSlam,
            Self::Dms => Method::DmsSlam,
            Self::Full => Method::Full,
        }
    }
}

/// Returns the name of a method on the command line, and a description.
pub fn describe(method: Method) -> (&'static str, &'static str) {
    match method {
        Method::None => ("none", "all features are trusted"),
        Method::Boxes => ("boxes", "features in boxes of people are dropped"),
        Method::YfSlam => ("yf", "the depth group of a person is dropped, the background is kept"),
        Method::DsSlam => ("ds", "moving people are dropped, as in DS-SLAM"),
        Method::DynaSlam => ("dyna", "people and what is nearer than in earlier keyframes are dropped, as in DynaSLAM"),
        Method::DmsSlam => ("dms", "features that do not move like their neighbours are dropped, as in DMS-SLAM"),
        Method::Full => ("full", "segmented people and whatever else has moved are dropped"),
    }
}

impl SettingsArgs {
    /// Returns the configuration from file and flags.
    ///
    /// # Errors
    /// The file cannot be read, or holds an unknown key or a value of the wrong type.
    pub fn resolve(&self) -> Result<Config> {
        let mut config = match &self.config {
            Some(path) => {
                let text = read_text(path)
                    .with_context(|| format!("cannot read the configuration {}; check the path", path.display()))?;
                Config::from_toml(&text)
                    .with_context(|| format!("{}: see `yfslam config` for all keys", path.display()))?
            }
            None => Config::default(),
        };
        let dynamic = &mut config.dynamic;
        match self.grouping {
            Some(GroupingArg::Exact) => dynamic.grouping = Grouping::Exact,
            Some(GroupingArg::Ransac) => dynamic.grouping = Grouping::Ransac,
            None => {}
        }
        dynamic.seed = self.seed.unwrap_or(dynamic.seed);
        config.monocular.seed = self.seed.unwrap_or(config.monocular.seed);
        let dynamic = &mut config.dynamic;
        dynamic.detect_every = self.detect_every.map_or(dynamic.detect_every, |every| every as usize);
        dynamic.detect_max_gap_s = self.detect_gap.unwrap_or(dynamic.detect_max_gap_s);
        dynamic.detect_async |= self.detect_async;
        Ok(config)
    }
}

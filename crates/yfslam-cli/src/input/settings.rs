//! From a configuration file and flags to one configuration: flags win over the file, the file over the defaults.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::{Args, ValueEnum, value_parser};
use yfslam::Config;
use yfslam::dynamic::Method;
use yfslam::dynamic::depth_group::Grouping;

/// What can be set about the system.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "System")]
pub struct SettingsArgs {
    /// How the depth group of a moving body is found [default: exact].
    #[arg(long, value_enum, value_name = "GROUPING")]
    pub grouping: Option<GroupingArg>,
    /// Seed of every random draw [default: 0].
    #[arg(long, value_name = "N", value_parser = value_parser!(u64).range(..=i64::MAX as u64))]
    pub seed: Option<u64>,
    /// Frames from one look of the detector to the next [default: 1]. Over those between, tracks are carried without boxes.
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1000))]
    pub detect_every: Option<u32>,
    /// Use boxes when they are ready, perhaps some frames late: no frame waits for the detector once there is a map. For live use on
    /// small boards, with --threaded; results then differ from run to run.
    #[arg(long)]
    pub detect_async: bool,
    /// Settings that differ from the defaults; `yfslam config` prints them all.
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
}

/// How moving things are kept out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MethodArg {
    /// Every feature is trusted, as in ORB-SLAM2.
    None,
    /// Every feature inside a box is dropped.
    Boxes,
    /// YF-SLAM: inside a box the depth group of the body is dropped, the background stays.
    Yf,
    /// DS-SLAM: people are dropped in frames in which anything on them moves against the epipolar geometry.
    Ds,
    /// DynaSLAM: people are dropped, and whatever stands nearer than earlier keyframes allow.
    Dyna,
    /// DMS-SLAM: features that do not move like their neighbours are dropped; needs no boxes.
    Dms,
    /// Outlines of bodies in depth are dropped, and whatever else has moved since earlier views.
    Full,
}

/// How the depth group of a moving body is found.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum GroupingArg {
    /// A search over all depths; the same for every seed.
    Exact,
    /// The paper's Geometric Depth RANSAC, seeded.
    Ransac,
}

impl MethodArg {
    /// The method that is meant.
    pub fn method(self) -> Method {
        match self {
            Self::None => Method::None,
            Self::Boxes => Method::Boxes,
            Self::Yf => Method::Yf,
            Self::Ds => Method::Ds,
            Self::Dyna => Method::Dyna,
            Self::Dms => Method::Dms,
            Self::Full => Method::Full,
        }
    }
}

/// Name of a method, as on the command line, and what it does.
pub fn describe(method: Method) -> (&'static str, &'static str) {
    match method {
        Method::None => ("none", "every feature is trusted"),
        Method::Boxes => ("boxes", "features in boxes of people are dropped"),
        Method::Yf => ("yf", "people are kept out, what is behind them stays"),
        Method::Ds => ("ds", "people are kept out while anything on them moves, as in DS-SLAM"),
        Method::Dyna => {
            ("dyna", "people and what stands where earlier keyframes saw farther are kept out, as in DynaSLAM")
        }
        Method::Dms => ("dms", "features that do not move like their neighbours are dropped, as in DMS-SLAM"),
        Method::Full => ("full", "outlines of people and of whatever has moved are kept out"),
    }
}

impl SettingsArgs {
    /// The configuration that file and flags amount to.
    ///
    /// # Errors
    /// The file cannot be read, or holds an unknown key or a value of the wrong type.
    pub fn resolve(&self) -> Result<Config> {
        let mut config = match &self.config {
            Some(path) => {
                let text = std::fs::read_to_string(path)
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
        dynamic.detect_async |= self.detect_async;
        Ok(config)
    }
}

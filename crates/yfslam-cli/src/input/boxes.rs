//! Where the boxes of movable objects come from, and one detector for several methods.
//!
//! In: what the user named. Out: for one method the detector itself, which then runs beside feature extraction; for several the frames
//! with their boxes, found once.

use std::fmt;

use anyhow::{Result, bail};
use serde::Serialize;
use yfslam::Config;
use yfslam::dynamic::Method;

use crate::input::detector::{self, DetectorArgs, LoadedDetector, ModelIdentity};
use crate::input::settings::describe;
use crate::input::source::SourceArgs;
use crate::ui::terminal::Terminal;

/// Where the boxes of movable objects come from.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BoxOrigin {
    /// The method needs none.
    None,
    /// The synthetic world knows them.
    Renderer,
    /// The `boxes.json` of the folder.
    Folder,
    /// None: masks tell what can move.
    Masks,
    /// A network.
    Detector(ModelIdentity),
}

impl BoxOrigin {
    /// Whether they come with the frames.
    pub fn is_source(&self) -> bool {
        matches!(self, Self::Renderer | Self::Folder)
    }
}

impl fmt::Display for BoxOrigin {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::None => f.write_str("none needed"),
            Self::Renderer => f.write_str("exact, from the renderer"),
            Self::Folder => f.write_str("exact, from the recording's boxes.json"),
            Self::Masks => f.write_str("none; masks tell what can move"),
            Self::Detector(model) => model.fmt(f),
        }
    }
}

/// The origin of the boxes that `methods` need, and the detector if it is one.
///
/// # Errors
/// The detector cannot be used, or there are masks alone and a method cannot use them.
pub fn choose(
    args: &DetectorArgs,
    source: &SourceArgs,
    config: &Config,
    methods: &[Method],
    terminal: Terminal,
) -> Result<(BoxOrigin, Option<LoadedDetector>)> {
    if !methods.iter().any(|method| method.needs_boxes()) {
        return Ok((BoxOrigin::None, None));
    }
    if args.detector.is_none() && source.masks.is_some() {
        if let Some(method) = methods.iter().find(|method| matches!(method, Method::Boxes | Method::Yf)) {
            let (name, _) = describe(*method);
            bail!(
                "method {name} works on boxes alone; add --detector embedded to find them, or leave it out of --method"
            );
        }
        terminal.note("no --detector: the masks alone tell what can move");
        return Ok((BoxOrigin::Masks, None));
    }
    if args.detector.is_none() && source.is_synthetic() {
        terminal.note("no --detector: the boxes of people come from the renderer, which knows them exactly");
        return Ok((BoxOrigin::Renderer, None));
    }
    if args.detector.is_none() && source.knows_boxes() {
        terminal.note("no --detector: the boxes of people come from the folder's boxes.json");
        return Ok((BoxOrigin::Folder, None));
    }
    let loaded = detector::load_for(args, config)?;
    if args.detector.is_none() {
        terminal.note("no --detector: people are found by the network in this program");
    }
    Ok((BoxOrigin::Detector(loaded.identity.clone()), Some(loaded)))
}

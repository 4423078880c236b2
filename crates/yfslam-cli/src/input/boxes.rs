//! Where the boxes of movable objects come from.
//!
//! In: options of the user. Out: the origin of the boxes, and the detector if it is one.

use std::fmt;

use anyhow::{Result, bail};
use serde::Serialize;
use yfslam::{Config, Method};

use crate::input::detector::{self, DetectorArgs, LoadedDetector, ModelIdentity};
use crate::input::settings::describe;
use crate::input::source::SourceArgs;
use crate::ui::terminal::Terminal;

/// Where the boxes of movable objects come from.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BoxOrigin {
    /// The method needs no boxes.
    None,
    /// The synthetic world.
    Renderer,
    /// The `boxes.json` of the folder.
    Folder,
    /// No boxes: masks show what can move.
    Masks,
    /// A network.
    Detector(ModelIdentity),
}

impl BoxOrigin {
    /// Returns whether boxes come with the frames.
    pub fn is_source(&self) -> bool {
        matches!(self, Self::Renderer | Self::Folder)
    }
}

impl fmt::Display for BoxOrigin {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::None => f.write_str("not needed"),
            Self::Renderer => f.write_str("exact, from the renderer"),
            Self::Folder => f.write_str("exact, from the recording's boxes.json"),
            Self::Masks => f.write_str("none, no detector is running; masks show what can move"),
            Self::Detector(model) => model.fmt(f),
        }
    }
}

/// Returns the origin of the boxes that `methods` need, and the detector if it is one.
///
/// # Errors
/// The detector cannot be used, or a method needs boxes and there are only masks.
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
        if let Some(method) = methods.iter().find(|method| matches!(method, Method::Boxes | Method::YfSlam)) {
            let (name, _) = describe(*method);
            bail!(
                "method {name} needs boxes and cannot use masks; add --detector embedded, or leave it out of --method"
            );
        }
        terminal.warn(
            "no detector is running: people are not detected, and only what the masks show is treated as movable; add --detector embedded \
             to detect people",
        );
        return Ok((BoxOrigin::Masks, None));
    }
    if args.detector.is_none() && source.is_synthetic() {
        terminal.note("no --detector: the boxes of people come from the renderer and are exact");
        return Ok((BoxOrigin::Renderer, None));
    }
    if args.detector.is_none() && source.has_boxes() {
        terminal.note("no --detector: the boxes of people come from the folder's boxes.json");
        return Ok((BoxOrigin::Folder, None));
    }
    let loaded = detector::load_for(args, config)?;
    if args.detector.is_none() {
        terminal.note("no --detector: people are detected by the network in this program");
    }
    Ok((BoxOrigin::Detector(loaded.identity.clone()), Some(loaded)))
}

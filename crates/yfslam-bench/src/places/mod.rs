//! Experiments on loop closing, relocalisation, long runs and live runs. Sequences are held in memory and played forward and backward,
//! as often as an experiment needs.
//!
//! A sequence is a world such as `walking_xyz?seed=2&frames=300`, whose boxes come from the renderer, or a folder in TUM layout with
//! ground truth, whose people are found by the network.

mod bag_of_words;
mod endurance;
mod false_positives;
mod live;
mod loops;
mod recall;
mod relocalisation;
mod sequence;

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, Subcommand};
use nalgebra::Isometry3;
use sequence::LoadedSequence;

use crate::row::Row;

/// What is measured.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    #[command(subcommand)]
    /// The experiment.
    pub experiment: Experiment,
    /// Worlds, and folders in TUM layout.
    #[arg(global = true)]
    pub sequences: Vec<String>,
    /// Network for recorded folders: YOLO-FastestV2 as ONNX [default: the embedded one].
    #[arg(long, global = true)]
    pub detector: Option<PathBuf>,
    /// Configuration that differs from the defaults.
    #[arg(long, global = true)]
    pub config: Option<PathBuf>,
}

/// An experiment.
#[derive(Clone, Debug, Subcommand)]
pub enum Experiment {
    /// Loops that are closed, their errors, and the trajectory error with and without them; forward, and forward then backward.
    Loops,
    /// A camera that is covered for a while: the number of frames until it is relocalised.
    Relocalisation {
        /// Trials over all sequences.
        #[arg(long, default_value_t = 200)]
        count: usize,
        /// Seed of the moments at which the camera is covered.
        #[arg(long, default_value_t = 0)]
        seed: u64,
    },
    /// Keyframes, memory and time while a sequence is played to and fro.
    Endurance {
        /// Number of times that it is played, forward and backward counted apart.
        #[arg(long, default_value_t = 20)]
        rounds: usize,
    },
    /// Places that are not in the map and are taken for places that are: the first part is mapped, all of it is relocalised.
    FalsePositives {
        /// Share of the sequence that is mapped.
        #[arg(long, default_value_t = 0.45)]
        mapped: f64,
    },
    /// Places that are recognised without a single error, beside a bag of words that was trained on the same map.
    Recall {
        /// Share of the sequence that is mapped.
        #[arg(long, default_value_t = 0.5)]
        mapped: f64,
    },
    /// A live camera: frames at their own rate with mapping on a thread, the time to the first pose, localisation in the saved map.
    Live,
}

/// Runs an experiment: one row for each line of its table.
///
/// # Errors
/// A sequence cannot be opened, or SLAM refuses its input.
pub fn measure(arguments: &Arguments) -> Result<Vec<Row>> {
    let config = match &arguments.config {
        Some(path) => yfslam::Config::from_toml(&std::fs::read_to_string(path)?)?,
        None => yfslam::Config::default(),
    };
    let open = |spec: &String| LoadedSequence::open(spec, arguments.detector.as_deref(), &config);
    let sequences = arguments.sequences.iter().map(open);
    match arguments.experiment {
        Experiment::Loops => loops::measure(&config, sequences),
        Experiment::Relocalisation { count, seed } => {
            relocalisation::measure(&config, count, seed, arguments.sequences.len(), sequences)
        }
        Experiment::Endurance { rounds } => endurance::measure(&config, rounds, sequences),
        Experiment::FalsePositives { mapped } => false_positives::measure(&config, mapped, sequences),
        Experiment::Recall { mapped } => recall::measure(&config, mapped, sequences),
        Experiment::Live => live::measure(&config, sequences),
    }
}

/// Translation and rotation of a difference between poses, m and degrees.
fn size(error: &Isometry3<f64>) -> (f64, f64) {
    (error.translation.vector.norm(), error.rotation.angle().to_degrees())
}

/// Whether an error of a pose or a loop is that of another place: more than 0.3 m or 10°.
fn is_wrong((m, deg): (f64, f64)) -> bool {
    m > 0.3 || deg > 10.0
}

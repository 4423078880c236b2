//! What the back end is worth, in tables: loops, finding back, long runs, live runs. Sequences are held in memory and played forward
//! and backward, as often as a question asks for.
//!
//! ```text
//! cargo run --release -p yfslam-cli --example places -- loops corridor_loop walking_xyz DATA/rgbd/tum_fr1_xyz_dev
//! cargo run --release -p yfslam-cli --example places -- trials --count 200 SEQUENCE...
//! cargo run --release -p yfslam-cli --example places -- soak --rounds 20 SEQUENCE
//! cargo run --release -p yfslam-cli --example places -- strangers corridor_loop
//! cargo run --release -p yfslam-cli --example places -- recall --mapped 0.3 corridor_loop
//! cargo run --release -p yfslam-cli --example places -- live SEQUENCE...
//! ```
//!
//! A sequence is a world such as `walking_xyz?seed=2&frames=300`, whose boxes the renderer knows, or a folder in TUM layout with
//! ground truth, whose people `--detector FILE.onnx` finds.

mod bag_of_words;
mod endurance;
mod false_positives;
mod live;
mod loaded_sequence;
mod loops;
mod recall;
mod relocalisation;

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, Subcommand};
use loaded_sequence::Film;

#[derive(Args)]
pub struct Arguments {
    #[command(subcommand)]
    question: Question,
    /// Worlds, and folders in TUM layout.
    #[arg(global = true)]
    sequences: Vec<String>,
    /// Network that finds people in recorded folders: YOLO-FastestV2 as ONNX.
    #[arg(long, global = true)]
    detector: Option<PathBuf>,
    /// Settings that differ from the defaults.
    #[arg(long, global = true)]
    config: Option<PathBuf>,
}

#[derive(Subcommand)]
pub enum Question {
    /// Which loops are closed, how true they are, and what they are worth; forward, and forward then backward.
    Loops,
    /// Whether a camera that was covered is found again, and how soon.
    Trials {
        /// Trials over all sequences.
        #[arg(long, default_value_t = 200)]
        count: usize,
        /// Of the moments at which the camera is covered.
        #[arg(long, default_value_t = 0)]
        seed: u64,
    },
    /// Whether keyframes, memory and time stay flat while a sequence is played to and fro.
    Soak {
        /// Times that it is played, forward and backward counted apart.
        #[arg(long, default_value_t = 20)]
        rounds: usize,
    },
    /// Whether places that are not in the map are taken for places that are: the first part is mapped, the whole is sought in it.
    Strangers {
        /// Share of the sequence that is mapped.
        #[arg(long, default_value_t = 0.45)]
        mapped: f64,
    },
    /// How many places are recognised without a single error, beside a bag of words trained on the same map.
    Recall {
        /// Share of the sequence that is mapped.
        #[arg(long, default_value_t = 0.5)]
        mapped: f64,
    },
    /// A live camera: frames at 30 Hz, mapping on its own thread; start-up; localisation in the saved map.
    Live,
}

pub fn run(arguments: Arguments) -> Result<()> {
    let config = match &arguments.config {
        Some(path) => yfslam::Config::from_toml(&std::fs::read_to_string(path)?)?,
        None => yfslam::Config::default(),
    };
    let open = |spec: &String| Film::open(spec, arguments.detector.as_deref(), &config);
    match arguments.question {
        Question::Loops => loops::table(&config, arguments.sequences.iter().map(open)),
        Question::Trials { count, seed } => {
            relocalisation::table(&config, count, seed, arguments.sequences.len(), arguments.sequences.iter().map(open))
        }
        Question::Soak { rounds } => endurance::table(&config, rounds, arguments.sequences.iter().map(open)),
        Question::Strangers { mapped } => false_positives::table(&config, mapped, arguments.sequences.iter().map(open)),
        Question::Recall { mapped } => recall::table(&config, mapped, arguments.sequences.iter().map(open)),
        Question::Live => live::table(&config, arguments.sequences.iter().map(open)),
    }
}

//! The ROS 2 node of yfslam: images in; odometry, transforms and maps out; no ROS installation.
//!
//! ```text
//! DDS ──messages──► inbox ──newest pair──► LiveSession ──pose──► odom_split ──► odometry, pose, /tf
//!                   sync     events          yfslam-live          REP 105
//!                              │                │
//!                              ▼                └──map──► path, landmarks, grid (on a thread of its own)
//!                            node ──► answers, diagnostics, files
//! ```
//!
//! The node knows its network by the trait [`transport::Transport`] only. This file has arguments and signals.
#![forbid(unsafe_code)]

mod convert;
mod dds;
mod grid;
mod grid_worker;
mod inbox;
mod messages;
mod mount;
mod node;
mod odom_split;
mod parameters;
mod params_file;
mod ros_args;
mod slam_factory;
mod sync;
mod tf_tree;
mod transport;

use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use inbox::inbox;
use node::Node;
use parameters::{Kind, PARAMETERS, Parameters};
use ros_args::{Names, RosArgs};

const HELP: &str = "\
yfslam-ros2: visual SLAM for scenes with people as a node of ROS 2; no ROS installation is needed.

Usage: yfslam-ros2 [--domain N] [--ros-args [-r FROM:=TO]... [-p NAME:=VALUE]... [--params-file FILE]...]

  --domain N     DDS domain [default: ROS_DOMAIN_ID, else 0]
  -h, --help     this text
  -V, --version  the version

Example:
  yfslam-ros2 --ros-args -p base_frame:=base_link -p map_file:=lab.map

Subscribes (parameters color_topic, depth_topic, camera_info_topic), /tf, /tf_static, /initialpose, and /clock with use_sim_time
Publishes  odom, ~/pose, /tf, map (occupancy grid), ~/path, ~/landmarks, ~/graph, ~/people, /diagnostics
Services   ~/save_map, ~/load_map, ~/reset, ~/pause, ~/resume, ~/localise, ~/extend (std_srvs/Trigger), and those of parameters

SIGINT (Ctrl-C) and SIGTERM end the node; map and trajectory are saved if save_on_exit and trajectory_file say so. A second signal ends
it at once. RUST_LOG=warn, info or debug sets what is logged.

Parameters (* can be set while the node runs):
";

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<()> {
    let arguments = RosArgs::parse(std::env::args().skip(1)).map_err(anyhow::Error::msg)?;
    let mut domain = std::env::var("ROS_DOMAIN_ID").ok();
    let mut rest = arguments.rest.iter();
    while let Some(argument) = rest.next() {
        match argument.as_str() {
            "-h" | "--help" => return print(&help()),
            "-V" | "--version" => return print(concat!("yfslam-ros2 ", env!("CARGO_PKG_VERSION"), "\n")),
            "--domain" => domain = Some(rest.next().context("--domain needs a number")?.clone()),
            other => bail!("{other} is not understood; see --help"),
        }
    }
    let domain = match domain.as_deref().map(str::trim) {
        None | Some("") => 0,
        // Higher domains have no ports.
        Some(text) => text
            .parse()
            .ok()
            .filter(|n| *n <= 232)
            .with_context(|| format!("the domain is {text}; give a number from 0 to 232"))?,
    };
    set_up_log();
    let names = Names::new(&arguments, "yfslam");
    let parameters = parameters(&arguments, &names)?;
    let (inbox, outbox) =
        inbox((parameters.number("sync_tolerance") * 1e9) as i64, parameters.number("depth_units_per_metre"));
    let asked = watch_signals()?;
    let transport = dds::start(&names, domain, &parameters, inbox)?;
    tracing::info!("node {} in domain {domain}", names.resolve("~").trim_end_matches('/'));
    let mut node = Node::new(transport, outbox, parameters, &names.node, Instant::now())?;
    while !asked.load(Ordering::SeqCst) && node.spin_once()? {}
    node.finish()
}

/// Returns the parameters of files and arguments; the later one counts.
fn parameters(arguments: &RosArgs, names: &Names) -> Result<Parameters> {
    let mut parameters = Parameters::default();
    for file in &arguments.files {
        let text = yfslam_io::read_file(Path::new(file))?;
        let text = String::from_utf8(text).with_context(|| format!("{} is not UTF-8", file.display()))?;
        for (name, value) in params_file::parse(&text, names).map_err(|error| anyhow!("{}: {error}", file.display()))? {
            parameters.set(&name, &value).map_err(|error| anyhow!("{}: {error}", file.display()))?;
        }
    }
    for (name, value) in &arguments.parameters {
        parameters.set(name, value).map_err(anyhow::Error::msg)?;
    }
    Ok(parameters)
}

/// The first signal ends the node in order, the second one at once.
fn watch_signals() -> Result<Arc<AtomicBool>> {
    let asked = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        flag::register_conditional_shutdown(signal, 128 + signal, asked.clone())
            .and_then(|_| flag::register(signal, asked.clone()))
            .context("signals cannot be watched")?;
    }
    Ok(asked)
}

fn set_up_log() {
    let level = match std::env::var("RUST_LOG").as_deref() {
        Ok("error") => tracing::Level::ERROR,
        Ok("warn") => tracing::Level::WARN,
        Ok("debug") => tracing::Level::DEBUG,
        Ok("trace") => tracing::Level::TRACE,
        _ => tracing::Level::INFO,
    };
    let filter = tracing_subscriber::filter::Targets::new()
        .with_target("yfslam", level)
        .with_target("yfslam_ros2", level)
        .with_target("yfslam_live", level)
        .with_default(tracing::Level::ERROR);
    use tracing_subscriber::layer::SubscriberExt;
    use tracing_subscriber::util::SubscriberInitExt;
    let lines = tracing_subscriber::fmt::layer().with_writer(std::io::stderr).with_target(false);
    tracing_subscriber::registry().with(lines).with(filter).init();
}

fn help() -> String {
    let mut text = HELP.to_owned();
    for parameter in PARAMETERS {
        let kind = match parameter.kind {
            Kind::Choice(values) => format!(" ({})", values.join(", ")),
            Kind::Integer(_, least, most) => format!(" ({least} to {most})"),
            Kind::Number(_, least, most) => format!(" ({least} to {most})"),
            Kind::Bool(_) | Kind::Text(_) => String::new(),
        };
        let star = if parameter.live { "*" } else { " " };
        text += &format!("  {star} {} [{}]{kind}\n      {}\n", parameter.name, parameter.default(), parameter.help);
    }
    text
}

fn print(text: &str) -> Result<()> {
    Ok(std::io::stdout().write_all(text.as_bytes())?)
}

//! `yfslam calibrate`: fits the readout time of a rolling shutter, and the delay of the depth images, to a recording.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail, ensure};
use clap::Args;
use yfslam::config::DepthSource;
use yfslam::{Camera, Config};
use yfslam_io::camera::{camera_toml, write_camera};
use yfslam_io::prepare_folder;
use yfslam_report::{Table, TableStyle};

use crate::input::boxes;
use crate::input::detector::DetectorArgs;
use crate::input::settings::{MethodArg, SettingsArgs};
use crate::input::source::{Source, SourceArgs, open_sequence, reverse_readout};
use crate::run::calibration::{Calibrator, DelayFit, FittedReadout, ReadoutPass, fitted};
use crate::ui::interrupt::Interrupt;
use crate::ui::terminal::{Terminal, print};

const HELP: &str = "\
Examples:
  yfslam calibrate rgbd_bonn_crowd --camera bonn                    prints a camera file
  yfslam calibrate DIR --camera tum1 -o my-camera.toml              writes it, for --camera my-camera.toml
  yfslam calibrate DIR --end 600 --no-delay -o DIR/camera.toml --force
  yfslam calibrate 'synth:walking_rpy?readout=30&unknown_readout=on'

Recording:
  Twenty seconds or more of a scene with texture in which the camera moves fast and turns in all directions, without ground truth. A
  camera that stands still or only moves forward shows nothing of its shutter.

Method:
  The recording is tracked several times. Each time, the readout time is estimated from the reprojection errors that grow with the row and
  with the velocity, and the estimate is used for the next time, until both agree. With depth images, delays from -20 to 20 ms between
  colour and depth are then tried, and a parabola is fitted to the residuals of depth. Its minimum is the delay, or 0 if it is not clearly
  lower than without a delay. The readout_ms of the camera file is ignored, and its depth_delay_ms is replaced.

Camera file:
  All values of the camera with readout_ms, 0 for a global shutter, and depth_delay_ms. Without -o it is printed, with the tables as
  comments. The file appears whole or not at all. SIGINT (Ctrl-C) and SIGTERM end the command without it, with exit code 130 or 143.

Exit status:
  0  the readout time was found, or the shutter is global
  1  an error, or the estimate is uncertain: nothing was written";

/// Fit the readout time of a rolling shutter to a recording, and write a camera file.
#[derive(Args, Debug)]
#[command(after_help = HELP)]
pub struct CalibrateArgs {
    #[command(flatten)]
    source: SourceArgs,
    /// Method for dynamic scenes [default: full].
    #[arg(long, value_enum, value_name = "METHOD", help_heading = "System")]
    method: Option<MethodArg>,
    #[command(flatten)]
    settings: SettingsArgs,
    #[command(flatten)]
    detector: DetectorArgs,
    /// Do not fit the delay between colour and depth images; that of the camera file stays.
    #[arg(long, help_heading = "System")]
    no_delay: bool,
    /// Camera file to write, in TOML [default: it is printed].
    #[arg(short, long, value_name = "FILE.toml", help_heading = "Output")]
    out: Option<PathBuf>,
    /// Replace an existing camera file.
    #[arg(long, requires = "out", help_heading = "Output")]
    force: bool,
}

pub fn run(args: &CalibrateArgs, terminal: Terminal) -> Result<()> {
    let interrupt = Interrupt::watch()?;
    let config = args.config()?;
    if let Some(path) = &args.out {
        args.check_output(path)?;
    }
    let source = Source::open(&args.source, config.depth.source, None)?;
    ensure!(
        args.out.is_none() || source.camera.rectification.is_none(),
        "the images of {} are rectified by {}, and the camera file would be that of the rectified images; leave out --out",
        source.name,
        source.camera.origin
    );
    let mut camera = source.camera.camera.clone();
    if camera.readout_ms.is_some() {
        terminal.note(&format!("the readout time in {} is ignored for the fit", source.camera.origin));
    }
    let (boxes, _) = boxes::choose(&args.detector, &args.source, &config, &[config.dynamic.method], terminal)?;
    let (source_args, detector, frame_ms) = (&args.source, &args.detector, 1e3 / camera.fps);
    let interrupt = &interrupt;
    let calibrator = Calibrator { source: source_args, detector, config, frame_ms, boxes, interrupt, terminal };

    let passes = calibrator.fit_readout()?;
    let mut text = table_of_passes(&passes);
    let readout = match fitted(&passes, &calibrator.config) {
        Ok(readout) => readout,
        Err(error) => {
            terminal.result(&text)?;
            return Err(error);
        }
    };
    camera.readout_ms = Some(rounded(readout.readout_ms));
    if source.depth_source == DepthSource::Image && !args.no_delay {
        let fit = calibrator.fit_delay(readout.readout_ms)?;
        text += &format!("\n{}", table_of_delays(&fit));
        camera.depth_delay_ms = Some(rounded(fit.delay_ms));
        if fit.is_beyond {
            terminal.warn("the depths agree best with a delay beyond 20 ms, which is not used; check the time stamps of the images");
        }
    }
    text += &format!("\n{}\n", describe(&readout, &camera));
    if source.mirror.is_some() {
        // The file is for the recording as it was made.
        reverse_readout(&mut camera);
    }
    let (frames, depth_factor) = (source.stamps_ns.len(), source.camera.depth_factor);
    let about = format!(
        "{}, with the readout time fitted by `yfslam calibrate` to {frames} frames of {}, standard deviation {:.2} ms",
        source.camera.origin, source.name, readout.sigma_ms
    );
    match &args.out {
        None => print(&camera_toml(&camera, depth_factor, &format!("{text}\n{about}"))?),
        Some(path) => {
            write_camera(path, &camera, depth_factor, &about)?;
            terminal.result(&format!("{text}\nwritten to {}\n", path.display()))
        }
    }
}

impl CalibrateArgs {
    fn config(&self) -> Result<Config> {
        let mut config = self.settings.resolve()?;
        config.dynamic.method = self.method.map_or(config.dynamic.method, MethodArg::method);
        ensure!(
            !config.dynamic.detect_async,
            "--detect-async (dynamic.detect_async) is for live use, with results that differ from run to run; leave it out"
        );
        Ok(config)
    }

    /// Checks before the long work that the camera file can be written and used.
    fn check_output(&self, path: &Path) -> Result<()> {
        let name = path.display();
        ensure!(!path.is_dir(), "the camera file {name} cannot be written, because it is a folder; name a file");
        ensure!(
            path.extension().is_some_and(|extension| extension == "toml"),
            "the camera file {name} is written in TOML; give it a name such as camera.toml"
        );
        ensure!(self.force || !path.exists(), "{name} exists; choose another name, or replace it with --force");
        if !self.source.is_synthetic() && self.source.camera.is_none() {
            let (sequence, _) = open_sequence(&self.source, DepthSource::Image)?;
            if sequence.calibration.is_some() {
                bail!(
                    "the images of {} are rectified by its own calibration, which a camera file would replace; leave out --out",
                    self.source.sequence
                );
            }
        }
        Ok(prepare_folder(path.parent().unwrap_or(Path::new("")))?)
    }
}

/// Rounds to hundredths of a millisecond, far below the standard deviation.
fn rounded(ms: f64) -> f64 {
    // Adding 0 makes 0 of -0.
    (1e2 * ms).round() / 1e2 + 0.0
}

fn table_of_passes(passes: &[ReadoutPass]) -> String {
    let mut table = Table::new(["pass", "readout in use (ms)", "estimate (ms)", "standard deviation (ms)"]);
    let text = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.2}"));
    for (index, ReadoutPass { given_ms, readout }) in passes.iter().enumerate() {
        let given = given_ms.map_or("unknown".to_owned(), |ms| format!("{ms:.2}"));
        table.push([(index + 1).to_string(), given, text(readout.estimate_ms), text(readout.sigma_ms)]);
    }
    table.render(TableStyle::Plain)
}

fn table_of_delays(fit: &DelayFit) -> String {
    let mut table = Table::new(["delay of depth (ms)", "squared residual of depth"]);
    for (delay_ms, residual) in &fit.trials {
        table.push([format!("{delay_ms}"), residual.map_or("-".to_owned(), |residual| format!("{residual:.4}"))]);
    }
    let best = match fit.sigma_ms {
        Some(sigma_ms) if fit.delay_ms != 0.0 => format!("best: {:.1} ± {sigma_ms:.1} ms", fit.delay_ms),
        _ => "no delay is clearly better than none".to_owned(),
    };
    format!("{}{best}\n", table.render(TableStyle::Plain))
}

/// Describes the result in a line.
fn describe(readout: &FittedReadout, camera: &Camera) -> String {
    let FittedReadout { readout_ms, sigma_ms } = readout;
    let shutter = if *readout_ms == 0.0 {
        format!("global shutter (± {sigma_ms:.1} ms)")
    } else {
        format!("rolling shutter: {readout_ms:.1} ± {sigma_ms:.1} ms from the first to the last row")
    };
    let delay = camera.depth_delay_ms.map_or(String::new(), |ms| format!("; delay of depth: {ms:.1} ms"));
    shutter + &delay
}

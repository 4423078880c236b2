//! `yfslam info`: describes a sequence.

use std::fmt::Write;
use std::path::Path;

use anyhow::Result;
use clap::Args;
use yfslam::config::DepthSource;
use yfslam::{DepthImage, RgbImage};
use yfslam_io::bag::is_bag;
use yfslam_io::depth::check_depth_factor;
use yfslam_io::sequence::{AssociationReport, FrameEntry, Layout};
use yfslam_io::stream::{open_color, open_depth};
use yfslam_io::time::{format_stamp, seconds};
use yfslam_io::{CameraSource, DepthStatistics, Sequence};

use crate::input::source::{SourceArgs, describe_bag, open_sequence, world_camera};
use crate::ui::terminal::{explain, print};

/// Number of frames that are opened, spread evenly over the sequence.
const SAMPLES: usize = 20;

const HELP: &str = "\
Examples:
  yfslam info rgbd_dataset_freiburg1_xyz
  yfslam info DIR --camera bonn --association-tolerance 30
  yfslam info 'synth:walking_xyz?people=3'";

/// Describe a sequence: frames, rates, gaps, images, depth, camera, ground truth.
#[derive(Args, Debug)]
#[command(after_help = HELP)]
pub struct InfoArgs {
    #[command(flatten)]
    source: SourceArgs,
}

pub fn run(args: &InfoArgs) -> Result<()> {
    print(&if args.source.is_synthetic() { synthetic(&args.source)? } else { recorded(&args.source)? })
}

fn recorded(args: &SourceArgs) -> Result<String> {
    let topics = if is_bag(args.folder()) { describe_bag(args.folder())? } else { String::new() };
    let mut text = format!("{}\n{topics}", args.folder().display());
    let (sequence, camera) = match open_sequence(args, DepthSource::Image) {
        Err(error) if !topics.is_empty() => {
            writeln!(text, "frames        none: {}", explain(&error))?;
            return Ok(text);
        }
        opened => opened?,
    };
    writeln!(text, "kind          {}, {}", sequence.layout.name(), sensor(sequence.depth_source))?;
    writeln!(text, "              recognised: {}", sequence.because)?;
    for note in &sequence.notes {
        writeln!(text, "              {note}")?;
    }
    lists(&mut text, &sequence)?;
    timing(&mut text, &sequence)?;
    images(&mut text, &sequence, camera.as_ref().ok())?;
    match &camera {
        Ok(camera) => describe_camera(&mut text, camera)?,
        Err(error) => writeln!(text, "camera        not usable: {}", explain(error))?,
    }
    if let Ok(camera) = &camera
        && let Some(masks) = args.mask_tally(&sequence, &camera.camera)?
    {
        writeln!(text, "masks         {} of {} frames have a mask", masks.found, masks.found + masks.missing)?;
    }
    match sequence.ground_truth.path() {
        Some(path) => truth(&mut text, path, &sequence)?,
        None => writeln!(text, "ground truth  none")?,
    }
    Ok(text)
}

/// Returns the type of the camera.
fn sensor(depth_source: DepthSource) -> &'static str {
    match depth_source {
        DepthSource::Image => "RGB-D",
        DepthSource::Stereo => "stereo",
        DepthSource::Motion => "monocular",
    }
}

fn lists(text: &mut String, sequence: &Sequence) -> Result<()> {
    let AssociationReport { color_listed, paired_images_listed, paired, .. } = &sequence.report;
    let report = &sequence.report;
    match (sequence.layout, sequence.depth_source) {
        _ if report.from_associations_file => {
            writeln!(text, "lists         associations.txt: {color_listed} pairs listed, {paired} usable")?;
        }
        (_, DepthSource::Motion) => writeln!(text, "lists         {color_listed} images, {paired} usable")?,
        (Layout::Tum, DepthSource::Image) => {
            writeln!(
                text,
                "lists         rgb.txt {color_listed}, depth.txt {paired_images_listed} images; {paired} pairs"
            )?;
        }
        (_, DepthSource::Image) => {
            writeln!(text, "images        {color_listed} colour, {paired_images_listed} depth images; {paired} pairs")?;
        }
        _ => writeln!(text, "lists         {color_listed} left, {paired_images_listed} right images; {paired} pairs")?,
    }
    for (count, what) in [
        (report.color_unmatched, "colour images without a depth or right image in time"),
        (report.paired_images_unmatched, "depth or right images without a colour image in time"),
        (report.duplicates_skipped, "entries skipped: duplicate stamp"),
        (report.backward_skipped, "entries skipped: stamp runs backward"),
        (report.unstamped_skipped, "entries skipped: no time stamp (nan)"),
        (report.missing_files, "pairs of which a file is missing"),
    ] {
        if count > 0 {
            writeln!(text, "              {count} {what}")?;
        }
    }
    Ok(())
}

fn timing(text: &mut String, sequence: &Sequence) -> Result<()> {
    let info = sequence.info();
    let stamp = |entry: Option<&FrameEntry>| entry.map_or(String::new(), |e| format_stamp(e.timestamp_ns));
    let rate = info.rate_hz().map_or("unknown rate".to_owned(), |hz| format!("{hz:.2} Hz"));
    writeln!(text, "frames        {} in {:.3} s, {rate}", info.frames, seconds(info.duration_ns))?;
    writeln!(text, "              from {} to {}", stamp(sequence.entries.first()), stamp(sequence.entries.last()))?;
    let (median_ms, longest_ms) = (seconds(info.median_period_ns) * 1e3, seconds(info.max_gap_ns) * 1e3);
    writeln!(
        text,
        "gaps          {} longer than twice the median period of {median_ms:.1} ms; the longest is {longest_ms:.1} ms",
        info.gaps
    )?;
    let Some(offset) = info.offset else { return Ok(()) };
    writeln!(
        text,
        "offset        {} by {:.1} ms in the median, by {:.1} ms at most",
        if sequence.depth_source == DepthSource::Stereo { "right lags left" } else { "depth lags colour" },
        seconds(offset.median_ns) * 1e3,
        seconds(offset.max_abs_ns) * 1e3
    )?;
    Ok(())
}

/// Describes sizes and depths of some images, independent of the camera.
fn images(text: &mut String, sequence: &Sequence, camera: Option<&CameraSource>) -> Result<()> {
    // Without a camera, depth units are unknown and values are raw.
    let (factor, unit) = camera.map_or((1.0, "raw"), |source| (source.depth_factor, "m"));
    let step = sequence.entries.len().div_ceil(SAMPLES).max(1);
    let (mut sizes, mut depths, mut faults) = (Vec::new(), Vec::new(), Vec::new());
    let samples = sequence.entries.iter().step_by(step);
    let opened = samples.len();
    for entry in samples {
        match open_images(entry, sequence.depth_source, factor) {
            Ok((color, depth)) => {
                let of_depth = depth.as_ref().map(|depth| [depth.raw.width(), depth.raw.height()]);
                sizes.push(([color.width(), color.height()], of_depth));
                depths.extend(depth);
            }
            Err(fault) => faults.push(fault),
        }
    }
    sizes.sort_unstable();
    sizes.dedup();
    for ([width, height], of_depth) in sizes {
        let depth = of_depth.map_or(String::new(), |[width, height]| format!(", depth {width}×{height}"));
        writeln!(text, "images        colour {width}×{height}{depth} px")?;
    }
    if let Some(first) = faults.first() {
        writeln!(text, "              {} of {opened} opened frames are unusable; the first: {first:#}", faults.len())?;
    }
    let Some(d) = DepthStatistics::of(&depths) else { return Ok(()) };
    writeln!(
        text,
        "depth         median {:.3} {unit}, 5 to 95 % in {:.3} to {:.3} {unit}; {:.1} % of pixels measured ({} frames)",
        d.median_m,
        d.p5_m,
        d.p95_m,
        100.0 * d.valid_share,
        depths.len()
    )?;
    match check_depth_factor(&depths, factor) {
        _ if camera.is_none() => {}
        Err(error) => writeln!(text, "              implausible: {error}")?,
        Ok(depths) => {
            if let Some(warning) = depths.warning(factor) {
                writeln!(text, "              {warning}")?;
            }
        }
    }
    Ok(())
}

/// Opens the colour image, and the depth or right image; returns the colour and the depth image.
fn open_images(entry: &FrameEntry, depth_source: DepthSource, factor: f64) -> Result<(RgbImage, Option<DepthImage>)> {
    let (mut color, mut depth, mut right) = (RgbImage::default(), DepthImage::default(), RgbImage::default());
    let mut bytes = Vec::new();
    open_color(&entry.color, None, &mut bytes, &mut color)?;
    let Some(paired) = &entry.paired_image else { return Ok((color, None)) };
    if depth_source == DepthSource::Image {
        open_depth(&paired.image, None, factor, &mut bytes, &mut depth)?;
        return Ok((color, Some(depth)));
    }
    open_color(&paired.image, None, &mut bytes, &mut right)?;
    Ok((color, None))
}

fn describe_camera(text: &mut String, source: &CameraSource) -> Result<()> {
    let c = &source.camera;
    writeln!(text, "camera        {}", source.origin)?;
    writeln!(text, "              {}×{} px, fx {} fy {} cx {} cy {}", c.width, c.height, c.fx, c.fy, c.cx, c.cy)?;
    let [k1, k2, p1, p2, k3] = c.distortion;
    let [k4, k5, k6] = c.rational;
    let rational = if c.rational == [0.0; 3] { String::new() } else { format!(" k4 {k4} k5 {k5} k6 {k6}") };
    writeln!(
        text,
        "              k1 {k1} k2 {k2} p1 {p1} p2 {p2} k3 {k3}{rational}; depth factor {}, bf {}",
        source.depth_factor, c.bf
    )?;
    for note in &source.notes {
        writeln!(text, "              {note}")?;
    }
    Ok(())
}

fn truth(text: &mut String, path: &Path, sequence: &Sequence) -> Result<()> {
    let poses = match sequence.ground_truth.read(path) {
        Ok(file) => file.poses,
        Err(error) => return Ok(writeln!(text, "ground truth  not usable: {error}")?),
    };
    let Some((first, last)) = poses.first().zip(poses.last()) else { return Ok(()) };
    let apply = |stamp_ns| sequence.mirror.map_or(stamp_ns, |mirror| mirror.apply(stamp_ns));
    let covered = |e: &&FrameEntry| (first.timestamp_ns..=last.timestamp_ns).contains(&apply(e.timestamp_ns));
    let covered = sequence.entries.iter().filter(covered).count();
    let path_m: f64 = poses
        .windows(2)
        .map(|w| {
            w.first()
                .zip(w.last())
                .map_or(0.0, |(a, b)| (b.t_world_cam.translation.vector - a.t_world_cam.translation.vector).norm())
        })
        .sum();
    writeln!(
        text,
        "ground truth  {}: {} poses over {:.3} s and {path_m:.2} m; spans {covered} of {} frames",
        path.display(),
        poses.len(),
        seconds(last.timestamp_ns - first.timestamp_ns),
        sequence.entries.len()
    )?;
    Ok(())
}

fn synthetic(args: &SourceArgs) -> Result<String> {
    let config = args.world()?;
    let (frames, hz) = (config.frames, config.camera.fps);
    let share_percent = 100.0 * config.person_share;
    let mut text = format!("{}\n", args.sequence);
    writeln!(text, "frames        {frames} in {:.3} s, {hz} Hz, rendered during the run", (frames as f64 - 1.0) / hz)?;
    let depth_source = if config.stereo_m > 0.0 { DepthSource::Stereo } else { DepthSource::Image };
    writeln!(text, "kind          synthetic world, {}", sensor(depth_source))?;
    writeln!(text, "people        {}, intended to cover {share_percent:.0} % of the image", config.people)?;
    describe_camera(&mut text, &world_camera(&config))?;
    writeln!(text, "ground truth  exact")?;
    Ok(text)
}

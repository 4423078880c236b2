//! Recorded sequences: folders in one of the layouts that `yfslam-io` detects.

use std::io::ErrorKind;
use std::path::Path;
use std::time::Instant;

use anyhow::{Result, ensure};
use yfslam::config::DepthSource;
use yfslam::{Detection, Frame};
use yfslam_io::boxes::KnownDetections;
use yfslam_io::camera::check_camera;
use yfslam_io::decode::DecodeError;
use yfslam_io::sequence::Layout;
use yfslam_io::stream::DEFAULT_LOOK_AHEAD;
use yfslam_io::{
    BoxList, CameraSource, DepthStatistics, Error, FrameFault, FrameStream, Sequence, SequenceOptions, check_recording,
    complete_camera, detect_camera, load_camera,
};

use super::Source;
use super::args::{ASSOCIATION_TOLERANCE_MS, SourceArgs};
use super::frames::{FolderExtras, Frames, Player};
use super::masks::Masks;
use crate::stats::skip::Skip;
use crate::stats::stages::Stages;

/// Number of frames, spread over the sequence, that are checked if the first ones are unusable.
const PROBES: usize = 30;

/// Opens the folder with its camera, checks both against the first frames, and reads boxes of the classes `own_boxes`.
pub fn open(args: &SourceArgs, configured: DepthSource, own_boxes: Option<&[String]>) -> Result<Source> {
    let (sequence, camera) = open_sequence(args, configured)?;
    let camera = camera?;
    if !camera.unused_keys.is_empty() {
        tracing::info!(file = camera.origin, keys = ?camera.unused_keys, "keys of the camera file that are not used");
    }
    let depths = check(&sequence, &camera)?;
    let boxes = match own_boxes {
        Some(classes) => Some(BoxList::read(&args.boxes_file())?.detections(classes)),
        None => None,
    };
    let masks = args.masks.as_deref().map(|folder| Masks::open(folder, &sequence, &camera.camera)).transpose()?;
    let tally = masks.as_ref().map(|masks| masks.tally.clone());
    let stream = FrameStream::open(&sequence, &camera, DEFAULT_LOOK_AHEAD)?;
    let extras = FolderExtras { boxes, mirror: sequence.mirror, masks };
    let stamps_ns: Vec<i64> = sequence.entries.iter().map(|entry| entry.timestamp_ns).collect();
    let mut notes = vec![recognised(&sequence, &camera)];
    notes.extend(sequence.notes.iter().cloned());
    notes.extend(replaced_camera(args, &sequence));
    let mut warnings: Vec<String> = depths.and_then(|depths| depths.warning(camera.depth_factor)).into_iter().collect();
    if sequence.report.from_associations_file && args.association_tolerance.is_some() {
        let text = "--association-tolerance has no effect: the list already has the pairs of colour and depth images";
        warnings.push(text.into());
    }
    Ok(Source {
        name: name(args),
        notes,
        warnings,
        camera,
        depth_source: sequence.depth_source,
        frames: Frames::new(Player::Folder(Box::new((stream, extras))), sequence.depth_source, args, &stamps_ns),
        stamps_ns,
        topics: sequence.topics(),
        association: Some(sequence.report),
        truth_reader: Some(sequence.ground_truth),
        masks: tally,
        mirror: sequence.mirror,
    })
}

/// Checks camera and depth factor against the first frames or, if those are unusable, against frames of the whole sequence: some sensors
/// deliver unusable frames at the start.
fn check(sequence: &Sequence, camera: &CameraSource) -> Result<Option<DepthStatistics>> {
    let error = match check_recording(sequence, camera) {
        Ok(depths) => return Ok(depths),
        Err(error) => error,
    };
    let step = sequence.entries.len().div_ceil(PROBES).max(1);
    let entries = sequence.entries.iter().step_by(step).cloned().collect();
    match (&error, check_recording(&Sequence { entries, ..sequence.clone() }, camera)) {
        (Error::Content { .. }, Ok(depths)) => Ok(depths),
        _ => Err(error.into()),
    }
}

/// Reads the lists of the folder, and the camera: the requested one, or that of the folder. Depth comes from `configured` unless a flag
/// says otherwise.
///
/// # Errors
/// The tolerance is negative or not a number, or the folder has no usable lists.
pub fn open_sequence(args: &SourceArgs, configured: DepthSource) -> Result<(Sequence, Result<CameraSource>)> {
    let tolerance_ms = args.association_tolerance.unwrap_or(ASSOCIATION_TOLERANCE_MS);
    ensure!(
        (0.0..=1e6).contains(&tolerance_ms),
        "--association-tolerance is {tolerance_ms}; give milliseconds, such as 20"
    );
    let options = SequenceOptions {
        depth_source: args.wanted_depth_source(configured),
        association_tolerance_ns: (tolerance_ms * 1e6) as i64,
        start: args.start,
        end: args.end,
        reverse: args.reverse,
        layout: args.layout,
        fps: args.fps,
        associations: args.associations.clone(),
        color_folder: args.color.clone(),
        depth_folder: args.depth.clone(),
        // The images are taken as they are: the calibration of the folder does not apply to another camera.
        read_calibration: args.camera.is_none(),
        topics: args.bag.choice(),
    };
    let sequence = Sequence::open(args.folder(), &options)?;
    ensure!(
        options.topics.is_empty() || sequence.layout == Layout::Bag,
        "{} is no bag and has no topics; leave out --color-topic and the like",
        args.sequence
    );
    let camera = camera(args, &sequence);
    Ok((sequence, camera))
}

/// Names the calibration of the layout that --camera replaces.
fn replaced_camera(args: &SourceArgs, sequence: &Sequence) -> Option<String> {
    let given = args.camera.as_ref()?;
    let own = sequence.unread_calibration.as_ref()?;
    let is_same =
        Path::new(given).canonicalize().ok().is_some_and(|given| own.canonicalize().is_ok_and(|own| own == given));
    (!is_same).then(|| format!("--camera {given} is used; {} is not read", own.display()))
}

fn camera(args: &SourceArgs, sequence: &Sequence) -> Result<CameraSource> {
    let mut source = match (&args.camera, &sequence.calibration) {
        (Some(spec), _) => load_camera(spec, Some(args.folder()))?,
        (None, Some(calibration)) => calibration.camera.clone(),
        (None, None) => detect_camera(args.folder())?,
    };
    if let Some(factor) = args.depth_factor {
        if !source.missing.depth_factor && factor != source.depth_factor {
            source.notes.push(format!("--depth-factor {factor} is used, not its own factor {}", source.depth_factor));
        }
        source.set_depth_factor(factor);
        source.origin += &format!(" with --depth-factor {factor}");
        check_camera(&source)?;
    }
    complete_camera(&mut source, sequence)?;
    if args.camera.is_some()
        && sequence.unread_calibration.is_none()
        && let Ok(own) = detect_camera(args.folder())
        && differs(&own, &source)
    {
        source.notes.push(format!("it is used, not the camera file of the folder, {}", own.origin));
    }
    Ok(source)
}

/// Describes in one line what the folder was taken for.
fn recognised(sequence: &Sequence, camera: &CameraSource) -> String {
    let (folder, layout, frames) = (sequence.folder.display(), sequence.layout.name(), sequence.entries.len());
    let sensor = match sequence.depth_source {
        DepthSource::Image => "RGB-D",
        DepthSource::Stereo => "stereo",
        DepthSource::Motion => "a single camera",
    };
    format!("{folder}: {layout}, {sensor}, {frames} frames; camera: {}", camera.origin)
}

/// Returns whether two calibrations differ in what both state.
fn differs(own: &CameraSource, used: &CameraSource) -> bool {
    let lens = |source: &CameraSource| {
        let c = &source.camera;
        ([c.fx, c.fy, c.cx, c.cy], c.distortion, c.rational)
    };
    let size = |source: &CameraSource| [source.camera.width, source.camera.height];
    lens(own) != lens(used) || (!own.missing.size && size(own) != size(used))
}

/// Returns the name of the folder, also for `.` and similar paths.
fn name(args: &SourceArgs) -> String {
    let folder = args.folder().canonicalize().unwrap_or_else(|_| args.folder().into());
    folder.file_name().map_or("sequence".into(), |name| name.to_string_lossy().into_owned())
}

/// Returns the next frame with its boxes and its mask.
pub fn next(stream: &mut FrameStream, extras: &FolderExtras, stages: &mut Stages) -> Option<Result<Frame, Skip>> {
    let before = stream.times();
    let frame = stream.next()?;
    let after = stream.times();
    stages.push("decode color", after.color - before.color);
    let paired = after.paired_image - before.paired_image;
    match stream.depth_source() {
        DepthSource::Image => stages.push("decode depth", paired),
        DepthSource::Stereo => stages.push("decode right", paired),
        DepthSource::Motion => {}
    }
    stages.push("decode wait", after.waited - before.waited);
    let frame = frame.map_err(|error| Skip { reason: reason(&error.fault), message: error.to_string() });
    Some(frame.and_then(|frame| extras.add_to(frame, stages)))
}

impl FolderExtras {
    /// Adds boxes and mask to the frame.
    fn add_to(&self, mut frame: Frame, stages: &mut Stages) -> Result<Frame, Skip> {
        let detections = self.boxes.as_ref().map(|boxes| self.boxes_at(boxes, frame.timestamp_ns));
        let started = Instant::now();
        let mask = match &self.masks {
            Some(masks) => masks.at(frame.timestamp_ns)?,
            None => None,
        };
        if self.masks.is_some() {
            stages.push("decode mask", started.elapsed());
        }
        (frame.detections, frame.mask) = (detections, mask);
        Ok(frame)
    }

    /// Returns the boxes of the frame that is played at this time; none if the file does not list it.
    fn boxes_at(&self, boxes: &KnownDetections, played_ns: i64) -> Vec<Detection> {
        let recorded_ns = self.mirror.map_or(played_ns, |mirror| mirror.apply(played_ns));
        boxes.get(&recorded_ns).cloned().unwrap_or_default()
    }
}

/// Returns the kind of fault, for counting.
fn reason(fault: &FrameFault) -> &'static str {
    match fault {
        FrameFault::Unreadable(Error::Read { source, .. }) if source.kind() == ErrorKind::NotFound => "missing file",
        FrameFault::Unreadable(_) => "unreadable file",
        FrameFault::Image { source, .. } => match source {
            DecodeError::UnknownFormat(_) | DecodeError::WrongKind { .. } => "wrong type of image",
            DecodeError::WrongSize { .. } | DecodeError::TooLarge(_) => "wrong size of image",
            DecodeError::Damaged(_) => "damaged image",
        },
        FrameFault::NotListed => "missing file",
        FrameFault::NoDepth { .. } => "no depth in any pixel",
        FrameFault::DecoderStopped => "decoder stopped",
    }
}

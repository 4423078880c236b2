//! Frames of another program on standard input, in the format of [`yfslam_io::FramePipe`].

use std::io::{BufReader, Stdin, stdin};

use anyhow::{Result, bail, ensure};
use yfslam::Frame;
use yfslam::config::DepthSource;
use yfslam_io::camera::check_camera;
use yfslam_io::{FramePipe, PipeHeader, load_camera};

use super::Source;
use super::args::SourceArgs;
use super::frames::{Frames, Player};
use crate::stats::skip::Skip;

/// Bytes that are read ahead.
const READ_AHEAD: usize = 1 << 20;

/// The frames of a pipe.
pub type Pipe = FramePipe<BufReader<Stdin>>;

/// Reads the header from standard input.
///
/// # Errors
/// It is of another format, or the camera is not known or cannot be used.
pub fn open(args: &SourceArgs, configured: DepthSource) -> Result<Source> {
    ensure!(
        args.start == 0 && args.end.is_none() && !args.reverse && args.masks.is_none() && args.associations.is_none(),
        "standard input is played as it comes; leave out --start, --end, --reverse, --masks and --associations"
    );
    let header = PipeHeader::read(BufReader::with_capacity(READ_AHEAD, stdin()))?;
    let mut camera = match (&args.camera, &header.camera) {
        (Some(spec), _) => load_camera(spec, None)?,
        (None, Some(camera)) => camera.clone(),
        (None, None) => bail!("the sender does not name its camera; give --camera"),
    };
    if let Some(factor) = args.depth_factor {
        camera.set_depth_factor(factor);
    }
    check_camera(&camera)?;
    ensure!(!camera.missing.size, "the camera {} has no size; give width and height in its camera file", camera.origin);
    let depth_source = args.wanted_depth_source(configured).unwrap_or(DepthSource::Image);
    let c = &camera.camera;
    Ok(Source {
        name: "live".into(),
        notes: vec![format!(
            "frames of {}x{} pixels come from standard input; camera: {}",
            c.width, c.height, camera.origin
        )],
        warnings: Vec::new(),
        depth_source,
        frames: Frames::new(Player::Pipe(Box::new(header.frames(&camera))), depth_source, args, &[]),
        camera,
        stamps_ns: Vec::new(),
        topics: None,
        association: None,
        truth_reader: None,
        masks: None,
        mirror: None,
    })
}

/// Returns the next frame.
pub fn next(pipe: &mut Pipe) -> Option<Result<Frame, Skip>> {
    Some(pipe.next()?.map_err(|message| Skip { reason: "wrong frame on standard input", message }))
}

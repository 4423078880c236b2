//! The frames of a video, as those of one camera.
//!
//! In: a file that `ffmpeg` decodes. Out: its frames, with the times in the file or those of a rate.

use std::path::Path;
use std::sync::Arc;

use yfslam::config::DepthSource;

use super::layout::{Listing, missing_images};
use super::pairs::{List, from_lists};
use super::{GroundTruthReader, ImageRef, ListedImage, SequenceOptions};
use crate::error::{Error, Result};
use crate::video::{Video, VideoFrame};

/// Lists the frames of the video at `path`.
pub fn list(path: &Path, options: &SequenceOptions) -> Result<Listing> {
    if let Some(wanted @ (DepthSource::Image | DepthSource::Stereo)) = options.depth_source {
        return Err(missing_images(path, wanted));
    }
    if options.reverse {
        let cure = "extract the frames (ffmpeg -i VIDEO FOLDER/%06d.png) and play the folder";
        return Err(Error::content(path, "is a video, which cannot be decoded in reverse order", cure));
    }
    let video = Arc::new(Video::open(path)?);
    let (stamps_ns, note) = match (options.fps, video.stamps_ns()) {
        (None, Some(stamps_ns)) => (stamps_ns, "the time stamps are those in the video".to_owned()),
        (None, None) => {
            let problem = "has frames without time stamps";
            return Err(Error::content(path, problem, "give the rate of the camera with --fps, such as --fps 30"));
        }
        (Some(fps), _) => {
            let stamp_ns = |frame: usize| (frame as f64 / fps * 1e9).round() as i64;
            (
                (0..video.frames()).map(stamp_ns).collect(),
                format!("the time stamps are those of {fps} frames per second"),
            )
        }
    };
    let frame =
        |(index, stamp_ns)| ListedImage { stamp_ns, image: ImageRef::Video(VideoFrame::new(video.clone(), index)) };
    let images = stamps_ns.into_iter().enumerate().map(frame).collect();
    let (entries, report) = from_lists(path, List { images, unstamped: 0, path: path.into() }, None, 0)?;
    Ok(Listing {
        depth_source: DepthSource::Motion,
        entries,
        report,
        calibration: None,
        ground_truth: GroundTruthReader::none(),
        notes: vec![note],
    })
}

//! Fills in what a camera file does not say from the recording to which it belongs.

use yfslam::config::DepthSource;

use crate::camera::CameraSource;
use crate::error::{Error, Result};
use crate::sequence::Sequence;
use crate::stream::open_color;

/// Prepares the rectification of a stereo pair that the camera file describes and that is not rectified; the camera is then the rectified left
/// one, and [`FrameStream`](crate::FrameStream) rectifies the images. Fills in the size of the images where the camera file has none, from the first readable colour image of a sequence of files, and
/// refuses what is missing still.
///
/// # Errors
/// As for [`CameraSource::complete`].
pub fn complete_camera(camera: &mut CameraSource, sequence: &Sequence) -> Result<()> {
    if sequence.depth_source == DepthSource::Stereo {
        camera.rectify(|| first_image_size(sequence))?;
    }
    camera.complete(sequence.depth_source, || first_image_size(sequence))
}

/// Images that are tried for their size.
const SIZE_ATTEMPTS: usize = 30;

fn first_image_size(sequence: &Sequence) -> Result<[usize; 2]> {
    let (mut bytes, mut image, mut first_error) = (Vec::new(), yfslam::RgbImage::default(), None);
    for entry in sequence.entries.iter().take(SIZE_ATTEMPTS) {
        let decoded = open_color(&entry.color, None, &mut bytes, &mut image).map_err(|fault| {
            Error::content(&sequence.folder, fault.to_string(), "give the size of the images in the camera file")
        });
        match decoded {
            Ok(_) => return Ok([image.width(), image.height()]),
            Err(error) => first_error = first_error.or(Some(error)),
        }
    }
    Err(first_error.unwrap_or_else(|| {
        Error::content(&sequence.folder, "contains no image", "give the size of the images in the camera file")
    }))
}

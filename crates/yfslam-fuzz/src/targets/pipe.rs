//! Frames on standard input, in the format of [`yfslam_io::FramePipe`].

use yfslam::Camera;
use yfslam_io::{CameraSource, PipeHeader};

use super::images::SIZE;

/// Most frames that are read.
const MOST_FRAMES: usize = 1_000;

/// A stream, with the camera that it names or a small one.
pub fn pipe(bytes: &[u8]) -> bool {
    let Ok(header) = PipeHeader::read(bytes) else { return false };
    let small = Camera::pinhole(SIZE.width, SIZE.height, 16.0, 16.0, 8.0, 6.0);
    let camera = header.camera.clone().unwrap_or_else(|| CameraSource::new(small, 1000.0, "fuzz"));
    let mut accepted = 0;
    for frame in header.frames(&camera).take(MOST_FRAMES).flatten() {
        let (width, height) = (frame.color.width(), frame.color.height());
        assert_eq!([width, height], [camera.camera.width, camera.camera.height], "an image has another size");
        accepted += 1;
    }
    accepted > 0
}

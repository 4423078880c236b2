//! Frames from another program through a pipe: a small binary format, version 1. All numbers are little endian.
//!
//! ```text
//! header   8 bytes  "YFSFRAME"
//!          u32      version, 1
//!          u32      length of what follows
//!          bytes    camera file in any dialect of `--camera`, UTF-8; may be empty if the receiver knows the camera
//! frame    u32      length of what follows; 0 ends the stream
//!          i64      time stamp, ns
//!          images   one after the other, up to the length
//! image    u8       role: 1 colour or left, 2 depth, 3 right
//!          u8       encoding: 1 rgb8, 2 bgr8, 3 grey8, 4 depth of 16 bits, 5 a file (PNG, JPEG, PGM, …)
//!          u16      0
//!          u32      length of what follows
//!          bytes    pixels row by row without padding, or the file
//! ```
//!
//! In: a reader. Out: the camera, and frames. A frame with a wrong image is reported, and the next one is read; a stream that ends in the
//! middle of a frame is reported once.

use std::io::{ErrorKind, Read};
use std::path::Path;

use yfslam::{DepthImage, Frame, RgbImage};

use crate::camera::{CameraSource, check_camera, parse_camera};
use crate::decode::{ImageSize, decode_color, decode_depth_image};
use crate::error::{Error, Result};

const MAGIC: &[u8; 8] = b"YFSFRAME";
const VERSION: u32 = 1;
/// Longest camera file, bytes.
const MAX_HEADER: u32 = 1 << 20;
/// Longest frame, bytes: four images of 16 megapixels.
const MAX_FRAME: u32 = 256 << 20;
/// The name of the stream in messages.
const NAME: &str = "standard input";
const CURE: &str = "send the format of the chapter on robots of the manual";

/// Reads frames from a pipe.
pub struct FramePipe<R> {
    from: R,
    size: ImageSize,
    depth_factor: f64,
    buffer: Vec<u8>,
    /// Number of the next frame, from 0.
    index: u64,
    has_ended: bool,
}

/// The beginning of a stream: the reader, and the camera that the sender has named.
pub struct PipeHeader<R> {
    from: R,
    /// The camera; `None` if the sender does not name it.
    pub camera: Option<CameraSource>,
}

impl<R: Read> PipeHeader<R> {
    /// Reads the header.
    ///
    /// # Errors
    /// The stream is not of this format and version, or its camera cannot be used.
    pub fn read(mut from: R) -> Result<Self> {
        let mut head = [0; 16];
        from.read_exact(&mut head).map_err(|error| broken(format!("ends before its header of 16 bytes ({error})")))?;
        let [version, length] = [8, 12].map(|at| u32_at(&head, at));
        if !head.starts_with(MAGIC) {
            return Err(broken("does not begin with YFSFRAME"));
        }
        if version != VERSION {
            return Err(broken(format!("has version {version}, but this program reads version {VERSION}")));
        }
        if length > MAX_HEADER {
            return Err(broken(format!("has a camera file of {length} bytes, but at most {MAX_HEADER} are read")));
        }
        let mut text = Vec::new();
        let read = from.by_ref().take(length.into()).read_to_end(&mut text);
        if read.is_err() || text.len() != length as usize {
            return Err(broken("ends inside its camera file"));
        }
        let text = String::from_utf8(text).map_err(|_| broken("has a camera file that is not UTF-8"))?;
        let camera = match text.trim() {
            "" => None,
            text => {
                let camera = parse_camera(text, Path::new(NAME))?;
                check_camera(&camera)?;
                Some(camera)
            }
        };
        Ok(Self { from, camera })
    }

    /// Begins to read frames of this camera.
    pub fn frames(self, camera: &CameraSource) -> FramePipe<R> {
        let size = ImageSize { width: camera.camera.width, height: camera.camera.height };
        let (from, depth_factor) = (self.from, camera.depth_factor);
        FramePipe { from, size, depth_factor, buffer: Vec::new(), index: 0, has_ended: false }
    }
}

impl<R: Read> Iterator for FramePipe<R> {
    type Item = std::result::Result<Frame, String>;

    /// Returns the next frame, or what is wrong with it.
    fn next(&mut self) -> Option<Self::Item> {
        if self.has_ended {
            return None;
        }
        match self.read_record() {
            Ok(true) => {
                let index = self.index;
                self.index += 1;
                Some(self.decode().map_err(|problem| format!("frame {index} of {NAME} {problem}")))
            }
            Ok(false) => {
                self.has_ended = true;
                None
            }
            Err(problem) => {
                self.has_ended = true;
                Some(Err(format!("{NAME} {problem} at frame {}; no more frames are read", self.index)))
            }
        }
    }
}

impl<R: Read> FramePipe<R> {
    /// Reads the bytes of a frame; returns whether there is one.
    fn read_record(&mut self) -> std::result::Result<bool, String> {
        let mut length = [0; 4];
        let mut filled = 0;
        while let Some(rest) = length.get_mut(filled..).filter(|rest| !rest.is_empty()) {
            match self.from.read(rest) {
                Ok(0) if filled == 0 => return Ok(false),
                Ok(0) => return Err("ends inside a length".into()),
                Ok(count) => filled += count,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(format!("cannot be read ({error})")),
            }
        }
        let length = u32::from_le_bytes(length);
        if length == 0 {
            return Ok(false);
        }
        if length > MAX_FRAME {
            return Err(format!("claims a frame of {length} bytes, but at most {MAX_FRAME} are read,"));
        }
        self.buffer.clear();
        match self.from.by_ref().take(length.into()).read_to_end(&mut self.buffer) {
            Ok(read) if read == length as usize => Ok(true),
            Ok(read) => Err(format!("ends after {read} of {length} bytes")),
            Err(error) => Err(format!("cannot be read ({error})")),
        }
    }

    fn decode(&self) -> std::result::Result<Frame, String> {
        let (stamp, mut rest) = self.buffer.split_first_chunk().ok_or("has no time stamp")?;
        let stamp_ns = i64::from_le_bytes(*stamp);
        let (mut color, mut depth, mut right) = (None, None, None);
        while !rest.is_empty() {
            let (head, after) = rest.split_first_chunk::<8>().ok_or("ends inside the head of an image")?;
            let length = u32_at(head, 4) as usize;
            let (bytes, after) = after
                .split_at_checked(length)
                .ok_or_else(|| format!("has an image of {length} bytes, of which {} are there", after.len()))?;
            rest = after;
            match head[0] {
                1 => color = Some(self.color(head[1], bytes)?),
                2 => depth = Some(self.depth(head[1], bytes)?),
                3 => right = Some(self.color(head[1], bytes)?),
                role => return Err(format!("has an image of role {role}; the roles are 1 to 3")),
            }
        }
        let mut frame = Frame::mono(stamp_ns, color.ok_or("has no colour image (role 1)")?);
        (frame.depth, frame.right) = (depth.map(Into::into), right.map(Into::into));
        Ok(frame)
    }

    fn color(&self, encoding: u8, bytes: &[u8]) -> std::result::Result<RgbImage, String> {
        let ImageSize { width, height } = self.size;
        match encoding {
            1 => RgbImage::from_rgb8(bytes, width, height, 3 * width).map_err(|error| wrong(1, error)),
            2 => RgbImage::from_bgr8(bytes, width, height, 3 * width).map_err(|error| wrong(1, error)),
            3 => RgbImage::from_gray8(bytes, width, height, width).map_err(|error| wrong(1, error)),
            5 => {
                let mut image = RgbImage::default();
                decode_color(bytes, Some(self.size), &mut image).map_err(|error| wrong(1, error))?;
                Ok(image)
            }
            other => Err(format!("has a colour image in encoding {other}; colour has 1, 2, 3 or 5")),
        }
    }

    fn depth(&self, encoding: u8, bytes: &[u8]) -> std::result::Result<DepthImage, String> {
        let ImageSize { width, height } = self.size;
        match encoding {
            4 => {
                let (values, _) = bytes.as_chunks::<2>();
                let measured = |raw: u16| if raw == u16::MAX { 0 } else { raw };
                let values: Vec<u16> = values.iter().map(|&value| measured(u16::from_le_bytes(value))).collect();
                let unit_m = (1.0 / self.depth_factor) as f32;
                DepthImage::from_u16(&values, width, height, width, unit_m).map_err(|error| wrong(2, error))
            }
            5 => {
                let mut image = DepthImage::default();
                decode_depth_image(bytes, Some(self.size), self.depth_factor, &mut image)
                    .map_err(|error| wrong(2, error))?;
                Ok(image)
            }
            other => Err(format!("has a depth image in encoding {other}; depth has 4 or 5")),
        }
    }
}

fn wrong(role: u8, error: impl std::fmt::Display) -> String {
    format!("has a wrong image of role {role}: {error}")
}

fn broken(problem: impl Into<String>) -> Error {
    Error::content(Path::new(NAME), problem, CURE)
}

/// Returns the number at this place of a head, which is there.
fn u32_at<const N: usize>(bytes: &[u8; N], at: usize) -> u32 {
    bytes.get(at..at + 4).and_then(|four| four.try_into().ok()).map_or(0, u32::from_le_bytes)
}

#[cfg(test)]
mod tests;

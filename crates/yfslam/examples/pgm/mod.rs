//! Reads binary PGM, the plainest grey image format.

use std::io::{Error, ErrorKind, Result};
use std::path::Path;

use yfslam::unstable::GrayImage;

/// The image in an 8-bit binary PGM file without comments.
pub fn read(path: impl AsRef<Path>) -> Result<GrayImage> {
    let path = path.as_ref();
    let bytes = std::fs::read(path)?;
    parse(&bytes)
        .ok_or_else(|| Error::new(ErrorKind::InvalidData, format!("{}: not an 8-bit binary PGM", path.display())))
}

fn parse(bytes: &[u8]) -> Option<GrayImage> {
    let mut fields = bytes.splitn(5, |byte| byte.is_ascii_whitespace());
    let magic = fields.next()?;
    let mut number = || std::str::from_utf8(fields.next()?).ok()?.parse::<usize>().ok();
    let (width, height, maximum) = (number()?, number()?, number()?);
    let pixels = fields.next()?;
    (magic == b"P5" && maximum == 255).then(|| GrayImage::from_vec(width, height, pixels.to_vec()))?
}

//! Binary PGM (`P5`) and PPM (`P6`) with 8 or 16 bits, as the Netpbm project defines them.

use yfslam::{Image, RgbImage};

use super::{COLOR_SIZE_CURE, DEPTH_KIND_CURE, DEPTH_SIZE_CURE, DecodeError, ImageSize, check_size};

/// The header of a file, and its samples.
struct Pnm<'a> {
    size: ImageSize,
    /// 1 for grey, 3 for colour.
    channels: usize,
    /// The value of white.
    max: usize,
    samples: &'a [u8],
}

pub fn decode_color(bytes: &[u8], expected: Option<ImageSize>, into: &mut RgbImage) -> Result<(), DecodeError> {
    let pnm = Pnm::read(bytes, expected, COLOR_SIZE_CURE)?;
    into.resize(pnm.size.width, pnm.size.height);
    // White becomes 255; of 16 bits the upper 8 are kept.
    let scaled = |value: usize| match pnm.max {
        255 => value as u8,
        65535 => (value >> 8) as u8,
        max => (value.min(max) * 255 / max) as u8,
    };
    let wide = pnm.bytes_per_sample() == 2;
    let sample = |sample: &[u8]| match sample {
        [high, low] if wide => scaled(usize::from(u16::from_be_bytes([*high, *low]))),
        [value, ..] => scaled(usize::from(*value)),
        [] => 0,
    };
    let pixels = pnm.samples.chunks_exact(pnm.bytes_per_sample() * pnm.channels);
    for (rgb, pixel) in into.data_mut().iter_mut().zip(pixels) {
        let mut samples = pixel.chunks_exact(pnm.bytes_per_sample()).map(sample);
        *rgb = match (samples.next(), samples.next(), samples.next()) {
            (Some(r), Some(g), Some(b)) => [r, g, b],
            (Some(grey), ..) => [grey; 3],
            _ => [0; 3],
        };
    }
    Ok(())
}

pub fn decode_depth(bytes: &[u8], expected: Option<ImageSize>, into: &mut Image<u16>) -> Result<(), DecodeError> {
    let pnm = Pnm::read(bytes, expected, DEPTH_SIZE_CURE)?;
    if (pnm.channels, pnm.bytes_per_sample()) != (1, 2) {
        let kind = if pnm.channels == 1 { "PGM" } else { "PPM" };
        let found = format!("a {kind} of {} bits", 8 * pnm.bytes_per_sample());
        return Err(DecodeError::WrongKind { found, cure: DEPTH_KIND_CURE });
    }
    into.resize(pnm.size.width, pnm.size.height);
    for (depth, bytes) in into.data_mut().iter_mut().zip(pnm.samples.as_chunks::<2>().0) {
        *depth = u16::from_be_bytes(*bytes);
    }
    Ok(())
}

impl<'a> Pnm<'a> {
    /// Reads the header and checks that all samples are there.
    fn read(bytes: &'a [u8], expected: Option<ImageSize>, cure: &'static str) -> Result<Self, DecodeError> {
        let damaged = |what: &str| DecodeError::Damaged(what.into());
        let (channels, mut rest) = match bytes {
            [b'P', b'5', rest @ ..] => (1, rest),
            [b'P', b'6', rest @ ..] => (3, rest),
            _ => return Err(damaged("its header does not begin with P5 or P6")),
        };
        let mut next = || number(&mut rest).ok_or_else(|| damaged("its header is incomplete"));
        let (width, height, max) = (next()?, next()?, next()?);
        // Exactly one blank separates the header from the samples.
        let [_, samples @ ..] = rest else { return Err(damaged("it has no pixels")) };
        let size = ImageSize { width, height };
        check_size(size, expected, cure)?;
        if !(1..=65535).contains(&max) {
            return Err(DecodeError::Damaged(format!("its largest value is {max}")));
        }
        let pnm = Self { size, channels, max, samples };
        let needed = width * height * channels * pnm.bytes_per_sample();
        if samples.len() < needed {
            return Err(DecodeError::Damaged(format!("it has {} of {needed} bytes of pixels", samples.len())));
        }
        Ok(pnm)
    }

    fn bytes_per_sample(&self) -> usize {
        if self.max > 255 { 2 } else { 1 }
    }
}

/// Reads a number after blanks and comments.
fn number(rest: &mut &[u8]) -> Option<usize> {
    loop {
        match rest {
            [b'#', ..] => {
                let end = rest.iter().position(|&byte| byte == b'\n')?;
                *rest = rest.get(end..)?;
            }
            [blank, tail @ ..] if blank.is_ascii_whitespace() => *rest = tail,
            _ => break,
        }
    }
    let digits = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
    let (text, tail) = rest.split_at_checked(digits)?;
    *rest = tail;
    std::str::from_utf8(text).ok()?.parse().ok()
}

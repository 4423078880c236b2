//! Animated PNG (PNG specification, third edition): a film without another program.

use anyhow::{Result, ensure};
use yfslam::RgbImage;

const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Collects images, each in colours of its own.
#[derive(Default)]
pub struct AnimatedPng {
    /// Head of the file with the palette of the first image.
    head: Vec<u8>,
    size: [usize; 2],
    /// The compressed pixels of each image.
    images: Vec<Vec<u8>>,
}

impl AnimatedPng {
    /// Adds an image; all must have the size of the first one.
    ///
    /// # Errors
    /// It is too large for PNG, or its size differs.
    pub fn push(&mut self, image: &RgbImage) -> Result<()> {
        let size = [image.width(), image.height()];
        ensure!(self.images.is_empty() || self.size == size, "the size of the images has changed");
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, size[0].try_into()?, size[1].try_into()?);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_compression(png::Compression::Balanced);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(image.data().as_flattened())?;
        writer.finish()?;
        let mut pixels = Vec::new();
        for (kind, content) in chunks(&bytes) {
            match kind {
                b"IDAT" => pixels.extend(content),
                b"IHDR" if self.images.is_empty() => self.head = content.to_vec(),
                _ => {}
            }
        }
        self.size = size;
        self.images.push(pixels);
        Ok(())
    }

    /// Returns the file; each image is shown for `seconds`.
    pub fn finish(self, seconds: f64) -> Vec<u8> {
        let mut out = SIGNATURE.to_vec();
        let count = self.images.len() as u32;
        put(&mut out, b"IHDR", &self.head);
        put(&mut out, b"acTL", &[count.to_be_bytes(), 0u32.to_be_bytes()].concat());
        let delay = (seconds * 1000.0).clamp(1.0, 60_000.0) as u16;
        let mut sequence = 0u32;
        for (number, pixels) in self.images.iter().enumerate() {
            let size = self.size.map(|side| (side as u32).to_be_bytes()).concat();
            let control =
                [&sequence.to_be_bytes()[..], &size, &[0; 8], &delay.to_be_bytes(), &1000u16.to_be_bytes(), &[0, 0]];
            put(&mut out, b"fcTL", &control.concat());
            sequence += 1;
            if number == 0 {
                put(&mut out, b"IDAT", pixels);
            } else {
                put(&mut out, b"fdAT", &[&sequence.to_be_bytes()[..], pixels].concat());
                sequence += 1;
            }
        }
        put(&mut out, b"IEND", &[]);
        out
    }
}

/// Iterates over the chunks of a PNG file.
fn chunks(bytes: &[u8]) -> impl Iterator<Item = (&[u8; 4], &[u8])> {
    let mut rest = bytes.get(SIGNATURE.len()..).unwrap_or_default();
    std::iter::from_fn(move || {
        let (length, after) = rest.split_first_chunk::<4>()?;
        let (kind, after) = after.split_first_chunk::<4>()?;
        let (content, after) = after.split_at_checked(u32::from_be_bytes(*length) as usize)?;
        rest = after.get(4..)?;
        Some((kind, content))
    })
}

fn put(out: &mut Vec<u8>, kind: &[u8; 4], content: &[u8]) {
    out.extend((content.len() as u32).to_be_bytes());
    let begin = out.len();
    out.extend(kind);
    out.extend(content);
    let checksum = crc32fast::hash(&out[begin..]);
    out.extend(checksum.to_be_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decoder_reads_every_image_with_its_duration() {
        let mut film = AnimatedPng::default();
        for grey in [10u8, 90, 200] {
            let mut image = RgbImage::new(31, 17);
            image.data_mut().fill([grey, 0, grey]);
            film.push(&image).unwrap();
        }
        assert!(film.push(&RgbImage::new(3, 3)).is_err());
        let bytes = film.finish(0.1);
        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
        assert_eq!(reader.info().animation_control().unwrap().num_frames, 3);
        for grey in [10u8, 90, 200] {
            let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut pixels).unwrap();
            assert_eq!(pixels[..3], [grey, 0, grey]);
            assert_eq!(reader.info().frame_control().unwrap().delay_num, 100);
        }
    }
}

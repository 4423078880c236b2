//! Baseline JPEG (ITU-T T.81) in small files for pages, recordings and videos.
//!
//! In: a colour image and a quality. Out: a file with colour at half resolution (4:2:0) and the Huffman tables of annex K. The same image
//! gives the same bytes on every machine.

use yfslam::RgbImage;

mod tables;

use tables::{AC_CHROMA, AC_LUMA, CHROMA, Codes, DC_CHROMA, DC_LUMA, LUMA, ZIGZAG};

/// Largest width and height of the format, px.
const MAX_SIDE_PX: usize = 65_535;
/// The scale factors of the transform of Arai, Agui and Nakajima, by which the quantisation is divided.
const SCALES: [f32; 8] = [1.0, 1.387_039_8, 1.306_563, 1.175_875_6, 1.0, 0.785_694_96, 0.541_196_1, 0.275_899_38];

/// 1.5 · 2²³: numbers near it are whole.
const ROUND: f32 = 12_582_912.0;

/// A block of 8 × 8 values, row by row.
type Block = [[f32; 8]; 8];

/// Encodes an image with a quality from 1 to 100, of which 75 to 90 are usual; `None` for an image without pixels or with a side of more than
/// 65,535 px, which JPEG cannot hold.
pub fn encode_jpeg(image: &RgbImage, quality: u8) -> Option<Vec<u8>> {
    let (width, height) = (image.width(), image.height());
    let is_possible = (1..=MAX_SIDE_PX).contains(&width) && (1..=MAX_SIDE_PX).contains(&height);
    is_possible.then(|| {
        let mut out = Vec::with_capacity(width * height / 4 + 1024);
        let [luma, chroma] = [&LUMA, &CHROMA].map(|table| scaled(table, quality));
        write_head(&mut out, [width as u16, height as u16], [&luma, &chroma]);
        let mut planes = [Plane::new(&luma, &DC_LUMA, &AC_LUMA), Plane::new(&chroma, &DC_CHROMA, &AC_CHROMA)];
        let mut bits = Bits { out, waiting: 0, count: 0 };
        let mut last = [0; 3];
        for top in (0..height).step_by(16) {
            for left in (0..width).step_by(16) {
                let (luma, chroma) = macroblock(image, left, top);
                for mut block in luma {
                    planes[0].encode(&mut block, &mut last[0], &mut bits);
                }
                for (mut block, last) in chroma.into_iter().zip(&mut last[1..]) {
                    planes[1].encode(&mut block, last, &mut bits);
                }
            }
        }
        bits.finish()
    })
}

/// Returns the quantisation table for a quality, by the usual formula.
fn scaled(table: &[u8; 64], quality: u8) -> [u8; 64] {
    let quality = u32::from(quality.clamp(1, 100));
    let percent = if quality < 50 { 5000 / quality } else { 200 - 2 * quality };
    table.map(|value| ((u32::from(value) * percent + 50) / 100).clamp(1, 255) as u8)
}

/// Writes everything up to the first coefficient.
fn write_head(out: &mut Vec<u8>, [width, height]: [u16; 2], quantisation: [&[u8; 64]; 2]) {
    out.extend(b"\xff\xd8\xff\xe0\x00\x10JFIF\x00\x01\x01\x00\x00\x01\x00\x01\x00\x00");
    for (number, table) in (0..).zip(quantisation) {
        out.extend([0xff, 0xdb, 0, 67, number]);
        out.extend(ZIGZAG.map(|at| table[usize::from(at)]));
    }
    out.extend([0xff, 0xc0, 0, 17, 8]);
    out.extend([height, width].into_iter().flat_map(u16::to_be_bytes));
    out.extend([3, 1, 0x22, 0, 2, 0x11, 1, 3, 0x11, 1]);
    for (number, codes) in [(0, &DC_LUMA), (0x10, &AC_LUMA), (1, &DC_CHROMA), (0x11, &AC_CHROMA)] {
        out.extend([0xff, 0xc4]);
        out.extend((19 + codes.values.len() as u16).to_be_bytes());
        out.push(number);
        out.extend(codes.counts);
        out.extend(codes.values);
    }
    out.extend([0xff, 0xda, 0, 12, 3, 1, 0, 2, 0x11, 3, 0x11, 0, 63, 0]);
}

/// Returns the four blocks of brightness and the two of colour of the 16 × 16 px at a place; beyond the image its last pixels are repeated.
fn macroblock(image: &RgbImage, left: usize, top: usize) -> ([Block; 4], [Block; 2]) {
    let (mut luma, mut chroma) = ([[[0.0; 8]; 8]; 4], [[[0.0; 8]; 8]; 2]);
    let last = image.width() - 1;
    for y in 0..16 {
        let row = image.row((top + y).min(image.height() - 1));
        let mut pixels = [[0; 3]; 16];
        match row.get(left..left + 16) {
            Some(inside) => pixels.copy_from_slice(inside),
            None => pixels.iter_mut().enumerate().for_each(|(x, pixel)| *pixel = row[(left + x).min(last)]),
        }
        let [r, g, b] =
            [0, 1, 2].map(|channel| -> [f32; 16] { std::array::from_fn(|x| f32::from(pixels[x][channel])) });
        let mix = |by: [f32; 3]| -> [f32; 16] { std::array::from_fn(|x| by[0] * r[x] + by[1] * g[x] + by[2] * b[x]) };
        let bright = mix([0.299, 0.587, 0.114]);
        for (half, values) in bright.chunks_exact(8).enumerate() {
            luma[2 * (y / 8) + half][y % 8] = std::array::from_fn(|x| values[x] - 128.0);
        }
        // The mean of four pixels.
        let colors = [mix([-0.168_736, -0.331_264, 0.5]), mix([0.5, -0.418_688, -0.081_312])];
        for (block, values) in chroma.iter_mut().zip(colors) {
            let line = &mut block[y / 2];
            *line = std::array::from_fn(|x| line[x] + 0.25 * (values[2 * x] + values[2 * x + 1]));
        }
    }
    (luma, chroma)
}

/// How the blocks of one kind are quantised and encoded.
struct Plane {
    /// What a coefficient of the transposed transform is multiplied with.
    factors: Block,
    dc: [(u16, u8); 256],
    ac: [(u16, u8); 256],
}

impl Plane {
    fn new(quantisation: &[u8; 64], dc: &Codes, ac: &Codes) -> Self {
        let mut factors = [[0.0; 8]; 8];
        for (at, factor) in factors.as_flattened_mut().iter_mut().enumerate() {
            let (column, row) = (at / 8, at % 8);
            *factor = 1.0 / (8.0 * f32::from(quantisation[8 * row + column]) * SCALES[row] * SCALES[column]);
        }
        Self { factors, dc: dc.by_value(), ac: ac.by_value() }
    }

    fn encode(&mut self, block: &mut Block, last: &mut i32, bits: &mut Bits) {
        transform(block);
        let mut transposed = transpose(block);
        transform(&mut transposed);
        let mut levels = [0i32; 64];
        let scaled = transposed.as_flattened().iter().zip(self.factors.as_flattened());
        for (level, (value, factor)) in levels.iter_mut().zip(scaled) {
            // Adding a large number rounds, without a conversion that has to check the range.
            *level = (value * factor + ROUND).to_bits() as i32 - ROUND.to_bits() as i32;
        }
        // The rows of the transposed block are the columns of the file.
        let mut ordered = ZIGZAG.map(|at| levels[usize::from(at % 8 * 8 + at / 8)].clamp(-1023, 1023));
        let difference = ordered[0] - std::mem::replace(last, ordered[0]);
        ordered[0] = 0;
        bits.put_level(&self.dc, 0, difference);
        let mut zeros = 0;
        let end = ordered.iter().rposition(|level| *level != 0).unwrap_or(0);
        for level in &ordered[1..=end.max(1)] {
            match level {
                0 => zeros += 1,
                level => {
                    while zeros > 15 {
                        bits.put(self.ac[0xf0]);
                        zeros -= 16;
                    }
                    bits.put_level(&self.ac, zeros, *level);
                    zeros = 0;
                }
            }
        }
        if end < 63 {
            bits.put(self.ac[0]);
        }
    }
}

fn transpose(block: &Block) -> Block {
    std::array::from_fn(|row| std::array::from_fn(|column| block[column][row]))
}

/// Transforms all columns at once (Arai, Agui and Nakajima, Transactions of the IEICE 1988).
fn transform(rows: &mut Block) {
    let add = |a: [f32; 8], b: [f32; 8]| -> [f32; 8] { std::array::from_fn(|i| a[i] + b[i]) };
    let sub = |a: [f32; 8], b: [f32; 8]| -> [f32; 8] { std::array::from_fn(|i| a[i] - b[i]) };
    let times = |a: [f32; 8], by: f32| -> [f32; 8] { a.map(|value| value * by) };
    let [r0, r1, r2, r3, r4, r5, r6, r7] = *rows;
    let (s0, s1, s2, s3) = (add(r0, r7), add(r1, r6), add(r2, r5), add(r3, r4));
    let (d0, d1, d2, d3) = (sub(r0, r7), sub(r1, r6), sub(r2, r5), sub(r3, r4));
    let (even0, even1, even2, even3) = (add(s0, s3), add(s1, s2), sub(s1, s2), sub(s0, s3));
    let turned = times(add(even2, even3), 0.707_106_77);
    let (odd0, odd1, odd2) = (add(d3, d2), add(d2, d1), add(d1, d0));
    let z5 = times(sub(odd0, odd2), 0.382_683_43);
    let z2 = add(times(odd0, 0.541_196_1), z5);
    let z4 = add(times(odd2, 1.306_563), z5);
    let z3 = times(odd1, 0.707_106_77);
    let (z11, z13) = (add(d0, z3), sub(d0, z3));
    *rows = [
        add(even0, even1),
        add(z11, z4),
        add(even3, turned),
        sub(z13, z2),
        sub(even0, even1),
        add(z13, z2),
        sub(even3, turned),
        sub(z11, z4),
    ];
}

/// Bits on their way into bytes.
struct Bits {
    out: Vec<u8>,
    waiting: u64,
    count: u32,
}

impl Bits {
    fn put(&mut self, (code, length): (u16, u8)) {
        self.put_bits(u32::from(code), u32::from(length));
    }

    fn put_bits(&mut self, bits: u32, length: u32) {
        self.waiting = self.waiting << length | u64::from(bits);
        self.count += length;
        while self.count >= 8 {
            self.count -= 8;
            let byte = (self.waiting >> self.count) as u8;
            self.out.push(byte);
            // A byte of ones would begin a marker.
            if byte == 0xff {
                self.out.push(0);
            }
        }
    }

    /// Writes the code for a number of zeros and the size of a value, then the value.
    fn put_level(&mut self, codes: &[(u16, u8); 256], zeros: usize, value: i32) {
        let size = 32 - value.unsigned_abs().leading_zeros();
        let (code, length) = codes[zeros << 4 | size as usize];
        let value = if value < 0 { value - 1 } else { value };
        let value = value as u32 & ((1 << size) - 1);
        self.put_bits(u32::from(code) << size | value, u32::from(length) + size);
    }

    fn finish(mut self) -> Vec<u8> {
        self.put((0x7f, 7));
        self.out.extend([0xff, 0xd9]);
        self.out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode::decode_color;

    /// A smooth image with edges.
    fn scene(width: usize, height: usize) -> RgbImage {
        let mut image = RgbImage::new(width, height);
        for y in 0..height {
            for (x, pixel) in image.row_mut(y).iter_mut().enumerate() {
                let edge = if (x / 20 + y / 14) % 2 == 0 { 60 } else { 0 };
                *pixel = [
                    edge + (x * 150 / width) as u8,
                    30 + edge + (y * 120 / height) as u8,
                    200 - (x * 100 / width) as u8,
                ];
            }
        }
        image
    }

    #[test]
    fn another_decoder_reads_the_image_at_any_size() {
        for (width, height) in [(640, 480), (33, 17), (16, 16), (1, 1), (7, 200)] {
            let image = scene(width, height);
            let bytes = encode_jpeg(&image, 90).unwrap();
            let mut again = RgbImage::default();
            decode_color(&bytes, None, &mut again).unwrap();
            assert_eq!((again.width(), again.height()), (width, height));
            let errors = image.data().as_flattened().iter().zip(again.data().as_flattened());
            let squared: f64 = errors.map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2)).sum();
            let rms = (squared / (3 * width * height) as f64).sqrt();
            assert!(rms < 6.0, "{width} x {height}: {rms}");
        }
    }

    #[test]
    fn a_lower_quality_is_smaller_and_impossible_sizes_are_refused() {
        let image = scene(320, 240);
        let [low, high] = [40, 95].map(|quality| encode_jpeg(&image, quality).unwrap().len());
        assert!(low * 2 < high && high < 320 * 240, "{low} {high}");
        assert!(encode_jpeg(&RgbImage::default(), 80).is_none());
        assert!(encode_jpeg(&RgbImage::new(65_536, 1), 80).is_none());
    }

    #[test]
    fn white_noise_keeps_every_code_within_the_format() {
        let mut state = 1u32;
        let mut image = RgbImage::new(64, 64);
        for value in image.data_mut().as_flattened_mut() {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *value = if state >> 31 == 0 { 0 } else { 255 };
        }
        let mut again = RgbImage::default();
        decode_color(&encode_jpeg(&image, 100).unwrap(), None, &mut again).unwrap();
    }
}

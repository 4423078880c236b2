//! Colours from the mosaic of a sensor with one colour per pixel, by bilinear interpolation.

use yfslam::RgbImage;

/// Where the red pixels are: in even or odd columns and rows. Blue is diagonal to red, green is in between.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mosaic {
    red_x: usize,
    red_y: usize,
}

impl Mosaic {
    /// Returns the mosaic of an encoding such as `bayer_rggb8`.
    pub fn of(encoding: &str) -> Option<Self> {
        let (red_x, red_y) = match encoding {
            "bayer_rggb8" => (0, 0),
            "bayer_grbg8" => (1, 0),
            "bayer_gbrg8" => (0, 1),
            "bayer_bggr8" => (1, 1),
            _ => return None,
        };
        Some(Self { red_x, red_y })
    }
}

/// Interpolates the two missing colours of each pixel as the mean of the neighbours that have them. At the border the image is mirrored.
pub fn demosaic(mosaic: Mosaic, rows: &[&[u8]], into: &mut RgbImage) {
    let (width, height) = (into.width(), into.height());
    let at = |x: usize, y: usize| u32::from(rows.get(y).and_then(|row| row.get(x)).copied().unwrap_or(0));
    // A mirrored neighbour has the same colour as the one it replaces.
    let mirrored = |index: usize, length: usize| match index {
        0 => (1.min(length - 1), 1.min(length - 1)),
        _ if index + 1 == length => (index - 1, index - 1),
        _ => (index - 1, index + 1),
    };
    for y in 0..height {
        let (up, down) = mirrored(y, height);
        for x in 0..width {
            let (left, right) = mirrored(x, width);
            let own = at(x, y) as u8;
            let mean = |sum: u32, bits: u32| ((sum + (1 << (bits - 1))) >> bits) as u8;
            let across = || mean(at(left, y) + at(right, y), 1);
            let along = || mean(at(x, up) + at(x, down), 1);
            let cross = || mean(at(left, y) + at(right, y) + at(x, up) + at(x, down), 2);
            let diagonal = || mean(at(left, up) + at(right, up) + at(left, down) + at(right, down), 2);
            let rgb = match (x % 2 == mosaic.red_x, y % 2 == mosaic.red_y) {
                (true, true) => [own, cross(), diagonal()],
                (false, false) => [diagonal(), cross(), own],
                // Green between red pixels of the same row, or of the same column.
                (false, true) => [across(), own, along()],
                (true, false) => [along(), own, across()],
            };
            into.row_mut(y)[x] = rgb;
        }
    }
}

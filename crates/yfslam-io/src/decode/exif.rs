//! Orientation of photos: phones store the image as the sensor has it, and in the Exif data of the JPEG how to turn it.
//!
//! Source: Exif 2.32, tag 0x0112, in the segment APP1.

use yfslam::{Image, RgbImage};

/// Tag of the orientation.
const ORIENTATION: u16 = 0x0112;

/// Most entries of a directory that are read.
const MAX_ENTRIES: usize = 512;

/// Returns the image as a viewer shows it: turned and mirrored by the orientation of the file, if it states one.
pub fn upright(bytes: &[u8], image: RgbImage) -> RgbImage {
    let (width, height) = (image.width(), image.height());
    let orientation = orientation(bytes).unwrap_or(1);
    if !(2..=8).contains(&orientation) || width == 0 || height == 0 {
        return image;
    }
    // From 5 on rows and columns change places.
    let (out_width, out_height) = if orientation >= 5 { (height, width) } else { (width, height) };
    let (right, bottom) = (width - 1, height - 1);
    let source = |x: usize, y: usize| match orientation {
        2 => (right - x, y),
        3 => (right - x, bottom - y),
        4 => (x, bottom - y),
        5 => (y, x),
        6 => (y, bottom - x),
        7 => (right - y, bottom - x),
        _ => (right - y, x),
    };
    let pixel = |index: usize| {
        let (x, y) = source(index % out_width, index / out_width);
        image.get(x, y).copied().unwrap_or_default()
    };
    let pixels = (0..out_width * out_height).map(pixel).collect();
    Image::from_vec(out_width, out_height, pixels).unwrap_or(image)
}

/// Returns the orientation, 1 to 8, that a JPEG states.
fn orientation(bytes: &[u8]) -> Option<u16> {
    let mut rest = bytes.strip_prefix(&[0xff, 0xd8])?;
    // Segments: a marker, and the length of what follows with its own two bytes.
    while let [0xff, marker, high, low, ..] = rest {
        let length = usize::from(u16::from_be_bytes([*high, *low]));
        let segment = rest.get(4..2 + length)?;
        match (marker, segment) {
            (0xe1, [b'E', b'x', b'i', b'f', 0, 0, tiff @ ..]) => return orientation_of(tiff),
            // The scan begins; Exif data stand before it.
            (0xda, _) => return None,
            _ => rest = rest.get(2 + length..)?,
        }
    }
    None
}

/// Returns the orientation in a TIFF header.
fn orientation_of(tiff: &[u8]) -> Option<u16> {
    let is_big = match tiff.get(..2)? {
        b"MM" => true,
        b"II" => false,
        _ => return None,
    };
    let u16_at = |at: usize| {
        let bytes = <[u8; 2]>::try_from(tiff.get(at..at.checked_add(2)?)?).ok()?;
        Some(if is_big { u16::from_be_bytes(bytes) } else { u16::from_le_bytes(bytes) })
    };
    let offset = <[u8; 4]>::try_from(tiff.get(4..8)?).ok()?;
    let first = (if is_big { u32::from_be_bytes(offset) } else { u32::from_le_bytes(offset) }) as usize;
    let entries = usize::from(u16_at(first)?).min(MAX_ENTRIES);
    let entry = (0..entries).map(|k| first + 2 + 12 * k).find(|&at| u16_at(at) == Some(ORIENTATION))?;
    u16_at(entry + 8)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A JPEG without an image that states an orientation.
    fn jpeg(orientation: u16, is_big: bool) -> Vec<u8> {
        let u16 = |v: u16| if is_big { v.to_be_bytes() } else { v.to_le_bytes() };
        let u32 = |v: u32| if is_big { v.to_be_bytes() } else { v.to_le_bytes() };
        let mut tiff = if is_big { b"MM\0\x2a".to_vec() } else { b"II\x2a\0".to_vec() };
        tiff.extend(u32(8));
        tiff.extend(u16(2));
        for (tag, value) in [(0x0110u16, 7u16), (ORIENTATION, orientation)] {
            tiff.extend([u16(tag), u16(3)].concat());
            tiff.extend(u32(1));
            tiff.extend([u16(value), [0, 0]].concat());
        }
        let mut file = vec![0xff, 0xd8, 0xff, 0xe0, 0, 4, 9, 9, 0xff, 0xe1];
        file.extend(((tiff.len() + 8) as u16).to_be_bytes());
        file.extend(b"Exif\0\0");
        file.extend(tiff);
        file
    }

    #[test]
    fn each_orientation_turns_the_image_as_a_viewer_does() {
        // a b c
        // d e f
        let pixel = |v: u8| [v; 3];
        let image = || RgbImage::from_vec(3, 2, b"abcdef".map(pixel).to_vec()).unwrap();
        for (orientation, width, expected) in [
            (1, 3, "abcdef"),
            (2, 3, "cbafed"),
            (3, 3, "fedcba"),
            (4, 3, "defabc"),
            (5, 2, "adbecf"),
            (6, 2, "daebfc"),
            (7, 2, "fcebda"),
            (8, 2, "cfbead"),
            (9, 3, "abcdef"),
        ] {
            for is_big in [false, true] {
                let turned = upright(&jpeg(orientation, is_big), image());
                let text: String = turned.data().iter().map(|[v, ..]| char::from(*v)).collect();
                assert_eq!((turned.width(), text.as_str()), (width, expected), "{orientation}");
            }
        }
    }

    #[test]
    fn files_without_or_with_damaged_exif_data_stay_as_they_are() {
        let whole = jpeg(6, true);
        for length in 0..whole.len() - 2 {
            assert_eq!(orientation(&whole[..length]), None, "cut to {length}");
        }
        let mut far = jpeg(6, false);
        let at = far.windows(4).position(|bytes| bytes == b"II\x2a\0").unwrap();
        far[at + 4..at + 8].copy_from_slice(&[255; 4]);
        assert_eq!(orientation(&far), None);
        assert_eq!(orientation(b"\x89PNG"), None);
    }
}

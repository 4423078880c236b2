use proptest::prelude::*;

use super::*;

const SIZE: ImageSize = ImageSize { width: 3, height: 2 };

/// A PNG of 3 × 2 pixels; `data` as the format packs it.
fn png(color: ::png::ColorType, depth: ::png::BitDepth, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut bytes, 3, 2);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if color == ::png::ColorType::Indexed {
        encoder.set_palette(&[10, 20, 30, 40, 50, 60]);
        encoder.set_trns(&[255, 128][..]);
    }
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(data).unwrap();
    writer.finish().unwrap();
    bytes
}

fn depth_png() -> Vec<u8> {
    let values: Vec<u8> = [0u16, 1, 256, 5000, 65535, 7].iter().flat_map(|v| v.to_be_bytes()).collect();
    png(::png::ColorType::Grayscale, ::png::BitDepth::Sixteen, &values)
}

/// A 16 × 8 JPEG, 4:2:0, of a horizontal ramp in red.
const JPEG: &[u8] = include_bytes!("../../tests/ramp.jpg");

fn color(bytes: &[u8]) -> Result<RgbImage, DecodeError> {
    let mut image = RgbImage::default();
    decode_color(bytes, None, &mut image).map(|()| image)
}

fn depth(bytes: &[u8]) -> Result<Image<u16>, DecodeError> {
    let mut image = Image::default();
    decode_depth(bytes, None, &mut image).map(|()| image)
}

#[test]
fn every_kind_of_colour_png_becomes_rgb() {
    use ::png::{BitDepth::*, ColorType::*};
    let ramp: Vec<u8> = (0..24).collect();
    let rgb = color(&png(Rgb, Eight, &ramp[..18])).unwrap();
    assert_eq!((rgb.width(), rgb.height(), rgb.data()[1], rgb.data()[5]), (3, 2, [3, 4, 5], [15, 16, 17]));
    assert_eq!(color(&png(Rgba, Eight, &ramp)).unwrap().data()[1], [4, 5, 6]);
    assert_eq!(color(&png(Grayscale, Eight, &ramp[..6])).unwrap().data()[4], [4; 3]);
    assert_eq!(color(&png(GrayscaleAlpha, Eight, &ramp[..12])).unwrap().data()[2], [4; 3]);
    assert_eq!(color(&png(Indexed, Eight, &[0, 1, 0, 0, 0, 1])).unwrap().data()[1], [40, 50, 60]);
    assert_eq!(color(&png(Grayscale, One, &[0b0100_0000, 0])).unwrap().data()[..2], [[0; 3], [255; 3]]);
}

#[test]
fn depth_keeps_all_sixteen_bits_and_65535_is_no_measurement() {
    assert_eq!(depth(&depth_png()).unwrap().data(), [0, 1, 256, 5000, 0, 7]);
}

fn mask(bytes: &[u8]) -> Result<Vec<u8>, DecodeError> {
    let mut image = Image::default();
    decode_mask(bytes, Some(SIZE), &mut image).map(|()| image.data().to_vec())
}

#[test]
fn a_mask_is_0_where_a_png_of_any_kind_is_black() {
    use ::png::{BitDepth::*, ColorType::*};
    assert_eq!(mask(&png(Grayscale, Eight, &[0, 1, 2, 0, 255, 7])).unwrap(), [0, 1, 2, 0, 255, 7]);
    let deep: Vec<u8> = [0u16, 1, 256, 5000, 65535, 0].iter().flat_map(|v| v.to_be_bytes()).collect();
    let found: Vec<bool> = mask(&png(Grayscale, Sixteen, &deep)).unwrap().iter().map(|value| *value > 0).collect();
    assert_eq!(found, [false, true, true, true, true, false]);
    assert_eq!(mask(&png(Grayscale, One, &[0b0100_0000, 0b0010_0000])).unwrap(), [0, 255, 0, 0, 0, 255]);
    // Transparency alone does not mark an object.
    assert_eq!(mask(&png(GrayscaleAlpha, Eight, &[0, 9, 3, 0, 0, 9, 0, 9, 0, 9, 0, 9])).unwrap(), [0, 3, 0, 0, 0, 0]);
    let error = mask(JPEG).unwrap_err().to_string();
    assert!(error.contains("JPEG") && error.contains("masks are PNG"), "{error}");
    let error = decode_mask(&depth_png(), Some(ImageSize { width: 4, height: 2 }), &mut Image::default());
    let error = error.unwrap_err().to_string();
    assert!(error.contains("3×2") && error.contains("4×2") && error.contains("colour images"), "{error}");
}

#[test]
fn a_jpeg_is_decoded_close_to_the_original() {
    let image = color(JPEG).unwrap();
    assert_eq!((image.width(), image.height()), (16, 8));
    for x in 0..16 {
        let [r, g, b] = image.row(4)[x];
        assert!(r.abs_diff(x as u8 * 16) <= 12 && g <= 12 && b <= 12, "column {x}: {:?}", [r, g, b]);
    }
}

#[test]
fn images_of_the_wrong_kind_are_refused_by_name() {
    use ::png::{BitDepth::*, ColorType::*};
    let refusal = |result: Result<Image<u16>, DecodeError>| result.unwrap_err().to_string();
    assert!(refusal(depth(&png(Grayscale, Eight, &[1; 6]))).contains("a PNG of 8-bit grey"));
    assert!(
        refusal(depth(&png(Rgb, Eight, &[1; 18]))).contains("a PNG of 8-bit RGB; depth images are 16-bit grey PNG")
    );
    assert!(refusal(depth(&png(GrayscaleAlpha, Sixteen, &[1; 24]))).contains("16-bit grey-alpha"));
    assert!(refusal(depth(JPEG)).contains("JPEG, which cannot store depth"));
    assert!(refusal(depth(b"")).contains("an empty file"));
    assert!(refusal(depth(b"P5\n3 2\n255\n123456")).contains("a PGM of 8 bits"));
    assert!(refusal(depth(b"P4\n3 2\n")).contains("PNM"));
    assert!(refusal(depth(b"RIFF0000WEBP")).contains("a WebP image; depth images are 16-bit grey PNG"));
    assert!(color(b"hello").unwrap_err().to_string().contains("unknown format"));
}

#[test]
fn another_size_than_the_cameras_is_refused_before_decoding() {
    let expected = Some(ImageSize { width: 4, height: 2 });
    let error = decode_depth(&depth_png(), expected, &mut Image::default()).unwrap_err().to_string();
    assert!(error.contains("3×2") && error.contains("4×2") && error.contains("register"), "{error}");
    let error = decode_color(JPEG, expected, &mut RgbImage::default()).unwrap_err().to_string();
    assert!(error.contains("16×8") && error.contains("camera file"), "{error}");
    decode_depth(&depth_png(), Some(SIZE), &mut Image::default()).unwrap();
}

#[test]
fn every_truncation_of_a_file_is_an_error() {
    let rgb = png(::png::ColorType::Rgb, ::png::BitDepth::Eight, &[7; 18]);
    for (whole, name) in [(rgb.as_slice(), "png"), (JPEG, "jpeg")] {
        for length in 0..whole.len() {
            assert!(color(&whole[..length]).is_err(), "{name} cut to {length} of {}", whole.len());
        }
    }
    let whole = depth_png();
    for length in 0..whole.len() {
        assert!(depth(&whole[..length]).is_err(), "depth cut to {length} of {}", whole.len());
    }
}

#[test]
fn a_forged_size_is_refused_before_memory_is_taken() {
    let mut forged = depth_png();
    forged[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
    // The checksum of the header is wrong too, so both errors are right; no terabyte may be requested.
    assert!(depth(&forged).is_err());
    assert_eq!(
        check_size(ImageSize { width: 1 << 20, height: 1 << 20 }, None, ""),
        Err(DecodeError::TooLarge(ImageSize { width: 1 << 20, height: 1 << 20 }))
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300), magic in 0..3usize) {
        let head: &[u8] = [&b"\x89PNG\r\n\x1a\n"[..], &b"\xff\xd8\xff"[..], b""][magic];
        let bytes = [head, &bytes].concat();
        let _ = (color(&bytes), depth(&bytes), mask(&bytes));
    }

    #[test]
    fn damaged_files_never_panic(edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8), jpeg: bool) {
        let mut bytes = if jpeg { JPEG.to_vec() } else { depth_png() };
        for (at, value) in edits {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        let _ = (color(&bytes), depth(&bytes), mask(&bytes));
    }
}

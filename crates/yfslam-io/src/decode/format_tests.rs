//! The formats besides PNG and JPEG.

use proptest::prelude::*;

use super::*;

const SIZE: Option<ImageSize> = Some(ImageSize { width: 3, height: 2 });

/// Depth in metres of 3 × 2 pixels, two of them without a measurement.
const METRES: [f32; 6] = [0.0, 0.5, f32::NAN, 2.0, 8.25, 31.5];

/// The same in the units of [`DepthImage::from_f32`].
const HALF_MILLIMETRES: [u16; 6] = [0, 1000, 0, 4000, 16_500, 63_000];

fn depth(bytes: &[u8]) -> Result<Vec<u16>, DecodeError> {
    let mut image = Image::default();
    decode_depth(bytes, SIZE, &mut image).map(|()| image.data().to_vec())
}

fn metres(bytes: &[u8], depth_factor: f64) -> Result<DepthImage, DecodeError> {
    let mut image = DepthImage::default();
    decode_depth_image(bytes, SIZE, depth_factor, &mut image).map(|()| image)
}

fn color(bytes: &[u8]) -> Result<Vec<[u8; 3]>, DecodeError> {
    let mut image = RgbImage::default();
    decode_color(bytes, SIZE, &mut image).map(|()| image.data().to_vec())
}

fn pnm(header: &str, samples: &[u8]) -> Vec<u8> {
    [header.as_bytes(), samples].concat()
}

fn npy(version: u8, header: &str, data: &[u8]) -> Vec<u8> {
    let mut file = vec![0x93, b'N', b'U', b'M', b'P', b'Y', version, 0];
    match version {
        1 => file.extend((header.len() as u16).to_le_bytes()),
        _ => file.extend((header.len() as u32).to_le_bytes()),
    }
    file.extend(header.as_bytes());
    file.extend(data);
    file
}

fn array(kind: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    npy(1, &format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n"), data)
}

const DEPTHS: [u16; 6] = [0, 1, 256, 5000, 65535, 7];

fn big_endian() -> Vec<u8> {
    DEPTHS.iter().flat_map(|v| v.to_be_bytes()).collect()
}

#[test]
fn a_pgm_of_16_bits_is_depth_and_every_pnm_is_colour() {
    let depth_of = |header: &str| depth(&pnm(header, &big_endian()));
    assert_eq!(depth_of("P5\n3 2\n65535\n").unwrap(), [0, 1, 256, 5000, 0, 7]);
    assert_eq!(depth_of("P5 # a comment\n# another\n3\t2\r\n10000\n").unwrap()[3], 5000);
    assert!(depth_of("P5\n4 2\n65535\n").unwrap_err().to_string().contains("4×2"));
    assert!(depth_of("P5\n3 2\n70000\n").unwrap_err().to_string().contains("70000"));
    assert!(depth(&pnm("P5\n3 2\n65535\n", &[0; 11])).unwrap_err().to_string().contains("11 of 12 bytes"));
    assert!(depth(b"P5\n3 2").unwrap_err().to_string().contains("header is incomplete"));
    let ramp: Vec<u8> = (0..18).collect();
    assert_eq!(color(&pnm("P6\n3 2\n255\n", &ramp)).unwrap()[1], [3, 4, 5]);
    assert_eq!(color(&pnm("P5\n3 2\n255\n", &ramp)).unwrap()[4], [4; 3]);
    assert_eq!(color(&pnm("P5\n3 2\n15\n", &[0, 15, 1, 0, 0, 0])).unwrap()[..3], [[0; 3], [255; 3], [17; 3]]);
    // The upper 8 of 16 bits.
    assert_eq!(color(&pnm("P5\n3 2\n65535\n", &big_endian())).unwrap()[2..5], [[1; 3], [19; 3], [255; 3]]);
}

#[test]
fn a_grey_png_of_16_bits_is_a_colour_image_by_its_upper_8() {
    let mut bytes = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut bytes, 3, 2);
    encoder.set_color(::png::ColorType::Grayscale);
    encoder.set_depth(::png::BitDepth::Sixteen);
    encoder.write_header().unwrap().write_image_data(&big_endian()).unwrap();
    assert_eq!(color(&bytes).unwrap()[2..5], [[1; 3], [19; 3], [255; 3]]);
}

#[test]
fn arrays_of_every_usual_type_are_depth() {
    let little: Vec<u8> = DEPTHS.iter().flat_map(|v| v.to_le_bytes()).collect();
    let expected = [0, 1, 256, 5000, 0, 7];
    assert_eq!(depth(&array("<u2", "(2, 3)", &little)).unwrap(), expected);
    assert_eq!(depth(&array(">u2", "(1, 2, 3, 1)", &big_endian())).unwrap(), expected);
    let wide: Vec<u8> = DEPTHS.iter().flat_map(|v| i64::from(*v).to_le_bytes()).collect();
    assert_eq!(depth(&array("<i8", "(2, 3, 1)", &wide)).unwrap(), expected);
    let header = "{'shape': (2, 3), 'fortran_order': False, 'descr': '<u2'}";
    assert_eq!(depth(&npy(2, header, &little)).unwrap(), expected);
    let floats: Vec<u8> = METRES.iter().flat_map(|v| v.to_le_bytes()).collect();
    let image = metres(&array("<f4", "(2, 3)", &floats), 1.0).unwrap();
    assert_eq!((image.raw.data(), image.metres_per_unit), (&HALF_MILLIMETRES[..], 0.0005));
    let doubles: Vec<u8> = METRES.iter().flat_map(|v| (f64::from(*v) * 1000.0).to_be_bytes()).collect();
    assert_eq!(metres(&array(">f8", "(2, 3)", &doubles), 1000.0).unwrap().raw.data(), HALF_MILLIMETRES);
    // 0, 0.5, NaN, 2, 8.25, 31.5 with 16 bits.
    let halves = [0u16, 0x3800, 0x7e00, 0x4000, 0x4820, 0x4fe0];
    let halves: Vec<u8> = halves.iter().flat_map(|v| v.to_le_bytes()).collect();
    assert_eq!(metres(&array("<f2", "(2, 3)", &halves), 1.0).unwrap().raw.data(), HALF_MILLIMETRES);
}

#[test]
fn arrays_that_are_no_depth_image_are_refused_by_name() {
    let refusal = |bytes: &[u8]| depth(bytes).unwrap_err().to_string();
    assert!(refusal(&array("|u1", "(2, 3)", &[0; 6])).contains("type '|u1'"));
    assert!(refusal(&array("<u2", "(2, 3, 3)", &[0; 36])).contains("no image"));
    assert!(refusal(&array("<u2", "(2, 3)", &[0; 11])).contains("11 of 12 bytes"));
    assert!(refusal(&array("<u2", "(20, 3)", &[0; 120])).contains("3×20"));
    assert!(refusal(&array("<i4", "(2, 3)", &[255; 24])).contains("exceed 16 bits"));
    assert!(refusal(&array("<f4", "(2, 3)", &[0; 24])).contains("floating-point"));
    assert!(refusal(&npy(1, "{'descr': '<u2', 'fortran_order': True, 'shape': (2, 3)}", &[0; 12])).contains("columns"));
    assert!(refusal(&array("<u2", "(99999999999, 99999999999)", &[])).contains("pixels"));
    assert!(color(&array("<u2", "(2, 3)", &[0; 12])).unwrap_err().to_string().contains("NumPy"));
}

#[cfg(feature = "tiff")]
#[test]
fn a_tiff_of_integers_or_metres_is_depth() {
    use ::tiff::encoder::{TiffEncoder, colortype};
    let mut file = std::io::Cursor::new(Vec::new());
    TiffEncoder::new(&mut file).unwrap().write_image::<colortype::Gray16>(3, 2, &DEPTHS).unwrap();
    assert_eq!(depth(file.get_ref()).unwrap(), [0, 1, 256, 5000, 0, 7]);
    for length in 0..file.get_ref().len() {
        assert!(depth(&file.get_ref()[..length]).is_err(), "cut to {length}");
    }
    let mut file = std::io::Cursor::new(Vec::new());
    TiffEncoder::new(&mut file).unwrap().write_image::<colortype::Gray32Float>(3, 2, &METRES).unwrap();
    assert_eq!(metres(file.get_ref(), 1.0).unwrap().raw.data(), HALF_MILLIMETRES);
    let mut file = std::io::Cursor::new(Vec::new());
    TiffEncoder::new(&mut file).unwrap().write_image::<colortype::Gray8>(3, 2, &[1; 6]).unwrap();
    assert!(depth(file.get_ref()).unwrap_err().to_string().contains("a TIFF of Gray(8)"));
    let mut other = std::io::Cursor::new(Vec::new());
    TiffEncoder::new(&mut other).unwrap().write_image::<colortype::Gray16>(2, 2, &[1; 4]).unwrap();
    assert!(depth(other.get_ref()).unwrap_err().to_string().contains("2×2"));
}

#[cfg(feature = "exr")]
fn exr_of_metres(name: &'static str) -> Vec<u8> {
    use ::exr::prelude::{
        AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, WritableImage,
    };
    let channel = AnyChannel::new(name, FlatSamples::F32(METRES.to_vec()));
    let channels = AnyChannels::sort([channel].into_iter().collect());
    let layer = Layer::new((3, 2), LayerAttributes::named("depth"), Encoding::SMALL_LOSSLESS, channels);
    let mut file = std::io::Cursor::new(Vec::new());
    Image::from_layer(layer).write().non_parallel().to_buffered(&mut file).unwrap();
    file.into_inner()
}

#[cfg(feature = "exr")]
#[test]
fn an_openexr_image_of_metres_is_depth() {
    for name in ["Z", "Y", "R", "depth.V"] {
        assert_eq!(metres(&exr_of_metres(name), 1.0).unwrap().raw.data(), HALF_MILLIMETRES, "{name}");
    }
    let mut image = DepthImage::default();
    let other = Some(ImageSize { width: 4, height: 2 });
    let error = decode_depth_image(&exr_of_metres("Z"), other, 1.0, &mut image).unwrap_err().to_string();
    assert!(error.contains("3×2") && error.contains("4×2"), "{error}");
}

#[cfg(feature = "tiff")]
fn tiff_of_integers() -> Vec<u8> {
    use ::tiff::encoder::{TiffEncoder, colortype};
    let mut file = std::io::Cursor::new(Vec::new());
    TiffEncoder::new(&mut file).unwrap().write_image::<colortype::Gray16>(3, 2, &DEPTHS).unwrap();
    file.into_inner()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn damaged_files_of_these_formats_never_panic(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..8),
        keep in any::<prop::sample::Index>(),
        format in any::<prop::sample::Index>(),
    ) {
        let files = [
            #[cfg(feature = "tiff")]
            tiff_of_integers(),
            #[cfg(feature = "exr")]
            exr_of_metres("Z"),
            array("<f4", "(2, 3)", &[7; 24]),
            pnm("P5\n3 2\n65535\n", &big_endian()),
        ];
        let mut bytes = files[format.index(files.len())].clone();
        for (at, value) in edits {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        bytes.truncate(1 + keep.index(2 * bytes.len()));
        let (mut image, mut rgb) = (DepthImage::default(), RgbImage::default());
        let _ = (decode_depth_image(&bytes, None, 1.0, &mut image), decode_color(&bytes, None, &mut rgb));
    }
}

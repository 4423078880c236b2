use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::types::{CameraInfo, Header, Transform};
use super::wire::Writer;
use super::*;

const FORMS: [(Wire, bool); 3] = [(Wire::Ros1, false), (Wire::Cdr, false), (Wire::Cdr, true)];

fn image<'a>(size: [u32; 2], encoding: &'a str, data: &'a [u8]) -> Image<'a> {
    let step = data.len() as u32 / size[1].max(1);
    Image { width: size[0], height: size[1], encoding, step, data, ..Default::default() }
}

fn bytes_of(write: impl FnOnce(&mut Writer), (wire, big): (Wire, bool)) -> Vec<u8> {
    let mut to = Writer::new(wire, big);
    write(&mut to);
    to.finish()
}

fn color(image: &Image<'_>) -> Result<RgbImage, DecodeError> {
    let bytes = bytes_of(|to| image.write(to), FORMS[1]);
    let mut into = RgbImage::default();
    decode_color_message(MessageType::Image, Wire::Cdr, &bytes, None, &mut into).map(|()| into)
}

fn depth(image: &Image<'_>, factor: f64) -> Result<DepthImage, DecodeError> {
    let bytes = bytes_of(|to| image.write(to), FORMS[0]);
    let mut into = DepthImage::default();
    decode_depth_message(MessageType::Image, Wire::Ros1, &bytes, factor, None, &mut into).map(|()| into)
}

fn compressed(format: &str, data: &[u8], factor: f64) -> Result<DepthImage, DecodeError> {
    let image = CompressedImage { format, data, ..Default::default() };
    let bytes = bytes_of(|to| image.write(to), FORMS[2]);
    let mut into = DepthImage::default();
    decode_depth_message(MessageType::CompressedImage, Wire::Cdr, &bytes, factor, None, &mut into).map(|()| into)
}

#[test]
fn cdr_is_padded_and_ros_1_is_not() {
    let header = Header { stamp_ns: 3_000_000_004, frame_id: "cam" };
    let write = |to: &mut Writer| {
        header.write(to);
        to.u8(7);
        to.f64(1.0);
    };
    let one = 1f64.to_le_bytes();
    assert_eq!(
        bytes_of(write, FORMS[0]),
        [&[0, 0, 0, 0, 3, 0, 0, 0, 4, 0, 0, 0, 3, 0, 0, 0][..], b"cam", &[7], &one].concat()
    );
    // 8 bytes of time, 4 of length, "cam" with its zero; then one byte, and padding up to a multiple of 8.
    let cdr =
        [&[0, 1, 0, 0, 3, 0, 0, 0, 4, 0, 0, 0, 4, 0, 0, 0][..], b"cam\0", &[7, 0, 0, 0, 0, 0, 0, 0], &one].concat();
    assert_eq!(bytes_of(write, FORMS[1]), cdr);
    let mut from = Reader::new(Wire::Cdr, &cdr).unwrap();
    assert_eq!(Header::read(&mut from).unwrap(), header);
    assert_eq!((from.u8("byte").unwrap(), from.f64("number").unwrap()), (7, 1.0));
    // XCDR2 aligns numbers of 8 bytes to 4.
    let xcdr2 = [&[0, 7, 0, 0, 7, 0, 0, 0][..], &one].concat();
    let mut from = Reader::new(Wire::Cdr, &xcdr2).unwrap();
    assert_eq!((from.u8("byte").unwrap(), from.f64("number").unwrap()), (7, 1.0));
    let error = Reader::new(Wire::Cdr, &[0, 3, 0, 0]).unwrap_err().to_string();
    assert!(error.contains("plain CDR"), "{error}");
}

#[test]
fn a_message_that_ends_early_names_the_field_and_takes_no_memory() {
    let bytes = bytes_of(|to| image([2, 1], "rgb8", &[1, 2, 3, 4, 5, 6]).write(to), FORMS[1]);
    let mut from = Reader::new(Wire::Cdr, &bytes[..bytes.len() - 1]).unwrap();
    let error = Image::read(&mut from).unwrap_err().to_string();
    assert!(error.contains("field 'data'") && error.contains("exceeds the message"), "{error}");
    let forged = bytes_of(|to| to.u32(u32::MAX), FORMS[0]);
    assert!(Transform::read_tf(&mut Reader::new(Wire::Ros1, &forged).unwrap()).is_err());
}

#[test]
fn colours_of_every_encoding_come_out_as_red_green_blue() {
    let pixels = |encoding, data: &[u8]| color(&image([2, 1], encoding, data)).unwrap().data().to_vec();
    assert_eq!(pixels("rgb8", &[1, 2, 3, 4, 5, 6]), [[1, 2, 3], [4, 5, 6]]);
    assert_eq!(pixels("bgra8", &[3, 2, 1, 9, 6, 5, 4, 9]), [[1, 2, 3], [4, 5, 6]]);
    assert_eq!(pixels("mono16", &[0, 7, 255, 8]), [[7; 3], [8; 3]]);
    let big = Image { is_bigendian: true, ..image([2, 1], "mono16", &[7, 0, 8, 255]) };
    assert_eq!(color(&big).unwrap().data(), [[7; 3], [8; 3]]);
    // Black, white and pure red of ITU-R BT.601 in limited range.
    assert_eq!(pixels("yuv422", &[128, 16, 128, 235]), [[0; 3], [255; 3]]);
    assert_eq!(pixels("yuv422_yuy2", &[16, 128, 235, 128]), [[0; 3], [255; 3]]);
    let [[r, g, b], _] = pixels("yuyv", &[81, 90, 81, 240])[..] else { panic!() };
    assert!(r >= 253 && g <= 2 && b <= 2, "{r} {g} {b}");
    let error = color(&image([2, 1], "nv21", &[0; 4])).unwrap_err().to_string();
    assert!(error.contains("'nv21'") && error.contains("bayer_rggb8"), "{error}");
}

#[test]
fn a_mosaic_of_one_colour_is_that_colour_up_to_the_border() {
    for (encoding, red_x, red_y) in
        [("bayer_rggb8", 0, 0), ("bayer_grbg8", 1, 0), ("bayer_gbrg8", 0, 1), ("bayer_bggr8", 1, 1)]
    {
        let value = |x: usize, y: usize| match (x % 2 == red_x, y % 2 == red_y) {
            (true, true) => 200,
            (false, false) => 50,
            _ => 120,
        };
        let data: Vec<u8> = (0..30).map(|k| value(k % 6, k / 6)).collect();
        let rgb = color(&image([6, 5], encoding, &data)).unwrap();
        assert!(rgb.data().iter().all(|pixel| *pixel == [200, 120, 50]), "{encoding}: {:?}", rgb.data());
    }
}

#[test]
fn depth_is_read_in_both_byte_orders_and_metres_become_units() {
    let values = [1u16, 256, 5000, 65535];
    let le: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let be: Vec<u8> = values.iter().flat_map(|v| v.to_be_bytes()).collect();
    let big = Image { is_bigendian: true, ..image([4, 1], "16UC1", &be) };
    for image in [image([4, 1], "16UC1", &le), big] {
        let depth = depth(&image, 5000.0).unwrap();
        assert_eq!((depth.raw.data(), depth.metres_per_unit), (&[1, 256, 5000, 0][..], 1.0 / 5000.0));
    }
    let metres: Vec<u8> = [0.0f32, 1.5, f32::NAN, 14.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    assert_eq!(depth(&image([4, 1], "32FC1", &metres), 5000.0).unwrap().raw.data(), [0, 7500, 0, 0]);
    // Units of a metre would be too coarse.
    let coarse = depth(&image([4, 1], "32FC1", &metres), 1.0).unwrap();
    assert_eq!((coarse.raw.data(), coarse.metres_per_unit), (&[0, 3000, 0, 28000][..], 0.0005));
    assert!(depth(&image([4, 1], "8UC1", &[0; 4]), 1.0).unwrap_err().to_string().contains("32FC1"));
}

#[test]
fn sizes_that_do_not_fit_the_data_are_refused_before_memory_is_taken() {
    for (width, height, step, length) in [
        (4, 2, 12, 23),
        (4, 2, 11, 100),
        (0, 2, 0, 0),
        (u32::MAX, u32::MAX, u32::MAX, 10),
        (1 << 20, 1 << 20, 3 << 20, 9),
    ] {
        let data = vec![0; length];
        let image = Image { width, height, step, encoding: "rgb8", data: &data, ..Default::default() };
        assert!(color(&image).is_err(), "{width}×{height} in steps of {step}");
    }
}

/// Writes RVL as its paper describes it.
fn rvl(values: &[u16], width: u32) -> Vec<u8> {
    let mut nibbles = Vec::new();
    let mut number = |mut value: u32| loop {
        let (low, rest) = (value as u8 & 7, value >> 3);
        nibbles.push(if rest > 0 { low | 8 } else { low });
        value = rest;
        if rest == 0 {
            break;
        }
    };
    let (mut rest, mut last) = (values, 0i32);
    while !rest.is_empty() {
        let zeros = rest.iter().take_while(|value| **value == 0).count();
        let run = rest[zeros..].iter().take_while(|value| **value != 0).count();
        number(zeros as u32);
        number(run as u32);
        for &value in &rest[zeros..zeros + run] {
            let difference = i32::from(value) - last;
            number(((difference << 1) ^ (difference >> 31)) as u32);
            last = i32::from(value);
        }
        rest = &rest[zeros + run..];
    }
    nibbles.resize(nibbles.len().next_multiple_of(8), 0);
    let words = nibbles.chunks(8).map(|word| word.iter().fold(0u32, |sum, nibble| sum << 4 | u32::from(*nibble)));
    let height = values.len() as u32 / width;
    [width.to_le_bytes().to_vec(), height.to_le_bytes().to_vec(), words.flat_map(u32::to_le_bytes).collect()].concat()
}

fn png(values: &[u16], width: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut bytes, width, values.len() as u32 / width);
    encoder.set_color(::png::ColorType::Grayscale);
    encoder.set_depth(::png::BitDepth::Sixteen);
    let data: Vec<u8> = values.iter().flat_map(|value| value.to_be_bytes()).collect();
    encoder.write_header().unwrap().write_image_data(&data).unwrap();
    bytes
}

#[test]
fn compressed_depth_is_read_as_png_and_rvl_and_as_inverse_depth() {
    let values = [0, 0, 700, 701, 650, 0, 3, 40000, 0, 0, 0, 12];
    for (format, data) in [
        ("16UC1; compressedDepth png", [vec![0; 12], png(&values, 4)].concat()),
        ("16UC1; compressedDepth", [vec![0; 12], png(&values, 4)].concat()),
        ("16UC1; png compressed ", png(&values, 4)),
        ("16UC1; compressedDepth rvl", [vec![0; 12], rvl(&values, 4)].concat()),
    ] {
        let depth = compressed(format, &data, 1000.0).unwrap();
        assert_eq!((depth.raw.data(), depth.raw.width()), (&values[..], 4), "{format}");
    }
    // depth = a / (value - b)
    let head = [&[0; 4][..], &2000f32.to_le_bytes(), &(-100f32).to_le_bytes()].concat();
    for data in [png(&[900, 0, 1900, 0], 2), rvl(&[900, 0, 1900, 0], 2)] {
        let format =
            if data.starts_with(b"\x89PNG") { "32FC1; compressedDepth png" } else { "32FC1; compressedDepth rvl" };
        let depth = compressed(format, &[head.clone(), data].concat(), 1000.0).unwrap();
        assert_eq!((depth.raw.data(), depth.metres_per_unit), (&[2000, 0, 1000, 0][..], 0.001));
    }
    for (format, data, words) in [
        ("16UC1; compressedDepth rvl", vec![0; 14], "RVL"),
        ("16UC1; compressedDepth rvl", [vec![0; 12], rvl(&values, 4)[..12].to_vec()].concat(), "RVL"),
        ("16UC1; compressedDepth png", vec![0; 5], "too few"),
        ("jpeg", vec![0xff, 0xd8, 0xff], "'jpeg'"),
    ] {
        let error = compressed(format, &data, 1000.0).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]
    #[test]
    fn what_is_written_is_read_again(
        form in 0..3usize,
        stamp_ns in 0..2_000_000_000_000_000_000i64,
        frame_id in "[a-z_/é]{0,12}",
        data in prop::collection::vec(any::<u8>(), 0..50),
        numbers in prop::collection::vec(-1e3..1e3f64, 12),
    ) {
        let form = FORMS[form];
        let header = Header { stamp_ns, frame_id: &frame_id };
        let sent = Image { header, height: 3, width: 4, encoding: "rgb8", is_bigendian: true, step: 9, data: &data };
        let bytes = bytes_of(|to| sent.write(to), form);
        prop_assert_eq!(Image::read(&mut Reader::new(form.0, &bytes).unwrap()).unwrap(), sent);
        let head = ImageHead::read(MessageType::Image, form.0, &bytes).unwrap();
        prop_assert_eq!((head.stamp_ns, head.encoding.as_str()), (stamp_ns, "rgb8"));
        let sent = CompressedImage { header, format: "jpeg", data: &data };
        let bytes = bytes_of(|to| sent.write(to), form);
        prop_assert_eq!(CompressedImage::read(&mut Reader::new(form.0, &bytes).unwrap()).unwrap(), sent);

        let sent = CameraInfo {
            frame_id: frame_id.clone(),
            d: numbers[..data.len() % 9].to_vec(),
            k: std::array::from_fn(|i| numbers[i]),
            p: std::array::from_fn(|i| numbers[11 - i]),
            roi: [1, 2, 3, 4],
            distortion_model: "plumb_bob".into(),
            ..CameraInfo::default()
        };
        let bytes = bytes_of(|to| sent.write(stamp_ns, to), form);
        prop_assert_eq!(CameraInfo::read(&mut Reader::new(form.0, &bytes).unwrap()).unwrap(), sent);

        let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(numbers[0], numbers[1], numbers[2]));
        let t_parent_child = Isometry3::from_parts(Translation3::new(numbers[3], numbers[4], numbers[5]), rotation);
        let sent = Transform { stamp_ns, parent: frame_id, child: "b".into(), t_parent_child };
        let bytes = bytes_of(|to| Transform::write_tf(&[sent.clone(), sent.clone()], to), form);
        let read = Transform::read_tf(&mut Reader::new(form.0, &bytes).unwrap()).unwrap();
        prop_assert_eq!(read.len(), 2);
        prop_assert_eq!((&read[1].parent, &read[1].child, read[1].stamp_ns), (&sent.parent, &sent.child, stamp_ns));
        prop_assert!((read[1].t_parent_child.inverse() * t_parent_child).to_homogeneous().relative_eq(&nalgebra::Matrix4::identity(), 1e-9, 1e-9));
        let bytes = bytes_of(|to| sent.write_odometry(to), form);
        prop_assert_eq!(Transform::read_with_child(&mut Reader::new(form.0, &bytes).unwrap()).unwrap().child, "b");
        let bytes = bytes_of(|to| sent.write_pose_stamped(to), form);
        prop_assert_eq!(Transform::read_pose_stamped(&mut Reader::new(form.0, &bytes).unwrap()).unwrap().child, "");
    }

    #[test]
    fn rvl_of_any_depth_is_read_again(values in prop::collection::vec(prop_oneof![Just(0u16), any::<u16>()], 1..40)) {
        let values: Vec<u16> = values.into_iter().map(|value| value.min(65534)).collect();
        let data = [vec![0; 12], rvl(&values, values.len() as u32)].concat();
        let depth = compressed("16UC1; compressedDepth rvl", &data, 1000.0).unwrap();
        prop_assert_eq!(depth.raw.data(), values);
    }

    #[test]
    fn messages_of_arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..200), kind in 0..6usize, format in 0..4usize) {
        let kind = [MessageType::Image, MessageType::CompressedImage, MessageType::CameraInfo, MessageType::Tf, MessageType::Pose, MessageType::PoseOfChild][kind];
        for wire in [Wire::Ros1, Wire::Cdr] {
            let (mut color, mut depth) = (RgbImage::default(), DepthImage::default());
            let _ = decode_color_message(kind, wire, &bytes, None, &mut color);
            let _ = decode_depth_message(kind, wire, &bytes, 1000.0, None, &mut depth);
            let _ = ImageHead::read(kind, wire, &bytes);
            if let Ok(from) = Reader::new(wire, &bytes) {
                let _ = (CameraInfo::read(&mut from.clone()), Transform::read_tf(&mut from.clone()));
            }
        }
        let format = ["16UC1; compressedDepth rvl", "32FC1; compressedDepth rvl", "32FC1; compressedDepth png", "bayer_rggb8; png"][format];
        let _ = compressed(format, &bytes, 1000.0);
    }
}

//! Bags, messages, images, maps, networks and streams.

use nalgebra::Isometry3;
use yfslam::dense::{CellGrid, DenseConfig, DenseMap, KeyframePatch, PlacedPatch};
use yfslam::{Camera, Config, DepthImage, Image, RgbImage, Slam};
use yfslam_io::message::types::Transform;
use yfslam_io::message::wire::{Wire, Writer};
use yfslam_io::write::encode_jpeg;
use yfslam_synth::{World, WorldConfig};

use crate::File;
use crate::bags::{
    CDR, CDR_BIG, COLOR, DEPTH, Form, INFO, Message, NONE, Packing, ROS1, camera_info, mcap_bag, ros1_bag,
};
use crate::nets::{Net, Size, Style};
use crate::sqlite::db3_bag;

const SIZE: [u32; 2] = [16, 12];
const PIXELS: usize = 16 * 12;

pub fn all() -> Vec<File> {
    [bags(), messages(), images(), maps(), networks(), streams(), runs()].concat()
}

fn packing(name: &'static str, pack: fn(&[u8]) -> Vec<u8>) -> Packing {
    Packing { name, pack }
}

fn packings() -> [Packing; 4] {
    [
        NONE,
        packing("bz2", |bytes| {
            let mut encoder = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
            std::io::Write::write_all(&mut encoder, bytes).unwrap();
            encoder.finish().unwrap()
        }),
        packing("lz4", |bytes| {
            let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
            std::io::Write::write_all(&mut encoder, bytes).unwrap();
            encoder.finish().unwrap()
        }),
        packing("zstd", zstd),
    ]
}

fn zstd(bytes: &[u8]) -> Vec<u8> {
    ruzstd::encoding::compress_to_vec(bytes, ruzstd::encoding::CompressionLevel::Fastest)
}

fn transforms() -> [Transform; 1] {
    let t_parent_child = Isometry3::translation(0.1, 0.2, 0.3);
    [Transform { stamp_ns: 5_000_000_000, parent: "base".into(), child: "camera".into(), t_parent_child }]
}

/// Messages of two frames.
fn recording(form: Form) -> Vec<Message> {
    let info = camera_info(SIZE, [16.0, 16.0, 8.0, 6.0]);
    let mut messages = vec![form.info(INFO, 1_000_000_000, &info), form.tf("/tf_static", &transforms())];
    for number in 0..2u8 {
        let stamp_ns = 1_000_000_000 + 33_000_000 * i64::from(number);
        messages.push(form.image(COLOR, stamp_ns, SIZE, "rgb8", &vec![number; 3 * PIXELS]));
        messages.push(form.image(DEPTH, stamp_ns, SIZE, "16UC1", &[number, 4].repeat(PIXELS)));
    }
    messages
}

fn bags() -> Vec<File> {
    let [none, bz2, lz4, zstd] = packings();
    let cdr = recording(CDR);
    let small: Vec<Message> = recording(CDR).into_iter().filter(|message| message.bytes.len() < 400).collect();
    vec![
        ("bag_ros1", "plain.bag", ros1_bag(&recording(ROS1), none, 3, true)),
        ("bag_ros1", "no-index.bag", ros1_bag(&recording(ROS1), none, 2, false)),
        ("bag_ros1", "bz2.bag", ros1_bag(&recording(ROS1), bz2, 3, true)),
        ("bag_ros1", "lz4.bag", ros1_bag(&recording(ROS1), lz4, 3, true)),
        ("bag_mcap", "plain.mcap", mcap_bag(&cdr, CDR, none, 3, true)),
        ("bag_mcap", "no-chunks.mcap", mcap_bag(&small, CDR, none, 0, false)),
        ("bag_mcap", "lz4.mcap", mcap_bag(&cdr, CDR, lz4, 3, true)),
        ("bag_mcap", "zstd.mcap", mcap_bag(&recording(CDR_BIG), CDR_BIG, zstd, 6, true)),
        ("bag_mcap", "ros1.mcap", mcap_bag(&recording(ROS1), ROS1, lz4, 3, false)),
        ("bag_db3", "plain.db3", db3_bag(&cdr)),
        ("bag_db3", "small.db3", db3_bag(&small)),
    ]
}

/// Writes RVL as its paper describes it (Wilson, "Fast lossless depth image compression", ISS 2017).
fn rvl(values: &[u16]) -> Vec<u8> {
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
    [SIZE[0].to_le_bytes().to_vec(), SIZE[1].to_le_bytes().to_vec(), words.flat_map(u32::to_le_bytes).collect()]
        .concat()
}

fn values() -> Vec<u16> {
    (0..PIXELS as u16).map(|i| if i % 7 == 0 { 0 } else { 700 + i * 3 }).collect()
}

fn messages() -> Vec<File> {
    let depth: Vec<u8> = values().iter().flat_map(|value| value.to_le_bytes()).collect();
    let metres: Vec<u8> = values().iter().flat_map(|value| (f32::from(*value) / 1000.0).to_le_bytes()).collect();
    let color: Vec<u8> = (0..3 * PIXELS).map(|i| i as u8).collect();
    let packed = |format: &str, data: Vec<u8>| CDR.compressed("", 5, format, &data).bytes;
    let image = |form: Form, encoding: &str, data: &[u8]| form.image("", 5, SIZE, encoding, data).bytes;
    let head = vec![0; 12];
    let pose = |write: fn(&Transform, &mut Writer)| {
        let mut to = Writer::new(Wire::Cdr, false);
        write(&transforms()[0], &mut to);
        to.finish()
    };
    let info = camera_info(SIZE, [16.0, 16.0, 8.0, 6.0]);
    // The first byte: bits 0 to 2 are the type, bit 3 is the form of ROS 1.
    let message = |kind: u8, name: &'static str, bytes: Vec<u8>| ("message", name, [vec![kind], bytes].concat());
    vec![
        message(0, "rgb8", image(CDR, "rgb8", &color)),
        message(8, "rgb8-ros1", image(ROS1, "bgr8", &color)),
        message(0, "bayer", image(CDR_BIG, "bayer_rggb8", &color[..PIXELS])),
        message(0, "yuv", image(CDR, "yuv422_yuy2", &color[..2 * PIXELS])),
        message(1, "depth", image(CDR, "16UC1", &depth)),
        message(9, "metres-ros1", image(ROS1, "32FC1", &metres)),
        message(2, "jpeg", packed("rgb8; jpeg compressed bgr8", jpeg())),
        message(3, "depth-png", packed("16UC1; compressedDepth png", [head.clone(), depth_png()].concat())),
        message(3, "depth-rvl", packed("16UC1; compressedDepth rvl", [head, rvl(&values())].concat())),
        message(3, "inverse-rvl", {
            let head = [&[0; 4][..], &2000f32.to_le_bytes(), &(-100f32).to_le_bytes()].concat();
            packed("32FC1; compressedDepth rvl", [head, rvl(&values())].concat())
        }),
        message(4, "camera-info", CDR.info("", 5, &info).bytes),
        message(12, "camera-info-ros1", ROS1.info("", 5, &info).bytes),
        message(5, "tf", CDR.tf("", &transforms()).bytes),
        message(6, "pose", pose(Transform::write_pose_stamped)),
        message(7, "odometry", pose(Transform::write_odometry)),
    ]
}

fn png(color: png::ColorType, depth: png::BitDepth, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, SIZE[0], SIZE[1]);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if color == png::ColorType::Indexed {
        encoder.set_palette((0..48).collect::<Vec<u8>>());
    }
    encoder.write_header().unwrap().write_image_data(data).unwrap();
    bytes
}

fn depth_png() -> Vec<u8> {
    let data: Vec<u8> = values().iter().flat_map(|value| value.to_be_bytes()).collect();
    png(png::ColorType::Grayscale, png::BitDepth::Sixteen, &data)
}

fn jpeg() -> Vec<u8> {
    let pixels = (0..PIXELS).map(|i| [i as u8, 2 * (i % 100) as u8, 90]).collect();
    encode_jpeg(&RgbImage::from_vec(16, 12, pixels).unwrap(), 80).unwrap()
}

fn npy(kind: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': (12, 16), }}\n");
    [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..], header.as_bytes(), data].concat()
}

fn images() -> Vec<File> {
    let color: Vec<u8> = (0..3 * PIXELS).map(|i| i as u8).collect();
    let gray = &color[..PIXELS];
    let little: Vec<u8> = values().iter().flat_map(|value| value.to_le_bytes()).collect();
    let metres: Vec<u8> = values().iter().flat_map(|value| (f32::from(*value) / 1000.0).to_le_bytes()).collect();
    let pnm = |head: &str, data: &[u8]| [head.as_bytes(), data].concat();
    let (rgb, one) = (png::ColorType::Rgb, png::ColorType::Grayscale);
    // The orientation of a photo is in the segment APP1, directly after the first marker.
    let exif = [
        &[0xff, 0xd8, 0xff, 0xe1, 0, 34][..],
        b"Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0",
        &jpeg()[2..],
    ]
    .concat();
    vec![
        ("image_color", "rgb.png", png(rgb, png::BitDepth::Eight, &color)),
        ("image_color", "palette.png", png(png::ColorType::Indexed, png::BitDepth::Four, &[0x17; PIXELS / 2])),
        ("image_color", "gray16.png", depth_png()),
        ("image_color", "photo.jpg", jpeg()),
        ("image_color", "turned.jpg", exif),
        ("image_color", "rgb.ppm", pnm("P6\n# a comment\n16 12\n255\n", &color)),
        ("image_color", "gray.pgm", pnm("P5 16 12 255\n", gray)),
        ("image_depth", "depth.png", depth_png()),
        ("image_depth", "depth.pgm", pnm("P5\n16 12\n65535\n", &little)),
        ("image_depth", "u2.npy", npy("<u2", &little)),
        ("image_depth", "f4.npy", npy("<f4", &metres)),
        ("image_depth", "bad-f2.npy", npy("<f2", &little[..300])),
        ("image_mask", "gray.png", png(one, png::BitDepth::Eight, gray)),
        ("image_mask", "one-bit.png", png(one, png::BitDepth::One, &[0x5a; PIXELS / 8])),
        ("image_mask", "rgb.png", png(rgb, png::BitDepth::Eight, &color)),
    ]
}

/// Returns the records of a section of a saved map, as they were before they were compressed.
fn records(bytes: &[u8], magic: &str) -> Vec<u8> {
    let at = bytes.windows(magic.len()).position(|window| window == magic.as_bytes()).unwrap();
    let mut plain = Vec::new();
    // Version, length and checksum follow the magic words.
    let mut decoder = ruzstd::decoding::StreamingDecoder::new(&bytes[at + magic.len() + 14..]).unwrap();
    std::io::Read::read_to_end(&mut decoder, &mut plain).unwrap();
    plain
}

fn maps() -> Vec<File> {
    let camera = Camera::pinhole(160, 120, 133.0, 133.0, 80.0, 60.0);
    let world =
        World::new(&WorldConfig { frames: 40, people: 0, camera: camera.clone(), ..WorldConfig::default() }).unwrap();
    let mut config = Config::default();
    config.features.count = 150;
    (config.tracking.init_min_features, config.tracking.init_min_landmarks) = (0, 20);
    (config.keyframes.close_tracked, config.keyframes.close_untracked) = (100_000, 0);
    config.keyframes.min_frames = 0;
    let mut slam = Slam::builder(camera).config(config).build().unwrap();
    for number in [0, 6] {
        slam.track(&world.frame(number).frame).unwrap();
    }
    slam.finish_mapping();
    let keyframes = slam.map().keyframe_count();
    assert!(keyframes > 1, "the map of the corpus has only {keyframes} keyframes");
    let map = slam.save_map().unwrap();

    let camera = Camera::pinhole(64, 48, 53.0, 53.0, 32.0, 24.0);
    let grid = CellGrid::new(&camera, 4);
    let patch = |number: u16| {
        let raw = Image::from_vec(64, 48, (0..64 * 48).map(|i| 900 + number * 100 + i % 64).collect()).unwrap();
        let depth = DepthImage { raw, metres_per_unit: 0.001 };
        let color = RgbImage::from_vec(64, 48, (0..64 * 48).map(|i| [i as u8, 7, 9]).collect()).unwrap();
        let patch = KeyframePatch::extract(&DenseConfig::default(), &grid, &color, &depth, |_, _| false);
        let t_world_cam = Isometry3::translation(0.1 * f64::from(number), 0.0, 0.0);
        PlacedPatch { timestamp_ns: i64::from(number), keyframe: number.into(), t_world_cam, patch }
    };
    let (patches, unmerged) = (vec![patch(0), patch(1)], vec![(1, patch(2))]);
    let dense = DenseMap { patches, unmerged, class_names: vec!["chair".into()], frame: None, grid: grid.clone() };
    let dense = dense.to_bytes().unwrap();
    vec![
        ("map_records", "map", records(&map, "yfslam map")),
        ("map", "map", map.clone()),
        ("map", "dense-and-map", [dense.clone(), map].concat()),
        ("dense_map_records", "dense", records(&dense, "yfslam dense map")),
        ("dense_map", "dense", dense),
    ]
}

fn networks() -> Vec<File> {
    let size = Size { height: 32, width: 32, channels: 2, classes: 2 };
    let net = |style: Style| {
        let mut net = Net::yolo(&size, style, 7);
        let anchors = "1,2,3,4,5,6,7,8,9,10,11,12".to_owned();
        net.metadata = vec![("names", "person, chair".into()), ("anchors", anchors)];
        net.to_onnx()
    };
    vec![("network", "folded.onnx", net(Style::Folded))]
}

fn streams() -> Vec<File> {
    let image = |role: u8, encoding: u8, data: &[u8]| {
        [&[role, encoding, 0, 0][..], &(data.len() as u32).to_le_bytes(), data].concat()
    };
    let frame = |stamp_ns: i64, images: &[Vec<u8>]| {
        let body = [stamp_ns.to_le_bytes().to_vec(), images.concat()].concat();
        [&(body.len() as u32).to_le_bytes()[..], &body].concat()
    };
    let header = |camera: &str| {
        [b"YFSFRAME", &1u32.to_le_bytes()[..], &(camera.len() as u32).to_le_bytes(), camera.as_bytes()].concat()
    };
    let color: Vec<u8> = (0..3 * PIXELS).map(|i| i as u8).collect();
    let depth: Vec<u8> = values().iter().flat_map(|value| value.to_le_bytes()).collect();
    let plain = frame(1, &[image(1, 1, &color), image(2, 4, &depth)]);
    let files = frame(2, &[image(1, 5, &jpeg()), image(2, 5, &depth_png())]);
    let stereo = frame(3, &[image(1, 3, &color[..PIXELS]), image(3, 2, &color)]);
    let end = vec![0; 4];
    let camera = "fx = 16\nfy = 16\ncx = 8\ncy = 6\nwidth = 16\nheight = 12\ndepth_factor = 1000.0\n";
    vec![
        ("pipe", "camera", [header(camera), plain.clone(), end.clone()].concat()),
        ("pipe", "files", [header(""), plain.clone(), files, end].concat()),
        ("pipe", "stereo", [header(""), stereo, plain].concat()),
        ("pipe", "bad-version", [b"YFSFRAME", &2u32.to_le_bytes()[..], &[0; 4]].concat()),
    ]
}

/// Runs of good and damaged frames.
fn runs() -> Vec<File> {
    let all_damages: Vec<u8> = (0..16).collect();
    let more_damages: Vec<u8> = (0..16).map(|i| 128 + 16 + i).collect();
    vec![
        ("frames", "good", vec![0; 8]),
        ("frames", "damaged", all_damages),
        ("frames", "damaged-full", more_damages),
        // Times that are further apart than the numbers of nanoseconds reach.
        ("frames", "longest-gap", vec![3, 0, 0, 0, 4]),
        ("frames", "bad-all-refused", vec![6, 9, 10, 6]),
    ]
}

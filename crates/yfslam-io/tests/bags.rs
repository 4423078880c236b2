//! Bags give the same frames as a folder, from every container, compression and lossless encoding; damaged ones are read as far as they go.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may")]

mod common;

use std::fs;
use std::path::Path;

use common::bags::{
    CDR, CDR_BIG, COLOR, DEPTH, Form, INFO, Message, NONE, Packing, ROS1, camera_info, mcap_bag, ros1_bag,
};
use common::png;
use common::sqlite::db3_bag;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use yfslam::Frame;
use yfslam::config::DepthSource;
use yfslam_io::message::types::{CameraInfo, Transform};
use yfslam_io::sequence::TopicChoice;
use yfslam_io::stream::DEFAULT_LOOK_AHEAD;
use yfslam_io::{Bag, FrameStream, Sequence, SequenceOptions};

const SIZE: [u32; 2] = [8, 6];
const PIXELS: usize = 48;
const FRAMES: i64 = 7;

const BZ2: Packing = Packing {
    name: "bz2",
    pack: |bytes| {
        let mut packed = Vec::new();
        let mut encoder = bzip2::read::BzEncoder::new(bytes, bzip2::Compression::fast());
        std::io::Read::read_to_end(&mut encoder, &mut packed).unwrap();
        packed
    },
};
const LZ4: Packing = Packing {
    name: "lz4",
    pack: |bytes| {
        let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
        std::io::Write::write_all(&mut encoder, bytes).unwrap();
        encoder.finish().unwrap()
    },
};
const ZSTD: Packing = Packing { name: "zstd", pack: zstd };

fn zstd(bytes: &[u8]) -> Vec<u8> {
    ruzstd::encoding::compress_to_vec(bytes, ruzstd::encoding::CompressionLevel::Fastest)
}

/// Red, green and blue of frame `i`, in that order.
fn rgb(i: i64) -> Vec<u8> {
    (0..PIXELS as i64 * 3).map(|k| (k * 7 + i * 31 + k * k % 11) as u8).collect()
}

/// Depth of frame `i` in millimetres, with some pixels that were not measured.
fn depth(i: i64) -> Vec<u16> {
    (0..PIXELS as i64).map(|k| if k % 13 == 0 { 0 } else { (700 + k * 37 + i * 5) as u16 }).collect()
}

fn color_ns(i: i64) -> i64 {
    1_700_000_000_000_000_000 + i * 33_333_333
}

fn depth_ns(i: i64) -> i64 {
    color_ns(i) + 4_000_000
}

fn le(values: &[u16]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn info() -> CameraInfo {
    camera_info(SIZE, [8.0, 8.0, 4.0, 3.0])
}

/// Messages of all frames; `image` makes the two images of one.
fn messages(form: Form, images: impl Fn(i64) -> [Message; 2]) -> Vec<Message> {
    let mut all = vec![form.info(INFO, color_ns(0), &info())];
    (0..FRAMES).for_each(|i| all.extend(images(i)));
    all
}

fn plain(form: Form) -> Vec<Message> {
    messages(form, |i| {
        [
            form.image(COLOR, color_ns(i), SIZE, "rgb8", &rgb(i)),
            form.image(DEPTH, depth_ns(i), SIZE, "16UC1", &le(&depth(i))),
        ]
    })
}

fn options() -> SequenceOptions {
    SequenceOptions::default()
}

fn frames_with(path: &Path, options: &SequenceOptions) -> yfslam_io::Result<(Sequence, Vec<Frame>)> {
    let sequence = Sequence::open(path, options)?;
    let camera = sequence.calibration.as_ref().map(|calibration| calibration.camera.clone()).unwrap();
    let frames = FrameStream::open(&sequence, &camera, DEFAULT_LOOK_AHEAD)?.map(|frame| frame.unwrap()).collect();
    Ok((sequence, frames))
}

/// Writes a bag into a temporary folder and reads it.
fn read(name: &str, bytes: &[u8], options: &SequenceOptions) -> yfslam_io::Result<(Sequence, Vec<Frame>)> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    frames_with(&path, options)
}

fn refusal(bytes: &[u8], options: &SequenceOptions) -> String {
    read("test.mcap", bytes, options).unwrap_err().to_string()
}

fn in_mcap(messages: &[Message]) -> Vec<u8> {
    mcap_bag(messages, CDR, NONE, 4, true)
}

#[track_caller]
fn assert_frames(frames: &[Frame], first: i64) {
    for (frame, i) in frames.iter().zip(first..) {
        assert_eq!((frame.timestamp_ns, frame.depth_timestamp_ns), (color_ns(i), Some(depth_ns(i))));
        assert_eq!(frame.color.data().as_flattened(), rgb(i));
        let image = frame.depth.as_ref().unwrap();
        assert_eq!(image.raw.data(), depth(i));
        assert!((image.metres_per_unit - 0.001).abs() < 1e-9);
    }
}

#[test]
fn every_container_and_compression_gives_the_frames_that_a_folder_gives() {
    let folder = tempfile::tempdir().unwrap();
    let (mut color_list, mut depth_list) = (String::new(), String::new());
    for i in 0..FRAMES {
        let name = |stamp_ns: i64| format!("{}.{:09}", stamp_ns / 1_000_000_000, stamp_ns % 1_000_000_000);
        let size = SIZE.into();
        color_list += &format!("{} c{i}.png\n", name(color_ns(i)));
        depth_list += &format!("{} d{i}.png\n", name(depth_ns(i)));
        let big: Vec<u8> = depth(i).iter().flat_map(|value| value.to_be_bytes()).collect();
        fs::write(
            folder.path().join(format!("c{i}.png")),
            png(size, png::ColorType::Rgb, png::BitDepth::Eight, &rgb(i)),
        )
        .unwrap();
        fs::write(
            folder.path().join(format!("d{i}.png")),
            png(size, png::ColorType::Grayscale, png::BitDepth::Sixteen, &big),
        )
        .unwrap();
    }
    fs::write(folder.path().join("rgb.txt"), color_list).unwrap();
    fs::write(folder.path().join("depth.txt"), depth_list).unwrap();
    let sequence = Sequence::open(folder.path(), &options()).unwrap();
    let of_bag = read("a.mcap", &in_mcap(&plain(CDR)), &options()).unwrap().0;
    let camera = of_bag.calibration.unwrap().camera;
    let expected: Vec<Frame> = FrameStream::open(&sequence, &camera, 2).unwrap().map(|frame| frame.unwrap()).collect();
    assert_eq!(expected.len(), FRAMES as usize);
    assert_frames(&expected, 0);

    for per_chunk in [1, 3, 100] {
        for packing in [NONE, BZ2, LZ4] {
            let (sequence, frames) =
                read("a.bag", &ros1_bag(&plain(ROS1), packing, per_chunk, true), &options()).unwrap();
            assert_eq!(frames.len(), expected.len(), "{} {:?}", packing.name, sequence.notes);
            assert_frames(&frames, 0);
            assert_eq!((sequence.report.color_listed, sequence.report.paired), (7, 7));
        }
        for (form, packing) in [(CDR, NONE), (CDR, LZ4), (CDR, ZSTD), (CDR_BIG, NONE), (ROS1, ZSTD)] {
            let (sequence, frames) =
                read("a.mcap", &mcap_bag(&plain(form), form, packing, per_chunk, true), &options()).unwrap();
            assert_eq!(frames.len(), expected.len(), "{} {:?}", packing.name, sequence.notes);
            assert_frames(&frames, 0);
        }
    }
    assert_frames(&read("a.mcap", &mcap_bag(&plain(CDR), CDR, NONE, 0, true), &options()).unwrap().1, 0);
    let packed: Vec<Message> = plain(CDR).into_iter().map(|m| Message { bytes: zstd(&m.bytes), ..m }).collect();
    for messages in [plain(CDR), packed] {
        let (sequence, frames) = read("a.db3", &db3_bag(&messages), &options()).unwrap();
        assert_eq!(frames.len(), 7, "{:?}", sequence.notes);
        assert_frames(&frames, 0);
    }
}

#[test]
fn messages_that_are_packed_one_by_one_are_read_also_from_a_folder_of_several_files() {
    let packed: Vec<Message> = plain(CDR).into_iter().map(|m| Message { bytes: zstd(&m.bytes), ..m }).collect();
    let folder = tempfile::tempdir().unwrap();
    let (first, second) = packed.split_at(7);
    fs::write(folder.path().join("lab_0.mcap"), in_mcap(first)).unwrap();
    fs::write(folder.path().join("lab_1.mcap"), in_mcap(second)).unwrap();
    let yaml = "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n    - lab_0.mcap\n    - lab_1.mcap\n  duration:\n    nanoseconds: 1\n";
    fs::write(folder.path().join("metadata.yaml"), yaml).unwrap();
    let (sequence, frames) = frames_with(folder.path(), &options()).unwrap();
    assert_eq!(frames.len(), 7, "{:?}", sequence.notes);
    assert_frames(&frames, 0);

    fs::write(folder.path().join("metadata.yaml"), yaml.replace("lab_1.mcap", "lab_1.mcap.zstd")).unwrap();
    let error = frames_with(folder.path(), &options()).unwrap_err().to_string();
    assert!(error.contains("lab_1.mcap.zstd") && error.contains("zstd -d"), "{error}");
}

#[test]
fn a_part_is_played_backward_with_the_stamps_of_the_headers() {
    let options = SequenceOptions { start: 2, end: Some(5), reverse: true, ..options() };
    let (sequence, frames) = read("a.bag", &ros1_bag(&plain(ROS1), LZ4, 2, true), &options).unwrap();
    let images: Vec<_> = frames.iter().map(|frame| frame.color.data().as_flattened().to_vec()).collect();
    assert_eq!(images, [rgb(4), rgb(3), rgb(2)]);
    assert_eq!(sequence.mirror.unwrap().first_ns, color_ns(2));
}

#[test]
fn every_lossless_encoding_gives_the_same_pixels() {
    let swap = |bytes: &[u8]| bytes.chunks(3).flat_map(|p| [p[2], p[1], p[0]]).collect::<Vec<u8>>();
    let alpha = |bytes: &[u8]| bytes.chunks(3).flat_map(|p| [p[0], p[1], p[2], 9]).collect::<Vec<u8>>();
    let png_of = |i: i64| png(SIZE.into(), png::ColorType::Rgb, png::BitDepth::Eight, &rgb(i));
    type Color<'a> = &'a dyn Fn(i64) -> Message;
    let colors: [Color<'_>; 6] = [
        &|i| CDR.image(COLOR, color_ns(i), SIZE, "bgr8", &swap(&rgb(i))),
        &|i| CDR.image(COLOR, color_ns(i), SIZE, "8UC3", &swap(&rgb(i))),
        &|i| CDR.image(COLOR, color_ns(i), SIZE, "rgba8", &alpha(&rgb(i))),
        &|i| CDR.image(COLOR, color_ns(i), SIZE, "bgra8", &alpha(&swap(&rgb(i)))),
        &|i| CDR.compressed("/camera/color/image_raw/compressed", color_ns(i), "rgb8; png compressed bgr8", &png_of(i)),
        // Rows that are longer than their pixels.
        &|i| {
            CDR.image(
                COLOR,
                color_ns(i),
                SIZE,
                "rgb8",
                &rgb(i).chunks(24).flat_map(|row| [row, &[7; 5]].concat()).collect::<Vec<_>>(),
            )
        },
    ];
    let metres = |i: i64| depth(i).iter().flat_map(|&raw| (f32::from(raw) / 1000.0).to_le_bytes()).collect::<Vec<u8>>();
    for color in colors {
        let bag =
            in_mcap(&messages(CDR, |i| [color(i), CDR.image(DEPTH, depth_ns(i), SIZE, "mono16", &le(&depth(i)))]));
        let (_, frames) = read("a.mcap", &bag, &options()).unwrap();
        assert_eq!(frames.len(), 7);
        assert_frames(&frames, 0);
    }
    // Depth in metres is rounded to half millimetres.
    let bag = in_mcap(&messages(CDR, |i| {
        [CDR.image(COLOR, color_ns(i), SIZE, "rgb8", &rgb(i)), CDR.image(DEPTH, depth_ns(i), SIZE, "32FC1", &metres(i))]
    }));
    let (sequence, frames) = read("a.mcap", &bag, &options()).unwrap();
    assert_eq!(sequence.calibration.unwrap().camera.depth_factor, 2000.0);
    for (frame, i) in frames.iter().zip(0..) {
        let doubled: Vec<u16> = depth(i).iter().map(|raw| raw * 2).collect();
        assert_eq!(frame.depth.as_ref().unwrap().raw.data(), doubled);
    }
}

#[test]
fn a_truncated_or_unindexed_bag_is_read_as_far_as_it_goes_and_says_so() {
    for packing in [NONE, LZ4] {
        let whole = ros1_bag(&plain(ROS1), packing, 2, false);
        let (sequence, frames) = read("a.bag", &whole, &options()).unwrap();
        assert_eq!(frames.len(), 7);
        assert!(sequence.notes.iter().any(|note| note.contains("has no index")), "{:?}", sequence.notes);
        let (sequence, frames) = read("a.bag", &whole[..whole.len() - 30], &options()).unwrap();
        assert!((5..7).contains(&frames.len()), "{}", frames.len());
        assert_frames(&frames, 0);
        assert!(sequence.notes.iter().any(|note| note.contains("ends within a record")), "{:?}", sequence.notes);

        let whole = mcap_bag(&plain(CDR), CDR, packing, 2, true);
        let (sequence, frames) = read("a.mcap", &whole[..whole.len() / 2], &options()).unwrap();
        assert!((2..5).contains(&frames.len()), "{}", frames.len());
        assert_frames(&frames, 0);
        assert!(sequence.notes.iter().any(|note| note.contains("has no index")), "{:?}", sequence.notes);
    }
    // A damaged chunk in the middle costs its own messages only.
    let mut bag = ros1_bag(&plain(ROS1), LZ4, 3, true);
    let chunks: Vec<usize> =
        bag.windows(4).enumerate().filter(|(_, w)| *w == [4, 0x22, 0x4d, 0x18]).map(|(i, _)| i).collect();
    bag[chunks[2]] ^= 1;
    let (sequence, frames) = read("a.bag", &bag, &options()).unwrap();
    assert_eq!((frames.len(), sequence.report.paired), (5, 5));
    assert!(sequence.notes.iter().any(|note| note.contains("is damaged")), "{:?}", sequence.notes);
}

#[test]
fn what_is_not_a_bag_or_not_understood_is_refused_with_a_cure() {
    let names = |bytes: &[u8], words: &[&str]| {
        let error = refusal(bytes, &options());
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    };
    names(b"", &["test.mcap", "not a bag"]);
    names(b"#ROSBAG V1.2\n", &["early version", "rosbag fix"]);
    names(&zstd(&in_mcap(&plain(CDR))), &["zstd -d"]);
    let of = |images: &dyn Fn(i64) -> [Message; 2]| in_mcap(&messages(CDR, images));
    let gray = |topic: &str, i: i64| CDR.image(topic, color_ns(i), SIZE, "mono8", &[i as u8; PIXELS]);
    let deep = |topic: &str, i: i64| CDR.image(topic, depth_ns(i), SIZE, "16UC1", &le(&depth(i)));
    names(&of(&|i| [gray("/a", i), gray("/b", i)]), &["no topic of depth images", "--depth-topic", "/a (mono8)"]);
    names(&of(&|i| [deep("/d1", i), deep("/d2", i)]), &["/d1, /d2", "--depth-topic"]);
    names(
        &of(&|i| [gray("/a", i), CDR.image("/d", depth_ns(i), [4, 12], "16UC1", &le(&depth(i)))]),
        &["/a has 8×6", "/d has 4×12", "registered"],
    );
    let missing =
        SequenceOptions { topics: TopicChoice { color: Some("/x".into()), ..TopicChoice::default() }, ..options() };
    let error = refusal(&in_mcap(&plain(CDR)), &missing);
    assert!(error.contains("--color-topic /x") && error.contains(COLOR), "{error}");
    let truth =
        SequenceOptions { topics: TopicChoice { truth: Some("/odom".into()), ..TopicChoice::default() }, ..options() };
    assert!(refusal(&in_mcap(&plain(CDR)), &truth).contains("'/odom' of poses"));
}

#[test]
fn a_calibration_that_changes_the_image_is_refused_by_the_name_of_what_is_not_supported() {
    let with = |change: &dyn Fn(&mut CameraInfo)| {
        let mut info = info();
        change(&mut info);
        let mut all = plain(CDR);
        all[0] = CDR.info(INFO, color_ns(0), &info);
        in_mcap(&all)
    };
    let names = |bytes: Vec<u8>, words: &[&str]| {
        let error = refusal(&bytes, &options());
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    };
    let fisheye = with(&|info| (info.distortion_model, info.d) = ("equidistant".into(), vec![0.1, 0.0, 0.0, 0.0]));
    names(fisheye, &["equidistant", "image_rect", INFO]);
    names(with(&|info| info.binning = [2, 2]), &["binning is [2, 2]", "--camera"]);
    names(with(&|info| info.roi = [1, 0, 6, 7]), &["roi is 7×6 at 1, 0"]);
    names(with(&|info| info.width = 9), &["9×6 pixels", "8×6", "--camera-info-topic"]);
    names(with(&|info| info.k = [0.0; 9]), &["K is all zeros"]);
    let five = with(&|info| {
        (info.distortion_model, info.d) =
            ("rational_polynomial".into(), vec![0.01, 0.02, 0.0, 0.0, 0.03, 0.0, 0.0, 0.0])
    });
    let sequence = read("a.mcap", &five, &options()).unwrap().0;
    assert_eq!(sequence.calibration.unwrap().camera.camera.distortion[..5], [0.01, 0.02, 0.0, 0.0, 0.03]);
    let d = [0.5, -0.3, 0.001, 0.002, 0.02, 0.4, -0.2, 0.01];
    let eight = with(&|info| (info.distortion_model, info.d) = ("rational_polynomial".into(), d.to_vec()));
    let camera = read("a.mcap", &eight, &options()).unwrap().0.calibration.unwrap().camera.camera;
    assert_eq!((&camera.distortion[..], &camera.rational[..]), (&d[..5], &d[5..]));
    names(with(&|info| info.d = vec![0.01; 12]), &["12 parameters", "8 are supported"]);
}

#[test]
fn rectified_topics_use_the_projection_and_a_stereo_pair_its_baseline() {
    let mut left = info();
    left.d = vec![0.3, 0.0, 0.0, 0.0, 0.0];
    left.p[0] = 9.0;
    left.p[5] = 9.0;
    let mut right = left.clone();
    right.p[3] = -0.9;
    let mut all =
        vec![CDR.info("/stereo/left/camera_info", 0, &left), CDR.info("/stereo/right/camera_info", 0, &right)];
    for i in 0..FRAMES {
        for side in ["left", "right"] {
            all.push(CDR.image(
                &format!("/stereo/{side}/image_rect"),
                color_ns(i),
                SIZE,
                "mono8",
                &[i as u8 + 1; PIXELS],
            ));
        }
    }
    let (sequence, frames) = read("a.mcap", &in_mcap(&all), &options()).unwrap();
    let camera = sequence.calibration.unwrap().camera.camera;
    assert_eq!((sequence.depth_source, frames.len()), (DepthSource::Stereo, 7));
    assert_eq!((camera.fx, camera.fy, camera.bf), (9.0, 9.0, 0.9));
    assert!(frames.iter().all(|frame| frame.right.is_some()));
    let swapped = TopicChoice {
        left: Some("/stereo/right/image_rect".into()),
        right: Some("/stereo/left/image_rect".into()),
        ..TopicChoice::default()
    };
    let error = refusal(&in_mcap(&all), &SequenceOptions { topics: swapped, ..options() });
    assert!(error.contains("baseline") && error.contains("swapped"), "{error}");
}

#[test]
fn ground_truth_of_a_body_is_moved_to_the_camera_by_static_transforms() {
    let transform = |stamp_ns, parent: &str, child: &str, x: f64, turn: f64| Transform {
        stamp_ns,
        parent: parent.into(),
        child: child.into(),
        t_parent_child: Isometry3::from_parts(
            Translation3::new(x, 0.0, 0.0),
            UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, turn)),
        ),
    };
    let quarter = std::f64::consts::FRAC_PI_2;
    let mut all = plain(ROS1);
    let mount = [
        transform(0, "base_link", "camera_link", 0.5, 0.0),
        transform(0, "camera_link", common::bags::FRAME, 0.25, 0.0),
    ];
    all.push(ROS1.tf("/tf_static", &mount));
    for i in 0..FRAMES {
        let pose = transform(color_ns(i), "odom", "base_link", i as f64, quarter);
        all.push(ROS1.message("/odom", "nav_msgs/Odometry", color_ns(i), |to| pose.write_odometry(to)));
    }
    let topics = TopicChoice { truth: Some("/odom".into()), ..TopicChoice::default() };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.bag");
    fs::write(&path, ros1_bag(&all, NONE, 5, true)).unwrap();
    let sequence = Sequence::open(&path, &SequenceOptions { topics, ..options() }).unwrap();
    let truth = sequence.ground_truth.read(sequence.ground_truth.path().unwrap()).unwrap();
    assert_eq!(truth.poses.len(), 7);
    // The body is turned by 90°, so that the camera is 0.75 m beside it.
    let position = truth.poses[2].t_world_cam.translation.vector;
    assert!((position - Vector3::new(2.0, 0.75, 0.0)).norm() < 1e-12, "{position}");
    let notes = sequence.notes.join("\n");
    assert!(notes.contains("in base_link: x 0.7500") && notes.contains("those of 'base_link'"), "{notes}");
}

#[test]
fn images_without_a_pair_are_counted_and_images_without_stamps_use_the_time_of_reception() {
    let mut all = plain(CDR);
    all.remove(4);
    let (sequence, frames) = read("a.mcap", &in_mcap(&all), &options()).unwrap();
    let report = &sequence.report;
    assert_eq!((frames.len(), report.color_listed, report.color_unmatched), (6, 7, 1));
    let unstamped = messages(CDR, |i| {
        let mut both = [CDR.image(COLOR, 0, SIZE, "rgb8", &rgb(i)), CDR.image(DEPTH, 0, SIZE, "16UC1", &le(&depth(i)))];
        both.iter_mut().for_each(|message| message.received_ns = color_ns(i));
        both
    });
    let (sequence, frames) = read("a.mcap", &in_mcap(&unstamped), &options()).unwrap();
    assert_eq!((frames.len(), frames[3].timestamp_ns), (7, color_ns(3)));
    assert!(sequence.notes.iter().any(|note| note.contains("received")), "{:?}", sequence.notes);
}

/// Opens and plays whatever the bytes are; only panics, hangs and endless memory are wrong.
fn play(name: &str, bytes: &[u8]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    let topics = TopicChoice { truth: Some("/odom".into()), ..TopicChoice::default() };
    for options in [options(), SequenceOptions { topics, depth_source: Some(DepthSource::Motion), ..options() }] {
        let Ok(sequence) = Sequence::open(&path, &options) else { continue };
        let Some(calibration) = &sequence.calibration else { continue };
        if calibration.camera.camera.width * calibration.camera.camera.height > 1 << 20 {
            continue;
        }
        assert!(FrameStream::open(&sequence, &calibration.camera, 1).unwrap().count() < 1000);
    }
    if let Ok(bag) = Bag::open(&path) {
        let _ = bag.encodings();
    }
}

fn samples() -> Vec<(&'static str, Vec<u8>)> {
    let body = Transform {
        stamp_ns: color_ns(1),
        parent: "odom".into(),
        child: "base_link".into(),
        t_parent_child: Isometry3::identity(),
    };
    let with_truth = |form: Form| {
        let mut all = plain(form);
        all.push(form.message("/odom", "nav_msgs/Odometry", color_ns(1), |to| body.write_odometry(to)));
        all.push(form.tf("/tf_static", std::slice::from_ref(&body)));
        all
    };
    let (old, new) = (with_truth(ROS1), with_truth(CDR));
    vec![
        ("a.bag", ros1_bag(&old, NONE, 3, true)),
        ("a.bag", ros1_bag(&old, LZ4, 3, true)),
        ("a.bag", ros1_bag(&old, BZ2, 3, false)),
        ("a.mcap", mcap_bag(&new, CDR, NONE, 3, true)),
        ("a.mcap", mcap_bag(&new, CDR, ZSTD, 3, true)),
        ("a.mcap", mcap_bag(&new, CDR, NONE, 0, false)),
        ("a.db3", db3_bag(&new)),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn damaged_bags_never_panic_or_hang(
        which in 0..7usize,
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        small in any::<prop::sample::Index>(),
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let (name, mut bytes) = samples().swap_remove(which);
        for (at, value) in edits {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        // Lengths are what a forged bag lies about.
        let at = small.index(bytes.len() - 8);
        bytes[at] = 0xff;
        bytes.truncate(cut.map_or(bytes.len(), |cut| cut.index(bytes.len())));
        play(name, &bytes);
    }
}

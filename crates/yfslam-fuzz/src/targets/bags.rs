//! Bags of ROS 1 and ROS 2, and the messages in them.

use std::ops::ControlFlow;
use std::path::Path;

use yfslam::{DepthImage, RgbImage};
use yfslam_io::bag::Need;
use yfslam_io::message::types::{CameraInfo, Transform};
use yfslam_io::message::wire::{Reader, Wire};
use yfslam_io::message::{ImageHead, MessageType, decode_color_message, decode_depth_message};
use yfslam_io::{Bag, Sequence, SequenceOptions};

use super::images::SIZE;
use crate::scratch::{with_file, with_folder};

/// Most messages that a target reads again by their positions.
const MOST_POSITIONS: usize = 16;

/// A bag of ROS 1.
pub fn ros1(bytes: &[u8]) -> bool {
    with_file("fuzz.bag", bytes, open).unwrap_or(false)
}

/// A bag in MCAP.
pub fn mcap(bytes: &[u8]) -> bool {
    with_file("fuzz.mcap", bytes, open).unwrap_or(false)
}

/// A bag of rosbag2 in SQLite.
pub fn db3(bytes: &[u8]) -> bool {
    with_file("fuzz.db3", bytes, open).unwrap_or(false)
}

/// The `metadata.yaml` of a bag of rosbag2, beside a file that is no bag.
pub fn folder(bytes: &[u8]) -> bool {
    let opened = with_folder(|folder| {
        let folder = folder.join("bag");
        std::fs::create_dir_all(&folder).ok()?;
        std::fs::write(folder.join("metadata.yaml"), bytes).ok()?;
        std::fs::write(folder.join("a.mcap"), EMPTY_MCAP).ok()?;
        Some(yfslam_io::bag::is_bag(&folder) && Bag::open(&folder).is_ok())
    });
    opened.flatten().unwrap_or(false)
}

/// A file in MCAP without messages.
const EMPTY_MCAP: &[u8] =
    b"\x89MCAP0\r\n\x01\x08\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x0f\x04\0\0\0\0\0\0\0\0\0\0\0\x89MCAP0\r\n";

/// Reads a bag to its end, some messages again by their positions, and the frames in it.
fn open(path: &Path) -> bool {
    let Ok(bag) = Bag::open(path) else { return false };
    let needs = vec![Need::Whole; bag.topics().len()];
    let mut positions = Vec::new();
    let mut messages = 0;
    let visited = bag.visit(&needs, &mut |found| {
        messages += 1;
        if positions.len() < MOST_POSITIONS {
            positions.push((found.position, found.bytes.to_vec()));
        }
        if let Some((kind, wire)) = bag.topics().get(found.topic).and_then(|topic| topic.kind.zip(topic.wire)) {
            let _ = ImageHead::read(kind, wire, found.bytes);
        }
        ControlFlow::Continue(())
    });
    let mut bytes = Vec::new();
    for (position, visited) in &positions {
        if bag.read(*position, &mut bytes).is_ok() {
            assert_eq!(&bytes, visited, "a message differs when it is read by its position");
        }
    }
    let _ = bag.encodings();
    let _ = Sequence::open(path, &SequenceOptions::default());
    visited.is_ok() && messages > 0
}

/// A message. The first byte says which type and which form the bytes after it have.
pub fn message(bytes: &[u8]) -> bool {
    let Some((&head, bytes)) = bytes.split_first() else { return false };
    let wire = if head & 8 == 0 { Wire::Cdr } else { Wire::Ros1 };
    let expected = (head & 16 == 0).then_some(SIZE);
    let (mut color, mut depth) = (RgbImage::default(), DepthImage::default());
    let kind = match head & 7 {
        0 | 1 => MessageType::Image,
        2 | 3 => MessageType::CompressedImage,
        other => return pose_message(other, wire, bytes),
    };
    let size = ImageHead::read(kind, wire, bytes).ok().and_then(|head| head.size);
    // Without an expected size, a forged one may be as large as the bytes of the message allow, which is slow but no fault.
    if expected.is_none() && size.is_some_and(|size| size.width.saturating_mul(size.height) > super::MOST_PIXELS) {
        return false;
    }
    if head & 1 == 0 {
        decode_color_message(kind, wire, bytes, expected, &mut color).is_ok()
    } else {
        decode_depth_message(kind, wire, bytes, 1000.0, expected, &mut depth).is_ok()
    }
}

/// A calibration or poses.
fn pose_message(kind: u8, wire: Wire, bytes: &[u8]) -> bool {
    let Ok(mut from) = Reader::new(wire, bytes) else { return false };
    match kind {
        4 => CameraInfo::read(&mut from).is_ok(),
        5 => Transform::read_tf(&mut from).is_ok(),
        6 => Transform::read_pose_stamped(&mut from).is_ok(),
        _ => Transform::read_with_child(&mut from).is_ok(),
    }
}

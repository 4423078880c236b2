//! Writes small bags of ROS 1 and MCAP, for tests. What is written follows the published specifications of both.
#![allow(dead_code, reason = "each test file uses a part")]
#![allow(clippy::unwrap_used, reason = "a test may")]

use yfslam_io::message::types::{CameraInfo, CompressedImage, Header, Image, Transform};
use yfslam_io::message::wire::{Wire, Writer};

/// A message of a bag.
#[derive(Clone)]
pub struct Message {
    pub topic: String,
    /// As ROS 1 writes it.
    pub type_name: &'static str,
    pub received_ns: i64,
    pub bytes: Vec<u8>,
}

/// How chunks are packed: the name, and the function.
#[derive(Clone, Copy)]
pub struct Packing {
    pub name: &'static str,
    pub pack: fn(&[u8]) -> Vec<u8>,
}

pub const NONE: Packing = Packing { name: "none", pack: <[u8]>::to_vec };

/// How messages are serialised.
#[derive(Clone, Copy)]
pub struct Form {
    pub wire: Wire,
    pub big_endian: bool,
}

pub const ROS1: Form = Form { wire: Wire::Ros1, big_endian: false };
pub const CDR: Form = Form { wire: Wire::Cdr, big_endian: false };
pub const CDR_BIG: Form = Form { wire: Wire::Cdr, big_endian: true };

pub const COLOR: &str = "/camera/color/image_raw";
pub const DEPTH: &str = "/camera/aligned_depth_to_color/image_raw";
pub const INFO: &str = "/camera/color/camera_info";
pub const FRAME: &str = "camera_color_optical_frame";

impl Form {
    pub fn message(
        self,
        topic: &str,
        type_name: &'static str,
        received_ns: i64,
        write: impl FnOnce(&mut Writer),
    ) -> Message {
        let mut to = Writer::new(self.wire, self.big_endian);
        write(&mut to);
        Message { topic: topic.into(), type_name, received_ns, bytes: to.finish() }
    }

    /// Makes an image message that is received 45 ms late.
    pub fn image(self, topic: &str, stamp_ns: i64, size: [u32; 2], encoding: &str, data: &[u8]) -> Message {
        let [width, height] = size;
        let header = Header { stamp_ns, frame_id: FRAME };
        let step = data.len() as u32 / height;
        let image = Image { header, height, width, encoding, is_bigendian: false, step, data };
        self.message(topic, "sensor_msgs/Image", stamp_ns + 45_000_000, |to| image.write(to))
    }

    pub fn compressed(self, topic: &str, stamp_ns: i64, format: &str, data: &[u8]) -> Message {
        let image = CompressedImage { header: Header { stamp_ns, frame_id: FRAME }, format, data };
        self.message(topic, "sensor_msgs/CompressedImage", stamp_ns + 45_000_000, |to| image.write(to))
    }

    pub fn info(self, topic: &str, stamp_ns: i64, info: &CameraInfo) -> Message {
        self.message(topic, "sensor_msgs/CameraInfo", stamp_ns, |to| info.write(stamp_ns, to))
    }

    pub fn tf(self, topic: &str, transforms: &[Transform]) -> Message {
        let stamp_ns = transforms.first().map_or(0, |transform| transform.stamp_ns);
        self.message(topic, "tf2_msgs/TFMessage", stamp_ns, |to| Transform::write_tf(transforms, to))
    }
}

/// Returns a calibration without distortion.
pub fn camera_info(size: [u32; 2], [fx, fy, cx, cy]: [f64; 4]) -> CameraInfo {
    CameraInfo {
        frame_id: FRAME.into(),
        height: size[1],
        width: size[0],
        distortion_model: "plumb_bob".into(),
        d: vec![0.0; 5],
        k: [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
        ..CameraInfo::default()
    }
}

/// Writes a bag of ROS 1, version 2.0, with this many messages in a chunk. Without an index it ends after the last chunk.
pub fn ros1_bag(messages: &[Message], packing: Packing, per_chunk: usize, with_index: bool) -> Vec<u8> {
    let mut topics: Vec<(&str, &str)> = Vec::new();
    for message in messages {
        if !topics.contains(&(&message.topic, message.type_name)) {
            topics.push((&message.topic, message.type_name));
        }
    }
    let number = |message: &Message| {
        topics.iter().position(|topic| *topic == (&*message.topic, message.type_name)).unwrap() as u32
    };
    let connection = |index: usize| {
        let (topic, type_name) = topics[index];
        let data = fields(&[("topic", topic.as_bytes()), ("type", type_name.as_bytes()), ("md5sum", b"*")]);
        record(&[("op", &[7]), ("conn", &(index as u32).to_le_bytes()), ("topic", topic.as_bytes())], &data)
    };
    let time = |ns: i64| [(ns / 1_000_000_000) as u32, (ns % 1_000_000_000) as u32].map(u32::to_le_bytes).concat();
    let head = |index_pos: u64, chunks: u32| {
        let counts = [(topics.len() as u32).to_le_bytes(), chunks.to_le_bytes()];
        let fields = [
            ("op", &[3][..]),
            ("index_pos", &index_pos.to_le_bytes()),
            ("conn_count", &counts[0]),
            ("chunk_count", &counts[1]),
        ];
        record(&fields, &vec![b' '; 4096 - 13])
    };
    let mut bag = [b"#ROSBAG V2.0\n".to_vec(), head(0, 0)].concat();
    let mut described = vec![false; topics.len()];
    let mut infos = Vec::new();
    for part in messages.chunks(per_chunk) {
        let mut chunk = Vec::new();
        let mut counts = vec![0u32; topics.len()];
        for message in part {
            let index = number(message) as usize;
            if !std::mem::replace(&mut described[index], true) {
                chunk.extend(connection(index));
            }
            counts[index] += 1;
            let conn = (index as u32).to_le_bytes();
            chunk
                .extend(record(&[("op", &[2]), ("conn", &conn), ("time", &time(message.received_ns))], &message.bytes));
        }
        let (first, last) = (part[0].received_ns, part[part.len() - 1].received_ns);
        let size = (chunk.len() as u32).to_le_bytes();
        let position = (bag.len() as u64).to_le_bytes();
        bag.extend(record(
            &[("op", &[5]), ("compression", packing.name.as_bytes()), ("size", &size)],
            &(packing.pack)(&chunk),
        ));
        let counts: Vec<u8> = (0u32..)
            .zip(counts)
            .filter(|(_, n)| *n > 0)
            .flat_map(|(c, n)| [c.to_le_bytes(), n.to_le_bytes()].concat())
            .collect();
        let count = (counts.len() as u32 / 8).to_le_bytes();
        let fields = [
            ("op", &[6][..]),
            ("ver", &[1, 0, 0, 0]),
            ("chunk_pos", &position),
            ("start_time", &time(first)),
            ("end_time", &time(last)),
            ("count", &count),
        ];
        infos.push(record(&fields, &counts));
    }
    if with_index {
        let index_pos = bag.len() as u64;
        let head = head(index_pos, infos.len() as u32);
        bag[13..13 + head.len()].copy_from_slice(&head);
        (0..topics.len()).for_each(|index| bag.extend(connection(index)));
        infos.iter().for_each(|info| bag.extend(info));
    }
    bag
}

fn fields(fields: &[(&str, &[u8])]) -> Vec<u8> {
    let field = |(name, value): &(&str, &[u8])| counted(&[name.as_bytes(), b"=", value].concat());
    fields.iter().flat_map(field).collect()
}

fn record(head: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    [counted(&fields(head)), counted(data)].concat()
}

fn counted(bytes: &[u8]) -> Vec<u8> {
    [&(bytes.len() as u32).to_le_bytes(), bytes].concat()
}

/// Writes an MCAP file with this many messages in a chunk, or without chunks for 0. Without an index it ends after the last chunk.
pub fn mcap_bag(messages: &[Message], form: Form, packing: Packing, per_chunk: usize, with_index: bool) -> Vec<u8> {
    let mut topics: Vec<(&str, String)> = Vec::new();
    for message in messages {
        if !topics.iter().any(|(topic, _)| *topic == message.topic) {
            let type_name =
                if form.wire == Wire::Cdr { message.type_name.replace('/', "/msg/") } else { message.type_name.into() };
            topics.push((&message.topic, type_name));
        }
    }
    let number = |message: &Message| topics.iter().position(|(topic, _)| *topic == message.topic).unwrap();
    let encoding = if form.wire == Wire::Cdr { "cdr" } else { "ros1" };
    let description = |index: usize| {
        let (topic, type_name) = &topics[index];
        let id = (index as u16 + 1).to_le_bytes();
        let schema = [&id[..], &counted(type_name.as_bytes()), &counted(b"ros2msg"), &counted(b"")].concat();
        let channel = [&id[..], &id, &counted(topic.as_bytes()), &counted(encoding.as_bytes()), &counted(b"")].concat();
        [mcap_record(3, &schema), mcap_record(4, &channel)].concat()
    };
    let record_of = |message: &Message| {
        let id = (number(message) as u16 + 1).to_le_bytes();
        let time = (message.received_ns as u64).to_le_bytes();
        mcap_record(5, &[&id[..], &[0; 4], &time, &time, &message.bytes].concat())
    };
    let magic = b"\x89MCAP0\r\n";
    let mut bag = [&magic[..], &mcap_record(1, &[counted(b"ros2"), counted(b"test")].concat())].concat();
    let mut described = vec![false; topics.len()];
    for part in messages.chunks(per_chunk.max(1)) {
        let mut records = Vec::new();
        for message in part {
            let index = number(message);
            if !std::mem::replace(&mut described[index], true) {
                records.extend(description(index));
            }
            records.extend(record_of(message));
        }
        if per_chunk == 0 {
            bag.extend(records);
            continue;
        }
        let packed = (packing.pack)(&records);
        let name = if packing.name == "none" { "" } else { packing.name };
        let times =
            [part[0].received_ns, part[part.len() - 1].received_ns].map(|ns| (ns as u64).to_le_bytes()).concat();
        let lengths = [(records.len() as u64).to_le_bytes(), (packed.len() as u64).to_le_bytes()];
        bag.extend(mcap_record(
            6,
            &[&times[..], &lengths[0], &[0; 4], &counted(name.as_bytes()), &lengths[1], &packed].concat(),
        ));
    }
    if with_index {
        bag.extend(mcap_record(15, &[0; 4]));
        let start = bag.len() as u64;
        (0..topics.len()).for_each(|index| bag.extend(description(index)));
        let count = |index: usize| messages.iter().filter(|message| number(message) == index).count() as u64;
        let counts: Vec<u8> = (0..topics.len())
            .flat_map(|i| [&(i as u16 + 1).to_le_bytes()[..], &count(i).to_le_bytes()].concat())
            .collect();
        let span = [messages[0].received_ns, messages[messages.len() - 1].received_ns]
            .map(|ns| (ns as u64).to_le_bytes())
            .concat();
        let total = (messages.len() as u64).to_le_bytes();
        bag.extend(mcap_record(11, &[&total[..], &[0; 18], &span, &counted(&counts)].concat()));
        bag.extend(mcap_record(2, &[&start.to_le_bytes()[..], &[0; 12]].concat()));
        bag.extend(magic);
    }
    bag
}

fn mcap_record(kind: u8, content: &[u8]) -> Vec<u8> {
    [&[kind][..], &(content.len() as u64).to_le_bytes(), content].concat()
}

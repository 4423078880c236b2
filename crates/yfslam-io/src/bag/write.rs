//! Writes MCAP (the specification of version 0 at mcap.dev) with messages of ROS 2, in chunks with an index.
//!
//! In: messages in CDR, in the order of their time. Out: a file that programs for display seek in; it appears once it is finished.

use std::io::{self, Write};
use std::path::Path;

use super::mcap::MAGIC;
use crate::atomic_file::AtomicFile;
use crate::error::{Error, Result};
use crate::message::encode::definition;

/// A chunk is written once it has this size, bytes.
const CHUNK_BYTES: usize = 1 << 20;

/// A topic of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Topic(u16);

/// Writes a recording.
#[derive(Debug)]
pub struct McapWriter {
    file: AtomicFile,
    path: std::path::PathBuf,
    /// Bytes written so far.
    at: u64,
    chunk: Vec<u8>,
    /// Times and positions in the chunk of the messages of each topic.
    index: Vec<Vec<(u64, u64)>>,
    /// Schema and channel records, which are repeated at the end.
    described: Vec<u8>,
    schemas: Vec<&'static str>,
    /// Messages of each topic.
    counts: Vec<u64>,
    /// First and last time, ns.
    span: Option<(u64, u64)>,
    chunks: Vec<u8>,
    chunk_count: u32,
}

impl McapWriter {
    /// Begins a recording.
    ///
    /// # Errors
    /// The file cannot be written; this holds for all functions that follow.
    pub fn create(path: &Path) -> Result<Self> {
        let mut writer = Self {
            file: AtomicFile::create(path)?,
            path: path.to_owned(),
            at: 0,
            chunk: Vec::new(),
            index: Vec::new(),
            described: Vec::new(),
            schemas: Vec::new(),
            counts: Vec::new(),
            span: None,
            chunks: Vec::new(),
            chunk_count: 0,
        };
        let library = concat!("yfslam ", env!("CARGO_PKG_VERSION"));
        let head = record(HEADER, &[text("ros2"), text(library)].concat());
        writer.put(&[MAGIC, &head].concat())?;
        Ok(writer)
    }

    /// Adds a topic with messages of a type such as `nav_msgs/Odometry`.
    ///
    /// # Errors
    /// [`Error::Argument`] if the type is not known.
    pub fn topic(&mut self, name: &str, kind: &'static str) -> Result<Topic> {
        let schema = match self.schemas.iter().position(|known| *known == kind) {
            Some(index) => index,
            None => {
                let (problem, cure) = (format!("the message type {kind} is not known"), "use another type".to_owned());
                let definition = definition(kind).ok_or(Error::Argument { problem, cure })?;
                self.schemas.push(kind);
                let number = (self.schemas.len() as u16).to_le_bytes();
                let full = kind.replacen('/', "/msg/", 1);
                let schema = [&number[..], &text(&full), &text("ros2msg"), &text(&definition)].concat();
                self.described.extend(record(SCHEMA, &schema));
                self.schemas.len() - 1
            }
        };
        let topic = Topic(self.counts.len() as u16);
        let numbers = [topic.0.to_le_bytes(), (schema as u16 + 1).to_le_bytes()].concat();
        let channel = [&numbers[..], &text(name), &text("cdr"), &0u32.to_le_bytes()].concat();
        self.described.extend(record(CHANNEL, &channel));
        self.counts.push(0);
        self.index.push(Vec::new());
        Ok(topic)
    }

    /// Writes a message with its time, ns.
    pub fn message(&mut self, Topic(topic): Topic, stamp_ns: i64, data: &[u8]) -> Result<()> {
        let time = u64::try_from(stamp_ns).unwrap_or(0);
        if self.chunk.is_empty() {
            self.chunk.extend(&self.described);
        }
        let number = usize::from(topic);
        let (Some(index), Some(count)) = (self.index.get_mut(number), self.counts.get_mut(number)) else {
            return Ok(());
        };
        index.push((time, self.chunk.len() as u64));
        let sequence = (*count as u32).to_le_bytes();
        *count += 1;
        let head = [&topic.to_le_bytes()[..], &sequence, &time.to_le_bytes(), &time.to_le_bytes()].concat();
        self.chunk.push(MESSAGE);
        self.chunk.extend(((head.len() + data.len()) as u64).to_le_bytes());
        self.chunk.extend(head);
        self.chunk.extend(data);
        let (first, last) = self.span.unwrap_or((time, time));
        self.span = Some((first.min(time), last.max(time)));
        if self.chunk.len() >= CHUNK_BYTES { self.end_chunk() } else { Ok(()) }
    }

    /// Ends the recording and puts the file in its place.
    pub fn finish(mut self) -> Result<()> {
        self.end_chunk()?;
        self.put(&record(DATA_END, &0u32.to_le_bytes()))?;
        let start = self.at;
        let statistics = self.statistics();
        self.put(&[&self.described[..], &self.chunks, &statistics].concat())?;
        let footer = record(FOOTER, &[&start.to_le_bytes()[..], &0u64.to_le_bytes(), &0u32.to_le_bytes()].concat());
        self.put(&[&footer, MAGIC].concat())?;
        self.file.finish()
    }

    fn end_chunk(&mut self) -> Result<()> {
        if self.chunk.is_empty() {
            return Ok(());
        }
        let chunk = std::mem::take(&mut self.chunk);
        let times = || self.index.iter().flatten().map(|(time, _)| *time);
        let span = [times().min().unwrap_or(0), times().max().unwrap_or(0)].map(u64::to_le_bytes).concat();
        let length = (chunk.len() as u64).to_le_bytes();
        // Without a checksum, which is 0, and without compression.
        let head = [&span[..], &length, &0u32.to_le_bytes(), &text(""), &length].concat();
        let (start, record_length) = (self.at, RECORD_HEAD + (head.len() + chunk.len()) as u64);
        let mut bytes = vec![CHUNK];
        bytes.extend((record_length - RECORD_HEAD).to_le_bytes());
        bytes.extend(head);
        bytes.extend(&chunk);
        let (mut offsets, mut indices) = (Vec::new(), Vec::new());
        for (topic, entries) in (0u16..).zip(&mut self.index).filter(|(_, entries)| !entries.is_empty()) {
            offsets.extend(topic.to_le_bytes());
            offsets.extend((start + record_length + indices.len() as u64).to_le_bytes());
            let entries: Vec<u8> =
                entries.drain(..).flat_map(|(time, at)| [time.to_le_bytes(), at.to_le_bytes()].concat()).collect();
            indices.extend(record(MESSAGE_INDEX, &[&topic.to_le_bytes()[..], &counted(&entries)].concat()));
        }
        let places = [&start.to_le_bytes()[..], &record_length.to_le_bytes(), &counted(&offsets)].concat();
        let index_length = (indices.len() as u64).to_le_bytes();
        let entry = [&span[..], &places, &index_length, &text(""), &length, &length].concat();
        self.chunks.extend(record(CHUNK_INDEX, &entry));
        self.chunk_count += 1;
        bytes.extend(indices);
        self.put(&bytes)
    }

    fn statistics(&self) -> Vec<u8> {
        let (first, last) = self.span.unwrap_or_default();
        let counts: Vec<u8> = (0u16..)
            .zip(&self.counts)
            .flat_map(|(topic, count)| [&topic.to_le_bytes()[..], &count.to_le_bytes()].concat())
            .collect();
        let head = [
            &self.counts.iter().sum::<u64>().to_le_bytes()[..],
            &(self.schemas.len() as u16).to_le_bytes(),
            &(self.counts.len() as u32).to_le_bytes(),
            &[0; 8],
            &self.chunk_count.to_le_bytes(),
            &first.to_le_bytes(),
            &last.to_le_bytes(),
        ];
        record(STATISTICS, &[head.concat(), counted(&counts)].concat())
    }

    fn put(&mut self, bytes: &[u8]) -> Result<()> {
        let written: io::Result<()> = self.file.write_all(bytes);
        self.at += bytes.len() as u64;
        written.map_err(|source| Error::write(&self.path, source))
    }
}

const HEADER: u8 = 1;
const FOOTER: u8 = 2;
const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;
const MESSAGE_INDEX: u8 = 7;
const CHUNK_INDEX: u8 = 8;
const STATISTICS: u8 = 11;
const DATA_END: u8 = 15;
/// Bytes of the kind and the length of a record.
const RECORD_HEAD: u64 = 9;

fn record(kind: u8, content: &[u8]) -> Vec<u8> {
    [&[kind][..], &(content.len() as u64).to_le_bytes(), content].concat()
}

fn counted(bytes: &[u8]) -> Vec<u8> {
    [&(bytes.len() as u32).to_le_bytes()[..], bytes].concat()
}

fn text(text: &str) -> Vec<u8> {
    counted(text.as_bytes())
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;
    use crate::bag::Bag;
    use crate::message::encode::transform;
    use crate::message::types::Header;

    #[test]
    fn the_reader_of_bags_reads_every_message() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        let mut writer = McapWriter::create(&path).unwrap();
        let tf = writer.topic("/tf", "tf2_msgs/TFMessage").unwrap();
        let image = writer.topic("/image", "sensor_msgs/CompressedImage").unwrap();
        assert!(writer.topic("/x", "std_msgs/Nothing").unwrap_err().to_string().contains("std_msgs/Nothing"));
        for k in 0..60i64 {
            let header = Header { stamp_ns: 1_000_000_000 + k * 33_000_000, frame_id: "map" };
            writer
                .message(tf, header.stamp_ns, &transform(header, "camera", &Isometry3::translation(k as f64, 0.0, 0.0)))
                .unwrap();
            writer.message(image, header.stamp_ns, &vec![0; 50_000]).unwrap();
        }
        assert!(!path.exists());
        writer.finish().unwrap();
        let bag = Bag::open(&path).unwrap();
        let counts: Vec<(String, u64)> =
            bag.topics().iter().map(|topic| (topic.name.clone(), topic.messages)).collect();
        assert_eq!(counts.len(), 2);
        assert!(counts.iter().all(|(_, count)| *count == 60), "{counts:?}");
    }
}

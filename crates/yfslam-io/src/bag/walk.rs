//! Goes through the messages of a file in their order.
//!
//! In: a file, and which topics are needed. Out: calls of a visitor; notes about what is damaged.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::ops::ControlFlow;

use super::compression::{Compression, MAX_UNPACKED_BYTES, is_packed, too_long, unpack_head, unpack_message, unpacker};
use super::file::{BagFile, Format, Position};
use super::topics::Topics;
use super::{db3, mcap, ros1};
use crate::error::{Error, Result};

/// Bytes of a message that [`Need::Head`] gives: a header with long names, and what follows up to the encoding.
pub const HEAD_BYTES: usize = 512;

/// Bytes that are read at once.
const READ_AT_ONCE: usize = 4 << 20;

/// Most notes that are kept of one file.
const MAX_NOTES: usize = 20;

/// How much of the messages of a topic is needed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Need {
    /// Nothing.
    #[default]
    Skip,
    /// The first 512 bytes.
    Head,
    /// All bytes.
    Whole,
}

/// A message that was found.
#[derive(Clone, Copy, Debug)]
pub struct Found<'a> {
    /// Index of its topic.
    pub topic: usize,
    /// When the recorder received it, ns.
    pub received_ns: i64,
    /// Where it is.
    pub position: Position,
    /// The bytes that are needed.
    pub bytes: &'a [u8],
}

/// What the head of a chunk says.
#[derive(Clone, Copy, Debug)]
pub struct ChunkHead {
    pub compression: Compression,
    /// Begin of the packed records after the begin of the chunk, bytes.
    pub data_offset: u64,
    pub packed_length: u64,
    pub unpacked_length: u64,
}

/// The part of a file or of an unpacked chunk that is walked through.
pub struct Records<R> {
    pub reader: R,
    /// The byte that is read next, and the end.
    pub at: u64,
    pub end: u64,
    /// Begin of the chunk in the file if the records were unpacked.
    pub chunk: u64,
    buffer: Vec<u8>,
}

/// Why a walk ends before the end.
pub enum Stop {
    /// The visitor has what it needs.
    Done,
    /// The records end within one, which begins at this byte.
    Truncated(u64),
    /// A record that begins at this byte contradicts itself.
    Damaged(u64),
    /// The file cannot be read.
    Failed(std::io::Error),
}

impl From<std::io::Error> for Stop {
    fn from(error: std::io::Error) -> Self {
        Self::Failed(error)
    }
}

/// What records are read from.
pub trait Source {
    fn read_exact(&mut self, into: &mut [u8]) -> io::Result<()>;
    fn skip(&mut self, length: u64) -> io::Result<()>;
}

impl Source for BufReader<File> {
    fn read_exact(&mut self, into: &mut [u8]) -> io::Result<()> {
        Read::read_exact(self, into)
    }

    fn skip(&mut self, length: u64) -> io::Result<()> {
        self.seek_relative(i64::try_from(length).map_err(io::Error::other)?)
    }
}

/// A chunk that is unpacked while it is read.
impl Source for Box<dyn Read + '_> {
    fn read_exact(&mut self, into: &mut [u8]) -> io::Result<()> {
        Read::read_exact(self, into)
    }

    fn skip(&mut self, length: u64) -> io::Result<()> {
        io::copy(&mut self.take(length), &mut io::sink()).map(|_| ())
    }
}

impl<R: Source> Records<R> {
    pub fn left(&self) -> u64 {
        self.end.saturating_sub(self.at)
    }

    /// Reads the next bytes; they are valid until the next call.
    pub fn take(&mut self, length: u64) -> std::result::Result<&[u8], Stop> {
        if length > self.left() || length > MAX_UNPACKED_BYTES {
            return Err(Stop::Truncated(self.at));
        }
        self.buffer.clear();
        while (self.buffer.len() as u64) < length {
            // Memory for what a forged length claims is taken only as the data arrive.
            let before = self.buffer.len();
            self.buffer.resize((before + READ_AT_ONCE).min(length as usize), 0);
            self.reader.read_exact(self.buffer.get_mut(before..).unwrap_or_default())?;
        }
        self.at += length;
        Ok(&self.buffer)
    }

    pub fn skip(&mut self, length: u64) -> std::result::Result<(), Stop> {
        if length > self.left() {
            return Err(Stop::Truncated(self.at));
        }
        // The rest of a packed chunk need not be unpacked.
        if self.chunk == Position::NO_CHUNK || length < self.left() {
            self.reader.skip(length)?;
        }
        self.at += length;
        Ok(())
    }
}

/// A walk through one file.
pub struct Walk<'a> {
    pub file: u32,
    pub topics: &'a mut Topics,
    needs: &'a [Need],
    visit: &'a mut dyn FnMut(Found<'_>) -> ControlFlow<()>,
    /// Whether messages are counted, and their times gathered.
    pub counts: bool,
    pub span_ns: Option<(i64, i64)>,
    pub notes: Vec<String>,
    /// Names of the types of MCAP, by their number.
    pub schemas: std::collections::HashMap<u16, String>,
}

impl<'a> Walk<'a> {
    pub fn new(
        file: u32,
        topics: &'a mut Topics,
        needs: &'a [Need],
        visit: &'a mut dyn FnMut(Found<'_>) -> ControlFlow<()>,
    ) -> Self {
        let (span_ns, notes, schemas) = Default::default();
        Self { file, topics, needs, visit, counts: false, span_ns, notes, schemas }
    }

    /// Reads the topics and counts from the summary; returns whether the file has one that is complete.
    pub fn summary(&mut self, file: &BagFile) -> Result<bool> {
        let start = match file.format {
            // The table of messages is its own index; counting them reads none of their pages.
            Format::Db3 => {
                self.counts = true;
                self.note_log(file);
                return Ok(matches!(db3::walk(self, file), Ok(())));
            }
            Format::Ros1 => ros1::summary_start(file)?,
            Format::Mcap => mcap::summary_start(file)?,
        };
        let Some(start) = start else { return Ok(false) };
        let complete = self.range(file, start)?;
        Ok(matches!(complete, Ok(())))
    }

    /// Goes through all messages of a file.
    pub fn file(&mut self, file: &BagFile) -> Result<ControlFlow<()>> {
        let path = file.path().display();
        let all = file.length();
        match self.range(file, 0)? {
            Err(Stop::Done) => return Ok(ControlFlow::Break(())),
            Err(Stop::Truncated(at)) => {
                self.note(format!(
                    "{path} ends within a record, after {at} of {all} bytes; the messages before it are used"
                ));
            }
            Err(Stop::Damaged(at)) => {
                self.note(format!("{path} is damaged at byte {at} of {all}; the messages before it are used"));
            }
            Err(Stop::Failed(source)) => return Err(Error::read(file.path(), source)),
            Ok(()) => {}
        }
        Ok(ControlFlow::Continue(()))
    }

    /// Goes through the records from a byte to the end of the file.
    fn range(&mut self, file: &BagFile, start: u64) -> Result<std::result::Result<(), Stop>> {
        if file.format == Format::Db3 {
            return Ok(db3::walk(self, file));
        }
        let failed = |source| Error::read(file.path(), source);
        let mut reader = BufReader::with_capacity(4096, file.reopen()?);
        reader.seek(SeekFrom::Start(start)).map_err(failed)?;
        let chunk = Position::NO_CHUNK;
        let mut records = Records { reader, at: start, end: file.length(), chunk, buffer: Vec::new() };
        Ok(match file.format {
            Format::Ros1 => ros1::walk(self, &mut records),
            Format::Mcap => mcap::walk(self, &mut records),
            Format::Db3 => Ok(()),
        })
    }

    /// Goes through a chunk that begins at byte `begin`, and whose packed records come next.
    pub fn chunk<R: Source>(
        &mut self,
        records: &mut Records<R>,
        begin: u64,
        head: ChunkHead,
        walk: impl FnOnce(&mut Self, &mut Records<Box<dyn Read + '_>>) -> std::result::Result<(), Stop>,
    ) -> std::result::Result<(), Stop> {
        let packed = records.take(head.packed_length)?;
        let end = head.unpacked_length;
        let reader = match unpacker(head.compression, packed) {
            Ok(reader) if end <= MAX_UNPACKED_BYTES => reader,
            problem => {
                let problem = problem.map_or_else(|error| error.to_string(), |_| too_long(end));
                self.note(format!("the chunk at byte {begin} is damaged ({problem}); its messages are left out"));
                return Ok(());
            }
        };
        let mut inner = Records { reader, at: 0, end, chunk: begin, buffer: Vec::new() };
        match walk(self, &mut inner) {
            Err(Stop::Failed(error)) => {
                let at = inner.at;
                self.note(format!(
                    "the chunk at byte {begin} is damaged from its byte {at} on ({error}); its other messages are used"
                ));
                Ok(())
            }
            Err(Stop::Truncated(at) | Stop::Damaged(at)) => {
                self.note(format!(
                    "the chunk at byte {begin} is damaged from its byte {at} on; its other messages are used"
                ));
                Ok(())
            }
            result => result,
        }
    }

    /// Takes a message of `length` bytes that comes next; `time_ns` is when it was received.
    pub fn message<R: Source>(
        &mut self,
        records: &mut Records<R>,
        connection: u32,
        time_ns: i64,
        length: u64,
    ) -> std::result::Result<(), Stop> {
        if length > records.left() {
            return Err(Stop::Truncated(records.at));
        }
        self.count(connection, time_ns);
        let Some((topic, need)) = self.need(connection) else { return records.skip(length) };
        let Some(bounded) = u32::try_from(length).ok().filter(|&length| u64::from(length) <= MAX_UNPACKED_BYTES) else {
            self.note(format!("a message of {length} bytes is left out"));
            return records.skip(length);
        };
        let position = Position { file: self.file, length: bounded, chunk: records.chunk, offset: records.at };
        let head = (HEAD_BYTES as u64).min(length);
        let mut bytes = match need {
            Need::Head => records.take(head)?.to_vec(),
            _ => records.take(length)?.to_vec(),
        };
        if need == Need::Head && is_packed(&bytes) {
            bytes.extend(records.take(length - head)?);
        } else if need == Need::Head {
            records.skip(length - head)?;
        }
        self.deliver(topic, need, time_ns, position, bytes)
    }

    /// Counts a message if messages are counted.
    pub fn count(&mut self, connection: u32, time_ns: i64) {
        if self.counts {
            self.topics.count(self.file, connection, 1);
            self.widen_span(time_ns, time_ns);
        }
    }

    /// Returns the topic of a connection and what is needed of its messages; `None` if nothing is.
    pub fn need(&self, connection: u32) -> Option<(usize, Need)> {
        let topic = self.topics.of(self.file, connection)?;
        let need = self.needs.get(topic).copied().filter(|need| *need != Need::Skip)?;
        Some((topic, need))
    }

    /// Unpacks a message and hands it to the visitor.
    pub fn deliver(
        &mut self,
        topic: usize,
        need: Need,
        time_ns: i64,
        position: Position,
        mut bytes: Vec<u8>,
    ) -> std::result::Result<(), Stop> {
        let unpacked = match need {
            Need::Head => unpack_head(&mut bytes, HEAD_BYTES),
            _ => unpack_message(&mut bytes),
        };
        if let Err(problem) = unpacked {
            self.note(format!("a message at byte {} is damaged ({problem}) and left out", position.offset));
            return Ok(());
        }
        match (self.visit)(Found { topic, received_ns: time_ns, position, bytes: &bytes }) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(Stop::Done),
        }
    }

    /// Notes that a recorder has left messages outside the file.
    fn note_log(&mut self, file: &BagFile) {
        let mut log = file.path().as_os_str().to_owned();
        log.push("-wal");
        if std::fs::metadata(&log).is_ok_and(|log| log.len() > 0) {
            let path = file.path().display();
            self.note(format!(
                "the last messages of {path} are in the file {} beside it and are not read; `sqlite3 {path} 'PRAGMA wal_checkpoint'` moves \
                 them",
                std::path::Path::new(&log).display()
            ));
        }
    }

    pub fn widen_span(&mut self, first_ns: i64, last_ns: i64) {
        let (first, last) = self.span_ns.unwrap_or((first_ns, last_ns));
        self.span_ns = Some((first.min(first_ns), last.max(last_ns)));
    }

    pub fn note(&mut self, note: String) {
        match self.notes.len() {
            0..MAX_NOTES => self.notes.push(note),
            MAX_NOTES => self.notes.push("more parts are damaged".into()),
            _ => {}
        }
    }
}

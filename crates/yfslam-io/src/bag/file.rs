//! One file of a bag: reads messages at known positions, and keeps the chunks that were unpacked last.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::compression::{MAX_UNPACKED_BYTES, unpack};
use super::{db3, mcap, ros1, sqlite};
use crate::error::{Error, Result};

/// Most chunks that stay unpacked, and most bytes of them, but for the latest: enough for the look-ahead of the colour and the depth images.
const CACHED_CHUNKS: usize = 16;
const CACHED_BYTES: u64 = 24 << 20;

/// Where a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Position {
    pub(super) file: u32,
    pub(super) length: u32,
    /// Begin of the packed chunk in the file, or [`Position::NO_CHUNK`].
    pub(super) chunk: u64,
    /// Begin of the message in its unpacked chunk or else in the file.
    pub(super) offset: u64,
}

impl Position {
    pub(super) const NO_CHUNK: u64 = u64::MAX;

    /// Returns the byte of the file at which the message or its chunk begins.
    pub(super) fn begin(self) -> u64 {
        if self.chunk == Self::NO_CHUNK { self.offset } else { self.chunk }
    }
}

/// The kinds of files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    Ros1,
    Mcap,
    Db3,
}

impl Format {
    fn of(head: &[u8]) -> Option<Self> {
        if head.starts_with(ros1::MAGIC) {
            Some(Self::Ros1)
        } else if head.starts_with(mcap::MAGIC) {
            Some(Self::Mcap)
        } else if head.starts_with(sqlite::MAGIC) {
            Some(Self::Db3)
        } else {
            None
        }
    }
}

/// An unpacked chunk, or why it cannot be unpacked; empty while a thread unpacks it.
type Unpacked = Arc<OnceLock<std::result::Result<Vec<u8>, String>>>;

/// One file of a bag, open for reading.
#[derive(Debug)]
pub struct BagFile {
    path: PathBuf,
    pub(super) format: Format,
    length: u64,
    file: Mutex<File>,
    /// The last chunks, the latest at the end, by their begin.
    cache: Mutex<Vec<(u64, Unpacked)>>,
}

/// Returns whether a file begins like a bag.
pub fn has_magic(path: &Path) -> bool {
    path.is_file() && head(path).is_ok_and(|head| Format::of(&head).is_some())
}

fn head(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut head = Vec::new();
    File::open(path)?.take(16).read_to_end(&mut head)?;
    Ok(head)
}

impl BagFile {
    pub fn open(path: &Path) -> Result<Self> {
        let failed = |source| Error::read(path, source);
        let metadata = std::fs::metadata(path).map_err(failed)?;
        if !metadata.is_file() {
            return Err(failed(std::io::Error::other("not a regular file")));
        }
        let head = head(path).map_err(failed)?;
        let format = Format::of(&head).ok_or_else(|| not_a_bag(path, &head))?;
        let file = Mutex::new(File::open(path).map_err(failed)?);
        Ok(Self { path: path.into(), format, length: metadata.len(), file, cache: Mutex::default() })
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    pub fn length(&self) -> u64 {
        self.length
    }

    /// Opens the file once more, for reading from the begin to the end.
    pub fn reopen(&self) -> Result<File> {
        File::open(&self.path).map_err(|source| Error::read(&self.path, source))
    }

    /// Reads the bytes of a message as they are stored.
    pub fn read(&self, position: Position, bytes: &mut Vec<u8>) -> Result<()> {
        let Position { length, chunk, offset, .. } = position;
        if self.format == Format::Db3 {
            return db3::read(self, offset, length, bytes).ok_or_else(|| {
                Error::content(&self.path, format!("the row at byte {offset} is damaged"), "copy the bag again")
            });
        }
        if chunk == Position::NO_CHUNK {
            return self.read_at(offset, u64::from(length), bytes);
        }
        let unpacked = self.chunk(chunk);
        let damaged = |problem: &str| {
            Error::content(&self.path, format!("the chunk at byte {chunk} is damaged: {problem}"), "copy the bag again")
        };
        let whole = match unpacked.get_or_init(|| self.unpack(chunk)) {
            Ok(whole) => whole,
            Err(problem) => return Err(damaged(problem)),
        };
        let range = usize::try_from(offset).ok().and_then(|start| whole.get(start..)?.get(..length as usize));
        bytes.clear();
        bytes.extend(range.ok_or_else(|| damaged("it is shorter than before"))?);
        Ok(())
    }

    /// Returns a place in the cache for a chunk.
    fn chunk(&self, chunk: u64) -> Unpacked {
        let mut cache = self.cache.lock().unwrap_or_else(PoisonError::into_inner);
        let entry = match cache.iter().position(|(begin, _)| *begin == chunk) {
            Some(index) => cache.remove(index),
            None => (chunk, Unpacked::default()),
        };
        let bytes = |(_, unpacked): &(u64, Unpacked)| match unpacked.get() {
            Some(Ok(bytes)) => bytes.len() as u64,
            _ => 0,
        };
        while cache.len() >= CACHED_CHUNKS || cache.iter().map(bytes).sum::<u64>() > CACHED_BYTES {
            cache.remove(0);
        }
        cache.push(entry.clone());
        entry.1
    }

    /// Reads and unpacks the chunk at this byte.
    fn unpack(&self, chunk: u64) -> std::result::Result<Vec<u8>, String> {
        let text = |error: Error| error.to_string();
        let mut bytes = Vec::new();
        let head_length = 4096.min(self.length.saturating_sub(chunk));
        self.read_at(chunk, head_length, &mut bytes).map_err(text)?;
        let head = match self.format {
            Format::Ros1 => ros1::chunk_head(&bytes),
            Format::Mcap => mcap::chunk_head(&bytes),
            Format::Db3 => None,
        };
        let head = head.ok_or("its head cannot be read")??;
        self.read_at(chunk + head.data_offset, head.packed_length, &mut bytes).map_err(text)?;
        unpack(head.compression, &bytes, head.unpacked_length)
    }

    /// Reads bytes of the file itself.
    pub fn read_at(&self, offset: u64, length: u64, bytes: &mut Vec<u8>) -> Result<()> {
        let in_file = offset.checked_add(length).is_some_and(|end| end <= self.length);
        if !in_file || length > MAX_UNPACKED_BYTES {
            let problem = format!("has no {length} bytes at byte {offset}");
            return Err(Error::content(&self.path, problem, "copy the bag again"));
        }
        bytes.resize(length as usize, 0);
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let read = file.seek(SeekFrom::Start(offset)).and_then(|_| file.read_exact(bytes));
        read.map_err(|source| Error::read(&self.path, source))
    }
}

fn not_a_bag(path: &Path, head: &[u8]) -> Error {
    let (problem, cure) = match head {
        [b'#', b'R', b'O', b'S', b'B', b'A', b'G', ..] | [b'#', b'R', b'O', b'S', b'R', b'E', b'C', ..] => {
            ("is a bag of an early version of ROS 1", "convert it to version 2.0 with `rosbag fix` of ROS 1")
        }
        [0x28, 0xb5, 0x2f, 0xfd, ..] => {
            ("is packed as a whole with Zstandard", "unpack it with `zstd -d`, and name the unpacked file")
        }
        _ => ("is not a bag of ROS 1 (.bag), MCAP (.mcap) or rosbag2 (.db3)", "copy the bag again"),
    };
    Error::content(path, problem, cure)
}

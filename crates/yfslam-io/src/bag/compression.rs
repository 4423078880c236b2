//! Unpacks chunks and messages, never beyond a given length.

use std::io::{self, Read};

/// Longest chunk or message that is unpacked, bytes; recorders make chunks of a few megabytes.
pub const MAX_UNPACKED_BYTES: u64 = 512 << 20;

/// First bytes of what Zstandard packs.
const ZSTD_MAGIC: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

/// How a chunk is packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compression {
    None,
    Bz2,
    Lz4,
    Zstd,
}

impl Compression {
    /// Returns the compression of this name; `None` if it is not understood.
    pub fn of(name: &str) -> Option<Self> {
        Some(match name {
            "" | "none" => Self::None,
            "bz2" => Self::Bz2,
            "lz4" => Self::Lz4,
            "zstd" => Self::Zstd,
            _ => return None,
        })
    }
}

/// Returns a reader of what is packed.
pub fn unpacker<'a>(compression: Compression, packed: &'a [u8]) -> io::Result<Box<dyn Read + 'a>> {
    Ok(match compression {
        Compression::None => Box::new(packed),
        Compression::Bz2 => Box::new(bzip2::read::MultiBzDecoder::new(packed)),
        Compression::Lz4 => Box::new(lz4_flex::frame::FrameDecoder::new(packed)),
        Compression::Zstd => zstd(packed)?,
    })
}

/// Unpacks `packed`, which was `length` bytes long.
pub fn unpack(compression: Compression, packed: &[u8], length: u64) -> Result<Vec<u8>, String> {
    if length > MAX_UNPACKED_BYTES {
        return Err(too_long(length));
    }
    let unpacked = unpacker(compression, packed).and_then(|decoder| read(decoder, length, packed.len()));
    let unpacked = unpacked.map_err(|error| error.to_string())?;
    match unpacked.len() as u64 == length {
        true => Ok(unpacked),
        false => Err(format!("it has {} bytes instead of {length}", unpacked.len())),
    }
}

/// Says that a chunk is too long.
pub fn too_long(length: u64) -> String {
    format!("it claims {length} bytes, and no more than {MAX_UNPACKED_BYTES} are unpacked")
}

/// Unpacks a message that was packed on its own, as rosbag2 does; other messages stay as they are.
pub fn unpack_message(bytes: &mut Vec<u8>) -> Result<(), String> {
    if is_packed(bytes) {
        let decoder = zstd(bytes).map_err(|error| error.to_string())?;
        let unpacked = read(decoder, MAX_UNPACKED_BYTES, bytes.len()).map_err(|error| error.to_string())?;
        if unpacked.len() as u64 > MAX_UNPACKED_BYTES {
            return Err(format!("it has more than {MAX_UNPACKED_BYTES} bytes"));
        }
        *bytes = unpacked;
    }
    Ok(())
}

/// Unpacks the first `length` bytes of a message that was packed on its own; other messages stay as they are.
pub fn unpack_head(bytes: &mut Vec<u8>, length: usize) -> Result<(), String> {
    if is_packed(bytes) {
        let decoder = zstd(bytes).map_err(|error| error.to_string())?;
        let mut head = Vec::new();
        decoder.take(length as u64).read_to_end(&mut head).map_err(|error| error.to_string())?;
        *bytes = head;
    }
    Ok(())
}

/// Returns whether a message is packed on its own. A message of ROS 2 begins with a zero, and one of ROS 1 of the types that are read with
/// a number that counts from 0.
pub fn is_packed(bytes: &[u8]) -> bool {
    bytes.starts_with(&ZSTD_MAGIC)
}

#[cfg(not(feature = "zstd-c"))]
fn zstd<'a>(packed: &'a [u8]) -> io::Result<Box<dyn Read + 'a>> {
    let decoder = ruzstd::decoding::StreamingDecoder::new(packed).map_err(io::Error::other)?;
    Ok(Box::new(decoder))
}

#[cfg(feature = "zstd-c")]
fn zstd<'a>(packed: &'a [u8]) -> io::Result<Box<dyn Read + 'a>> {
    Ok(Box::new(zstd::stream::read::Decoder::with_buffer(packed)?))
}

fn read(decoder: impl Read, length: u64, packed: usize) -> io::Result<Vec<u8>> {
    // Memory for what a forged length claims is taken only as the data arrive.
    let likely = (packed as u64).saturating_mul(16).min(length) as usize;
    let mut unpacked = Vec::with_capacity(likely);
    // One byte more shows that there is more than was claimed.
    decoder.take(length + 1).read_to_end(&mut unpacked)?;
    Ok(unpacked)
}

//! Records as bytes: a header that says what follows, then the records, compressed.
//!
//! ```text
//! kind · version u16 · length of the rest u64 · CRC-32 of the rest u32 │ zstd(postcard(records))
//! ```
//!
//! Numbers of the header are little-endian. One kind may follow another: what `yfslam run --dense --save-map` writes is [`DENSE_MAP`], then
//! [`MAP`]. In: records. Out: bytes, and back, checked. Nothing here touches files.

use serde::Serialize;
use serde::de::DeserializeOwned;

/// What bytes hold: the words they begin with, and the version of the records that this code writes and reads.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Section {
    /// First bytes, such as "yfslam map".
    pub magic: &'static str,
    /// The only version that is read.
    pub version: u16,
}

/// Keyframes and landmarks, by which a camera finds where it is.
pub(crate) const MAP: Section = Section { magic: "yfslam map", version: 1 };
/// Pieces of a dense map, of which products are made.
pub(crate) const DENSE_MAP: Section = Section { magic: "yfslam dense map", version: 3 };

/// Why bytes cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ContainerError {
    /// The bytes begin like something else.
    #[error("this is no {0}: it does not begin with \"{0}\"")]
    Foreign(&'static str),
    /// Another version of the format.
    #[error(
        "the {magic} has version {found} of the format, this program reads version {version}: use the program that wrote it, or make it anew"
    )]
    Version {
        /// What was wanted.
        magic: &'static str,
        /// The version found.
        found: u16,
        /// The version that is read.
        version: u16,
    },
    /// Bytes are missing, or there are more than the header announces.
    #[error("it is {found} bytes long, its header announces {announced}: it was cut or appended to; use another copy")]
    Length {
        /// Bytes found.
        found: u64,
        /// Bytes announced.
        announced: u64,
    },
    /// The bytes were altered.
    #[error("its checksum is {found:08x}, its header says {announced:08x}: it was altered; use another copy")]
    Checksum {
        /// Checksum of the bytes.
        found: u32,
        /// Checksum in the header.
        announced: u32,
    },
    /// A map without a dense one.
    #[error(
        "it is a map to find a camera by, without surfaces: save it by a run with --dense, or give the output folder of such a run"
    )]
    NoPieces,
    /// The records contradict each other, or themselves.
    #[error("its records are wrong: {0}")]
    Records(String),
}

impl Section {
    /// Bytes of the header.
    pub(crate) const fn header(self) -> usize {
        self.magic.len() + 2 + 8 + 4
    }

    /// The records as bytes.
    ///
    /// # Errors
    /// If the records cannot be written, which would be a fault of this program.
    pub(crate) fn pack(self, records: &impl Serialize) -> Result<Vec<u8>, ContainerError> {
        let plain = postcard::to_allocvec(records).map_err(|error| ContainerError::Records(error.to_string()))?;
        let packed = ruzstd::encoding::compress_to_vec(plain.as_slice(), ruzstd::encoding::CompressionLevel::Fastest);
        let mut bytes = Vec::with_capacity(self.header() + packed.len());
        bytes.extend_from_slice(self.magic.as_bytes());
        bytes.extend_from_slice(&self.version.to_le_bytes());
        bytes.extend_from_slice(&(packed.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&crc32fast::hash(&packed).to_le_bytes());
        bytes.extend_from_slice(&packed);
        Ok(bytes)
    }

    /// Whether bytes begin like this kind.
    pub(crate) fn begins(self, bytes: &[u8]) -> bool {
        bytes.starts_with(self.magic.as_bytes())
    }

    /// What of `bytes` is of this kind, still packed and without its header, and what comes after it.
    ///
    /// # Errors
    /// If the bytes are of another kind or version, cut, or altered.
    pub(crate) fn split(self, bytes: &[u8]) -> Result<(PackedSection<'_>, &[u8]), ContainerError> {
        let rest = bytes.strip_prefix(self.magic.as_bytes()).ok_or(ContainerError::Foreign(self.magic))?;
        let cut = |announced: u64| ContainerError::Length { found: bytes.len() as u64, announced };
        let header = self.header() as u64;
        let (version, rest) = rest.split_first_chunk::<2>().ok_or_else(|| cut(header))?;
        let found = u16::from_le_bytes(*version);
        if found != self.version {
            return Err(ContainerError::Version { magic: self.magic, found, version: self.version });
        }
        let (length, rest) = rest.split_first_chunk::<8>().ok_or_else(|| cut(header))?;
        let (checksum, rest) = rest.split_first_chunk::<4>().ok_or_else(|| cut(header))?;
        let (length, announced) = (u64::from_le_bytes(*length), u32::from_le_bytes(*checksum));
        let at = usize::try_from(length).ok().and_then(|length| rest.split_at_checked(length));
        let (packed, rest) = at.ok_or_else(|| cut(length.saturating_add(header)))?;
        let found = crc32fast::hash(packed);
        if found != announced {
            return Err(ContainerError::Checksum { found, announced });
        }
        Ok((PackedSection(packed), rest))
    }

    /// The same of `bytes` that hold nothing else.
    ///
    /// # Errors
    /// If the bytes are of another kind or version, cut, appended to, or altered.
    pub(crate) fn whole(self, bytes: &[u8]) -> Result<PackedSection<'_>, ContainerError> {
        let (packed, rest) = self.split(bytes)?;
        if rest.is_empty() {
            return Ok(packed);
        }
        let found = bytes.len() as u64;
        Err(ContainerError::Length { found, announced: found - rest.len() as u64 })
    }

    /// The records in `bytes` that hold nothing else.
    ///
    /// # Errors
    /// As [`Section::whole`], or if they are no records.
    pub(crate) fn unpack<T: DeserializeOwned>(self, bytes: &[u8]) -> Result<T, ContainerError> {
        self.whole(bytes)?.unpack()
    }
}

/// Records as they were packed, checksum proved.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PackedSection<'a>(&'a [u8]);

impl PackedSection<'_> {
    /// The records.
    ///
    /// # Errors
    /// If they are none.
    pub(crate) fn unpack<T: DeserializeOwned>(self) -> Result<T, ContainerError> {
        let wrong = |error: &dyn std::fmt::Display| ContainerError::Records(error.to_string());
        let mut plain = Vec::new();
        let mut decoder = ruzstd::decoding::StreamingDecoder::new(self.0).map_err(|e| wrong(&e))?;
        std::io::Read::read_to_end(&mut decoder, &mut plain).map_err(|e| wrong(&e))?;
        postcard::from_bytes(&plain).map_err(|e| wrong(&e))
    }
}

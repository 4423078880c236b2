//! The container of saved maps: sections, each with a header and compressed records.
//!
//! ```text
//! magic · version u16 · length of the rest u64 · CRC-32 of the rest u32 │ zstd(postcard(records))
//! ```
//!
//! Numbers of the header are little-endian. A file may have several sections: `yfslam run --dense --save-map` writes [`DENSE_MAP`],
//! [`FRAME`], then [`MAP`]. In: records. Out: bytes; and the reverse, with checks. This module does not access files.

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::camera::Camera;

/// A type of section: its first bytes, and the version of the records that this program writes and reads.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Section {
    /// First bytes, such as "yfslam map".
    pub magic: &'static str,
    /// The version that is written, and read.
    pub version: u16,
    /// The version of records whose camera has the rational distortion model, which programs of the version before cannot read.
    pub rational_version: u16,
}

/// Section with the keyframes and landmarks, for localisation.
pub(crate) const MAP: Section = Section { magic: "yfslam map", version: 1, rational_version: 2 };
/// Section with the keyframe patches of a dense map.
pub(crate) const DENSE_MAP: Section = Section { magic: "yfslam dense map", version: 3, rational_version: 4 };
/// Section with the map frame.
pub(crate) const FRAME: Section = Section { magic: "yfslam frame", version: 1, rational_version: 1 };

/// Bytes to which the records of any section may unpack, and how many times its length those of a large one may. Descriptors and depths
/// hardly repeat, so that a map stays far below it; without a bound, a forged file of a few kilobytes would take all memory.
const ALWAYS_UNPACKED_BYTES: u64 = 64 << 20;
const MAX_RATIO: u64 = 200;

/// The sections of a file. Their lengths and checksums are right.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sections<'a> {
    pub(crate) dense_map: Option<PackedSection<'a>>,
    pub(crate) frame: Option<PackedSection<'a>>,
    pub(crate) map: Option<PackedSection<'a>>,
}

impl<'a> Sections<'a> {
    /// Splits a file into its sections, of which one is `expected`.
    ///
    /// # Errors
    /// If there is no section, a section has another version, or is truncated or altered, or other bytes follow.
    pub(crate) fn of(bytes: &'a [u8], expected: Section) -> Result<Self, ContainerError> {
        let (mut sections, mut rest) = (Self::default(), bytes);
        let Self { dense_map, frame, map } = &mut sections;
        for (section, place) in [(DENSE_MAP, dense_map), (FRAME, frame), (MAP, map)] {
            if section.begins(rest) {
                let (packed, after) = section.split(rest)?;
                (*place, rest) = (Some(packed), after);
            }
        }
        match (bytes.len(), rest.len()) {
            (_, 0) if !bytes.is_empty() => Ok(sections),
            (found, left) if left < found => {
                Err(ContainerError::Length { found: found as u64, announced: (found - left) as u64 })
            }
            _ => Err(ContainerError::Foreign(expected.magic)),
        }
    }
}

/// Reason why bytes cannot be read as a saved map.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ContainerError {
    /// The bytes do not begin with the expected magic words.
    #[error("this is no {0}: it does not begin with \"{0}\"; give a file that yfslam saved")]
    Foreign(&'static str),
    /// The format has another version.
    #[error(
        "the {magic} has version {found} of the format, but this program reads version {version}: use the program that wrote it, or make it anew"
    )]
    Version {
        /// Magic words of the expected section.
        magic: &'static str,
        /// Version of the bytes.
        found: u16,
        /// Version that this program reads.
        version: u16,
    },
    /// There are fewer or more bytes than the header states.
    #[error("it has {found} bytes, but its header states {announced}: it was truncated or extended; use another copy")]
    Length {
        /// Number of bytes.
        found: u64,
        /// Number of bytes according to the header.
        announced: u64,
    },
    /// The checksum does not match the bytes.
    #[error("its checksum is {found:08x}, but its header states {announced:08x}: it was altered; use another copy")]
    Checksum {
        /// Checksum of the bytes.
        found: u32,
        /// Checksum in the header.
        announced: u32,
    },
    /// The file has a map but no dense map.
    #[error(
        "it is a map for localisation without a dense map: save it in a run with --dense, or give the output folder of such a run"
    )]
    NoPieces,
    /// The records are inconsistent.
    #[error("its records are wrong: {0}")]
    Records(String),
}

impl Section {
    /// Returns the type of section that is written for a camera.
    pub(crate) fn of_camera(self, camera: &Camera) -> Self {
        let version = if camera.rational == [0.0; 3] { self.version } else { self.rational_version };
        Self { version, ..self }
    }

    /// Returns the length of the header, bytes.
    pub(crate) const fn header(self) -> usize {
        self.magic.len() + 2 + 8 + 4
    }

    /// Serialises and compresses records.
    ///
    /// # Errors
    /// If serialisation fails, which would be a fault of this program.
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

    /// Returns whether bytes begin with this type of section.
    pub(crate) fn begins(self, bytes: &[u8]) -> bool {
        bytes.starts_with(self.magic.as_bytes())
    }

    /// Splits `bytes` into the compressed records of this section, without its header, and the bytes after it.
    ///
    /// # Errors
    /// If the bytes begin with another type or version of section, or are truncated or altered.
    pub(crate) fn split(self, bytes: &[u8]) -> Result<(PackedSection<'_>, &[u8]), ContainerError> {
        let rest = bytes.strip_prefix(self.magic.as_bytes()).ok_or(ContainerError::Foreign(self.magic))?;
        let wrong_length = |announced: u64| ContainerError::Length { found: bytes.len() as u64, announced };
        let header = self.header() as u64;
        let (version, rest) = rest.split_first_chunk::<2>().ok_or_else(|| wrong_length(header))?;
        let found = u16::from_le_bytes(*version);
        if ![self.version, self.rational_version].contains(&found) {
            return Err(ContainerError::Version { magic: self.magic, found, version: self.version });
        }
        let (length, rest) = rest.split_first_chunk::<8>().ok_or_else(|| wrong_length(header))?;
        let (checksum, rest) = rest.split_first_chunk::<4>().ok_or_else(|| wrong_length(header))?;
        let (length, announced) = (u64::from_le_bytes(*length), u32::from_le_bytes(*checksum));
        let at = usize::try_from(length).ok().and_then(|length| rest.split_at_checked(length));
        let (packed, rest) = at.ok_or_else(|| wrong_length(length.saturating_add(header)))?;
        let found = crc32fast::hash(packed);
        if found != announced {
            return Err(ContainerError::Checksum { found, announced });
        }
        Ok((PackedSection(packed), rest))
    }
}

/// Compressed records whose checksum has been verified.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PackedSection<'a>(&'a [u8]);

impl PackedSection<'_> {
    /// Decompresses and deserialises the records.
    ///
    /// # Errors
    /// If they cannot be deserialised.
    pub(crate) fn unpack<T: DeserializeOwned>(self) -> Result<T, ContainerError> {
        let wrong = |error: &dyn std::fmt::Display| ContainerError::Records(error.to_string());
        let mut plain = Vec::new();
        let decoder = ruzstd::decoding::StreamingDecoder::new(self.0).map_err(|e| wrong(&e))?;
        let most = MAX_RATIO.saturating_mul(self.0.len() as u64).max(ALWAYS_UNPACKED_BYTES);
        std::io::Read::read_to_end(&mut std::io::Read::take(decoder, most + 1), &mut plain).map_err(|e| wrong(&e))?;
        if plain.len() as u64 > most {
            let packed = self.0.len();
            return Err(wrong(&format!(
                "{packed} bytes unpack to more than {most}, which no map does; use another copy"
            )));
        }
        postcard::from_bytes(&plain).map_err(|e| wrong(&e))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame of Zstandard whose blocks repeat one byte (RFC 8878, section 3.1.1.2): four bytes stand for 128 KiB.
    #[test]
    fn a_section_that_unpacks_to_far_more_than_a_map_does_is_refused() {
        let block = |last: u32| ((128 << 10) << 3 | 1 << 1 | last).to_le_bytes();
        let blocks =
            (0..1000).map(|number| block(u32::from(number == 999))).flat_map(|head| [head[0], head[1], head[2], 7]);
        let packed: Vec<u8> = [0x28, 0xb5, 0x2f, 0xfd, 0x00, 0x58].into_iter().chain(blocks).collect();
        let error = PackedSection(&packed).unpack::<Vec<u8>>().unwrap_err().to_string();
        assert!(error.contains("4006 bytes unpack to more than 67108864"), "{error}");
    }
}

//! Saved maps and dense maps.
//!
//! A file of a map has a checksum, behind which random bytes hardly ever get. The targets of records therefore take the bytes that a map
//! has before they are compressed, and wrap them as a file: the checksum is right, and the compression is none.

use yfslam::dense::{DenseMap, Up};
use yfslam::{Config, MapUse, SavedMap, Slam};

/// A file of a map; its checksum is made right.
pub fn map(bytes: &[u8]) -> bool {
    use_map(&with_checksums(bytes))
}

/// A file of a dense map; its checksum is made right.
pub fn dense_map(bytes: &[u8]) -> bool {
    use_dense_map(&with_checksums(bytes))
}

/// The records of a map.
pub fn map_records(bytes: &[u8]) -> bool {
    use_map(&wrapped("yfslam map", 1, bytes))
}

/// The records of a dense map.
pub fn dense_map_records(bytes: &[u8]) -> bool {
    use_dense_map(&wrapped("yfslam dense map", 3, bytes))
}

/// Reads a map, and localises in it if its camera is small.
fn use_map(bytes: &[u8]) -> bool {
    let Ok(saved) = SavedMap::from_bytes(bytes) else { return false };
    let checked = yfslam::unstable::check_map(saved.map());
    assert_eq!(checked, Ok(()), "a map that was accepted contradicts itself");
    let camera = yfslam::Camera::pinhole(160, 120, 133.0, 133.0, 80.0, 60.0);
    for map_use in [MapUse::Localise, MapUse::Extend] {
        if let Ok(mut slam) =
            Slam::builder(camera.clone()).config(Config::default()).map(saved.clone(), map_use).build()
        {
            assert!(slam.save_map().is_ok(), "a map that was accepted cannot be saved");
        }
    }
    true
}

fn use_dense_map(bytes: &[u8]) -> bool {
    let Ok(dense_map) = DenseMap::from_bytes(bytes) else { return false };
    let turn = dense_map.turn(Up::Level);
    let _ = dense_map.floor_m(&turn);
    let again = dense_map.to_bytes().map(|bytes| DenseMap::from_bytes(&bytes));
    assert!(matches!(again, Ok(Ok(_))), "a dense map that was accepted cannot be written and read: {:?}", again.err());
    true
}

/// The magic words of the sections of a file.
const MAGICS: [&str; 3] = ["yfslam dense map", "yfslam frame", "yfslam map"];

/// Makes the lengths and checksums of the sections of a file right. Where two sections follow each other, their lengths are left.
fn with_checksums(bytes: &[u8]) -> Vec<u8> {
    let mut fixed = bytes.to_vec();
    let mut at = 0;
    while let Some(magic) = MAGICS.iter().find(|magic| fixed[at..].starts_with(magic.as_bytes())) {
        let (length_at, body) = (at + magic.len() + 2, at + magic.len() + 14);
        let Some(length) = fixed.get(length_at..length_at + 8).and_then(|eight| eight.try_into().ok()) else { break };
        let announced = usize::try_from(u64::from_le_bytes(length)).unwrap_or(usize::MAX);
        let Some(left) = fixed.len().checked_sub(body) else { break };
        let length = announced.min(left);
        let checksum = crc32fast::hash(&fixed[body..body + length]);
        fixed[length_at..length_at + 8].copy_from_slice(&(length as u64).to_le_bytes());
        fixed[length_at + 8..body].copy_from_slice(&checksum.to_le_bytes());
        at = body + length;
    }
    fixed
}

/// Wraps records as a section whose packed bytes are a frame of Zstandard in raw blocks (RFC 8878, section 3.1.1).
fn wrapped(magic: &str, version: u16, records: &[u8]) -> Vec<u8> {
    const BLOCK: usize = 1 << 16;
    // The window descriptor 0x58 stands for a window of 2 MiB.
    let mut packed = vec![0x28, 0xb5, 0x2f, 0xfd, 0x00, 0x58];
    let mut blocks = records.chunks(BLOCK).peekable();
    if blocks.peek().is_none() {
        packed.extend([1, 0, 0]);
    }
    while let Some(block) = blocks.next() {
        let last = u32::from(blocks.peek().is_none());
        packed.extend_from_slice(&((block.len() as u32) << 3 | last).to_le_bytes()[..3]);
        packed.extend_from_slice(block);
    }
    let mut bytes = magic.as_bytes().to_vec();
    bytes.extend(version.to_le_bytes());
    bytes.extend((packed.len() as u64).to_le_bytes());
    bytes.extend(crc32fast::hash(&packed).to_le_bytes());
    bytes.extend(packed);
    bytes
}

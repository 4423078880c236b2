//! MCAP (the specification of version 0 at mcap.dev): records of one byte of kind, eight of length, and their content.

use super::compression::Compression;
use super::fields::Fields;
use super::file::BagFile;
use super::walk::{ChunkHead, Records, Source, Stop, Walk};
use crate::error::Result;
use crate::message::wire::Wire;

pub const MAGIC: &[u8] = b"\x89MCAP0\r\n";

const FOOTER: u8 = 2;
const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;
const STATISTICS: u8 = 11;

/// Bytes of the kind and the length of a record.
const RECORD_HEAD: u64 = 9;
/// Bytes of a message before its data: channel, sequence number, two times.
const MESSAGE_HEAD: u64 = 22;
/// Bytes of a footer with its head, and of the magic that follows it.
const FOOTER_BYTES: u64 = 29 + 8;
/// Longest description of a type or a channel that is read, bytes.
const MAX_DESCRIPTION: u64 = 64 << 20;

/// Returns where the summary begins; `None` without a summary.
pub fn summary_start(file: &BagFile) -> Result<Option<u64>> {
    let Some(begin) = file.length().checked_sub(FOOTER_BYTES) else { return Ok(None) };
    let mut bytes = Vec::new();
    file.read_at(begin, FOOTER_BYTES, &mut bytes)?;
    if !bytes.ends_with(MAGIC) || bytes.first() != Some(&FOOTER) {
        return Ok(None);
    }
    let start = bytes.get(RECORD_HEAD as usize..).and_then(|rest| Fields(rest).u64()).unwrap_or(0);
    Ok(Some(start).filter(|start| (MAGIC.len() as u64..begin).contains(start) && has_statistics(file, *start, begin)))
}

/// Returns whether the summary counts the messages. Without that, they must be counted one by one.
fn has_statistics(file: &BagFile, start: u64, end: u64) -> bool {
    let (mut at, mut head) = (start, Vec::new());
    while at.saturating_add(RECORD_HEAD) <= end && file.read_at(at, RECORD_HEAD, &mut head).is_ok() {
        let mut fields = Fields(&head);
        let (kind, length) = (fields.u8(), fields.u64().unwrap_or(u64::MAX));
        if kind == Some(STATISTICS) {
            return true;
        }
        at = at.saturating_add(RECORD_HEAD).saturating_add(length);
    }
    false
}

/// Reads the head of the chunk whose record begins `bytes`; an error says which compression is not understood.
pub fn chunk_head(bytes: &[u8]) -> Option<std::result::Result<ChunkHead, String>> {
    let mut fields = Fields(bytes);
    if fields.u8()? != CHUNK {
        return None;
    }
    fields.u64()?;
    fields.take(16)?;
    let unpacked_length = fields.u64()?;
    fields.u32()?;
    let name = fields.text()?;
    let packed_length = fields.u64()?;
    let data_offset = (bytes.len() - fields.0.len()) as u64;
    let head = |compression| ChunkHead { compression, data_offset, packed_length, unpacked_length };
    Some(Compression::of(&name).map(head).ok_or(format!("its compression '{name}' is not understood")))
}

/// Goes through the records of a file.
pub fn walk<R: Source>(walk: &mut Walk<'_>, records: &mut Records<R>) -> std::result::Result<(), Stop> {
    if records.at == 0 {
        records.skip(MAGIC.len() as u64)?;
    }
    while records.left() > 0 {
        let begin = records.at;
        match record_head(records)? {
            (FOOTER, _) => return Ok(()),
            (CHUNK, length) => chunk(walk, records, begin, length)?,
            (kind, length) => record(walk, records, begin, kind, length)?,
        }
    }
    // A file ends with a footer.
    Err(Stop::Truncated(records.at))
}

/// Goes through the records of a chunk.
fn inner<R: Source>(walk: &mut Walk<'_>, records: &mut Records<R>) -> std::result::Result<(), Stop> {
    while records.left() > 0 {
        let begin = records.at;
        let (kind, length) = record_head(records)?;
        record(walk, records, begin, kind, length)?;
    }
    Ok(())
}

/// Returns the kind and the length of the next record.
fn record_head<R: Source>(records: &mut Records<R>) -> std::result::Result<(u8, u64), Stop> {
    let begin = records.at;
    let mut head = Fields(records.take(RECORD_HEAD)?);
    head.u8().zip(head.u64()).ok_or(Stop::Truncated(begin))
}

/// Reads a record that is not a chunk.
fn record<R: Source>(
    walk: &mut Walk<'_>,
    records: &mut Records<R>,
    begin: u64,
    kind: u8,
    length: u64,
) -> std::result::Result<(), Stop> {
    if length > records.left() {
        return Err(Stop::Truncated(begin));
    }
    match kind {
        MESSAGE => {
            let data = length.checked_sub(MESSAGE_HEAD).ok_or(Stop::Damaged(begin))?;
            let mut fields = Fields(records.take(MESSAGE_HEAD)?);
            let (channel, _, time) = (fields.u16(), fields.u32(), fields.u64());
            let (channel, time) = channel.zip(time).ok_or(Stop::Damaged(begin))?;
            walk.message(records, u32::from(channel), to_ns(time), data)
        }
        SCHEMA | CHANNEL | STATISTICS if length <= MAX_DESCRIPTION => {
            let fields = Fields(records.take(length)?);
            let described = match kind {
                SCHEMA => schema(walk, fields),
                CHANNEL => channel(walk, fields),
                _ => statistics(walk, fields),
            };
            described.ok_or(Stop::Damaged(begin))
        }
        // 0 is no kind: a part of the file was never written.
        0 => Err(Stop::Damaged(begin)),
        _ => records.skip(length),
    }
}

fn chunk<R: Source>(
    outer: &mut Walk<'_>,
    records: &mut Records<R>,
    begin: u64,
    length: u64,
) -> std::result::Result<(), Stop> {
    let truncated = length > records.left();
    // Times, length, checksum, and the length of the name of the compression.
    let fixed = 16 + 8 + 4 + 4;
    let mut head = records.take(fixed)?.to_vec();
    let name = head.last_chunk::<4>().map_or(0, |bytes| u32::from_le_bytes(*bytes));
    if name > 100 {
        return Err(Stop::Damaged(begin));
    }
    head.extend(records.take(u64::from(name) + 8)?);
    let record = [&[CHUNK][..], &length.to_le_bytes(), &head].concat();
    // What is left of the record after the head; a forged length may be shorter than the head.
    let rest = length.checked_sub(record.len() as u64 - RECORD_HEAD).ok_or(Stop::Damaged(begin))?;
    let head = match chunk_head(&record) {
        Some(Ok(head)) if head.packed_length <= rest => head,
        Some(Err(problem)) => {
            outer.note(format!("the chunk at byte {begin} is left out: {problem}"));
            return records.skip(rest);
        }
        _ => return Err(Stop::Damaged(begin)),
    };
    if head.compression == Compression::None {
        // The messages can be read where they are, also from a chunk that the recorder could not finish.
        let end = records.end;
        records.end = end.min(records.at + head.packed_length);
        let result = inner(outer, records);
        records.end = end;
        return match result {
            Err(Stop::Truncated(at)) if !truncated => Err(Stop::Damaged(at)),
            result => result,
        };
    }
    if truncated {
        return Err(Stop::Truncated(begin));
    }
    outer.chunk(records, begin, head, |outer, records| inner(outer, records))
}

fn schema(walk: &mut Walk<'_>, mut fields: Fields<'_>) -> Option<()> {
    let (number, name) = (fields.u16()?, fields.text()?);
    walk.schemas.insert(number, name);
    Some(())
}

fn channel(walk: &mut Walk<'_>, mut fields: Fields<'_>) -> Option<()> {
    let (number, schema) = (fields.u16()?, fields.u16()?);
    let (name, encoding) = (fields.text()?, fields.text()?);
    let wire = match encoding.as_str() {
        "cdr" => Some(Wire::Cdr),
        "ros1" => Some(Wire::Ros1),
        _ => None,
    };
    let type_name = walk.schemas.get(&schema).cloned().unwrap_or_default();
    walk.topics.add(walk.file, u32::from(number), &name, &type_name, wire);
    Some(())
}

fn statistics(walk: &mut Walk<'_>, mut fields: Fields<'_>) -> Option<()> {
    if walk.counts {
        return Some(());
    }
    let messages = fields.u64()?;
    fields.take(2 + 4 * 4)?;
    let (first, last) = (fields.u64()?, fields.u64()?);
    if messages > 0 {
        walk.widen_span(to_ns(first), to_ns(last));
    }
    let mut counts = Fields(fields.counted()?);
    while let Some((channel, count)) = counts.u16().zip(counts.u64()) {
        walk.topics.count(walk.file, u32::from(channel), count);
    }
    Some(())
}

fn to_ns(time: u64) -> i64 {
    i64::try_from(time).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With overflow checks, as in the weekly run of all tests, such a sum would be a panic.
    #[test]
    fn a_record_of_the_summary_that_ends_beyond_all_files_is_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mcap");
        let record = |kind: u8, content: &[u8], length: u64| [&[kind][..], &length.to_le_bytes(), content].concat();
        let footer = [(MAGIC.len() as u64).to_le_bytes().to_vec(), vec![0; 12]].concat();
        let bytes = [MAGIC, &record(3, &[0; 40], u64::MAX), &record(FOOTER, &footer, 20), MAGIC].concat();
        std::fs::write(&path, bytes).unwrap();
        assert_eq!(summary_start(&BagFile::open(&path).unwrap()).unwrap(), None);
    }

    /// Sums of such lengths would be small again, so that the chunk would be taken for an empty one.
    #[test]
    fn chunks_that_are_shorter_than_their_head_or_longer_than_their_record_are_damaged() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mcap");
        for (length, name, packed) in [(4u64, "new", 0u64), (43, "new", 0), (40, "", u64::MAX - 5)] {
            let name = [&(name.len() as u32).to_le_bytes(), name.as_bytes()].concat();
            let head = [&[CHUNK][..], &length.to_le_bytes(), &[0; 28], &name, &packed.to_le_bytes()].concat();
            std::fs::write(&path, [MAGIC, &head, &[0; 40]].concat()).unwrap();
            let bag = crate::Bag::open(&path).unwrap();
            let notes = bag.notes().join("; ");
            let expected = if length == 43 { "'new' is not understood" } else { "damaged" };
            assert!(notes.contains(expected), "{length}: {notes}");
        }
    }
}

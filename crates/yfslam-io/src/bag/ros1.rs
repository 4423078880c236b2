//! The bag of ROS 1, version 2.0: records of a head, which is a list of `name=value`, and their data, each with its length before it.

use super::compression::Compression;
use super::fields::Fields;
use super::file::BagFile;
use super::walk::{ChunkHead, Records, Source, Stop, Walk};
use crate::error::Result;
use crate::message::wire::Wire;

pub const MAGIC: &[u8] = b"#ROSBAG V2.0\n";

const MESSAGE: u8 = 2;
const CHUNK: u8 = 5;
const CHUNK_INFO: u8 = 6;
const CONNECTION: u8 = 7;

/// Longest head of a record, and longest description of a connection, bytes.
const MAX_HEAD: u64 = 1 << 20;
const MAX_DESCRIPTION: u64 = 64 << 20;

/// Returns where the connections are listed after the chunks; `None` if the recorder did not come to write it.
pub fn summary_start(file: &BagFile) -> Result<Option<u64>> {
    let mut bytes = Vec::new();
    file.read_at(0, file.length().min(4096), &mut bytes)?;
    let start = bytes.get(MAGIC.len()..).and_then(|rest| Head::of(&mut Fields(rest))?.fields("index_pos")?.u64());
    Ok(start.filter(|start| (MAGIC.len() as u64..file.length()).contains(start)))
}

/// Reads the head of the chunk whose record begins `bytes`; an error says which compression is not understood.
pub fn chunk_head(bytes: &[u8]) -> Option<std::result::Result<ChunkHead, String>> {
    let mut fields = Fields(bytes);
    let head = Head::of(&mut fields)?;
    let packed_length = u64::from(fields.u32()?);
    let data_offset = (bytes.len() - fields.0.len()) as u64;
    chunk_of(head, data_offset, packed_length)
}

fn chunk_of(head: Head<'_>, data_offset: u64, packed_length: u64) -> Option<std::result::Result<ChunkHead, String>> {
    if head.kind()? != CHUNK {
        return None;
    }
    let unpacked_length = u64::from(head.fields("size")?.u32()?);
    let name = String::from_utf8_lossy(head.fields("compression")?.0);
    let chunk = |compression| ChunkHead { compression, data_offset, packed_length, unpacked_length };
    Some(Compression::of(&name).map(chunk).ok_or(format!("its compression '{name}' is not understood")))
}

/// Goes through the records of a file.
pub fn walk<R: Source>(walk: &mut Walk<'_>, records: &mut Records<R>) -> std::result::Result<(), Stop> {
    if records.at == 0 {
        records.skip(MAGIC.len() as u64)?;
    }
    while records.left() > 0 {
        record(walk, records, true)?;
    }
    Ok(())
}

/// Reads the next record; chunks are in the file only.
fn record<R: Source>(walk: &mut Walk<'_>, records: &mut Records<R>, in_file: bool) -> std::result::Result<(), Stop> {
    let begin = records.at;
    let truncated = Stop::Truncated(begin);
    let Some(head_length) = Fields(records.take(4.min(records.left()))?).u32() else { return Err(truncated) };
    if u64::from(head_length) > MAX_HEAD {
        return Err(Stop::Damaged(begin));
    }
    let bytes = records.take(u64::from(head_length))?.to_vec();
    let Some(length) = Fields(records.take(4.min(records.left()))?).u32() else { return Err(truncated) };
    let (head, length) = (Head(&bytes), u64::from(length));
    let is_complete = length <= records.left();
    match head.kind().ok_or(Stop::Damaged(begin))? {
        CHUNK if in_file => return chunk(walk, records, begin, head, length),
        _ if !is_complete => return Err(truncated),
        MESSAGE => {
            let connection = head.fields("conn").and_then(|mut field| field.u32());
            let time = head.fields("time").and_then(|mut field| field.ros1_time_ns());
            let (connection, time) = connection.zip(time).ok_or(Stop::Damaged(begin))?;
            return walk.message(records, connection, time, length);
        }
        CONNECTION if length <= MAX_DESCRIPTION => {
            let data = Head(records.take(length)?);
            let connection = head.fields("conn").and_then(|mut field| field.u32()).ok_or(Stop::Damaged(begin))?;
            let text = |head: Head<'_>, name| head.fields(name).map(|f| String::from_utf8_lossy(f.0).into_owned());
            let name = text(head, "topic").or_else(|| text(data, "topic")).unwrap_or_default();
            let type_name = text(data, "type").unwrap_or_default();
            walk.topics.add(walk.file, connection, &name, &type_name, Some(Wire::Ros1));
        }
        CHUNK_INFO if !walk.counts && length <= MAX_DESCRIPTION => {
            let time = |name| head.fields(name).and_then(|mut field| field.ros1_time_ns());
            if let Some((first, last)) = time("start_time").zip(time("end_time")) {
                walk.widen_span(first, last);
            }
            let mut counts = Fields(records.take(length)?);
            while let Some((connection, count)) = counts.u32().zip(counts.u32()) {
                walk.topics.count(walk.file, connection, u64::from(count));
            }
        }
        _ => records.skip(length)?,
    }
    Ok(())
}

fn chunk<R: Source>(
    outer: &mut Walk<'_>,
    records: &mut Records<R>,
    begin: u64,
    head: Head<'_>,
    length: u64,
) -> std::result::Result<(), Stop> {
    let is_complete = length <= records.left();
    match chunk_of(head, records.at - begin, length).ok_or(Stop::Damaged(begin))? {
        Err(problem) => {
            outer.note(format!("the chunk at byte {begin} is left out: {problem}"));
            records.skip(length)
        }
        Ok(chunk) if chunk.compression == Compression::None => {
            // The messages can be read where they are, also from a chunk that the recorder could not finish.
            let end = records.end;
            records.end = end.min(records.at + length);
            let result = inner(outer, records);
            records.end = end;
            match result {
                Err(Stop::Truncated(at)) if is_complete => Err(Stop::Damaged(at)),
                Ok(()) if !is_complete => Err(Stop::Truncated(end)),
                result => result,
            }
        }
        Ok(_) if !is_complete => Err(Stop::Truncated(begin)),
        Ok(chunk) => outer.chunk(records, begin, chunk, |outer, records| inner(outer, records)),
    }
}

/// Goes through the records of a chunk.
fn inner<R: Source>(walk: &mut Walk<'_>, records: &mut Records<R>) -> std::result::Result<(), Stop> {
    while records.left() > 0 {
        record(walk, records, false)?;
    }
    Ok(())
}

/// The head of a record: fields, each with its length before it.
#[derive(Clone, Copy)]
struct Head<'a>(&'a [u8]);

impl<'a> Head<'a> {
    /// Takes a head with its length.
    fn of(fields: &mut Fields<'a>) -> Option<Self> {
        fields.counted().map(Self)
    }

    /// Returns the value of a field.
    fn fields(self, name: &str) -> Option<Fields<'a>> {
        let mut rest = Fields(self.0);
        while let Some(field) = rest.counted() {
            let value = field.strip_prefix(name.as_bytes()).and_then(|rest| rest.strip_prefix(b"="));
            if let Some(value) = value {
                return Some(Fields(value));
            }
        }
        None
    }

    fn kind(self) -> Option<u8> {
        self.fields("op")?.u8()
    }
}

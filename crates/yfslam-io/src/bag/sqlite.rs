//! Reads the rows of the tables of an SQLite file (the file format at sqlite.org/fileformat.html): B-trees of tables, records, overflow pages.
//!
//! In: a file. Out: its tables, and their rows in the order of their numbers. Rows that are still in a write-ahead log are not read.

use super::compression::MAX_UNPACKED_BYTES;
use super::file::BagFile;
use super::walk::Stop;

pub const MAGIC: &[u8] = b"SQLite format 3\0";

/// Bytes of the head of the file, on its first page.
const FILE_HEAD: usize = 100;
const LEAF: u8 = 13;
const INTERIOR: u8 = 5;
/// Longest two variable-length numbers before a payload, bytes.
const CELL_HEAD: u64 = 18;
/// Pages that are read at once where they follow each other.
const PAGES_AT_ONCE: u64 = 64;

/// An SQLite file.
pub struct Database<'a> {
    file: &'a BagFile,
    page_size: u64,
    /// Bytes of a page that hold content.
    usable: u64,
}

/// A row of a table.
pub struct Row {
    pub number: i64,
    /// Where it begins in the file, for [`Database::payload`].
    pub at: u64,
    pub payload_length: u64,
    /// The begin of the payload.
    pub local: Vec<u8>,
}

/// A value of a record: its type, and where it is in the payload.
#[derive(Clone, Copy)]
pub struct Value {
    kind: u64,
    pub offset: u64,
    pub length: u64,
}

impl<'a> Database<'a> {
    pub fn open(file: &'a BagFile) -> Option<Self> {
        let mut head = Vec::new();
        file.read_at(0, FILE_HEAD as u64, &mut head).ok()?;
        let page_size = match u16::from_be_bytes(*head.get(16..)?.first_chunk()?) {
            1 => 65_536,
            size => u64::from(size),
        };
        let reserved = u64::from(*head.get(20)?);
        let is_valid = page_size.is_power_of_two() && page_size >= 512 && page_size - reserved >= 480;
        is_valid.then(|| Self { file, page_size, usable: page_size - reserved })
    }

    /// Returns the first page of a table and the names of its columns.
    pub fn table(&self, name: &str) -> Option<(u64, Vec<String>)> {
        let mut found = None;
        let mut schema = |row: Row| -> Result<(), Stop> {
            let Some(payload) = self.payload(row.at, row.payload_length.min(1 << 16)) else { return Ok(()) };
            let columns = columns(&payload).unwrap_or_default();
            let text = |index: usize| columns.get(index).and_then(|value| value.text(&payload));
            if text(0).as_deref() == Some("table") && text(1).as_deref() == Some(name) {
                let root =
                    columns.get(3).and_then(|value| value.integer(&payload)).and_then(|root| u64::try_from(root).ok());
                found = root.zip(text(4).map(|sql| column_names(&sql)));
            }
            Ok(())
        };
        self.rows(1, &mut schema).ok()?;
        found
    }

    /// Visits the rows of the table whose first page is `root`.
    pub fn rows(&self, root: u64, visit: &mut dyn FnMut(Row) -> Result<(), Stop>) -> Result<(), Stop> {
        // Each page belongs to one table once; a forged file may say otherwise.
        let mut pages_left = self.file.length() / self.page_size;
        let (mut stack, mut page) = (vec![root], Vec::new());
        while let Some(number) = stack.pop() {
            let begin =
                number.checked_sub(1).and_then(|index| index.checked_mul(self.page_size)).ok_or(Stop::Damaged(0))?;
            pages_left = pages_left.checked_sub(1).ok_or(Stop::Damaged(begin))?;
            if self.file.read_at(begin, self.page_size, &mut page).is_err() {
                return Err(Stop::Truncated(begin));
            }
            let head = if number == 1 { FILE_HEAD } else { 0 };
            self.page(&page, head, begin, &mut stack, visit)?;
        }
        Ok(())
    }

    fn page(
        &self,
        page: &[u8],
        head: usize,
        begin: u64,
        stack: &mut Vec<u64>,
        visit: &mut dyn FnMut(Row) -> Result<(), Stop>,
    ) -> Result<(), Stop> {
        let damaged = || Stop::Damaged(begin);
        let u16_at = |at: usize| Some(usize::from(u16::from_be_bytes(*page.get(at..)?.first_chunk()?)));
        let u32_at = |at: usize| Some(u64::from(u32::from_be_bytes(*page.get(at..)?.first_chunk()?)));
        let kind = *page.get(head).ok_or_else(damaged)?;
        let cells = u16_at(head + 3).ok_or_else(damaged)?;
        let pointers = head + if kind == INTERIOR { 12 } else { 8 };
        let cell = |index: usize| u16_at(pointers + 2 * index);
        match kind {
            INTERIOR => {
                stack.push(u32_at(head + 8).ok_or_else(damaged)?);
                for index in (0..cells).rev() {
                    stack.push(cell(index).and_then(u32_at).ok_or_else(damaged)?);
                }
            }
            LEAF => {
                for index in 0..cells {
                    let at = cell(index).ok_or_else(damaged)?;
                    let bytes = page.get(at..).ok_or_else(damaged)?;
                    let (payload_length, rest) = varint(bytes).ok_or_else(damaged)?;
                    let (number, rest) = varint(rest).ok_or_else(damaged)?;
                    let local = self.local(payload_length).min(rest.len() as u64) as usize;
                    let local = rest.get(..local).unwrap_or(rest).to_vec();
                    visit(Row { number: number.cast_signed(), at: begin + at as u64, payload_length, local })?;
                }
            }
            _ => return Err(damaged()),
        }
        Ok(())
    }

    /// Returns how many bytes of a payload are on the page of its row.
    fn local(&self, payload_length: u64) -> u64 {
        let most = self.usable - 35;
        if payload_length <= most {
            return payload_length;
        }
        let least = (self.usable - 12) * 32 / 255 - 23;
        let fitting = least + (payload_length - least) % (self.usable - 4);
        if fitting <= most { fitting } else { least }
    }

    /// Reads up to `wanted` bytes of the payload of the row that begins at this byte.
    pub fn payload(&self, at: u64, wanted: u64) -> Option<Vec<u8>> {
        let mut bytes = Vec::new();
        let head = CELL_HEAD.min(self.file.length().checked_sub(at)?);
        self.file.read_at(at, head, &mut bytes).ok()?;
        let (length, rest) = varint(&bytes)?;
        let (_, rest) = varint(rest)?;
        let begin = at + (bytes.len() - rest.len()) as u64;
        let wanted = wanted.min(length);
        if wanted > MAX_UNPACKED_BYTES || wanted > self.file.length() {
            return None;
        }
        let local = self.local(length);
        let has_more = local < length;
        self.file.read_at(begin, local + if has_more { 4 } else { 0 }, &mut bytes).ok()?;
        let mut next = if has_more { u64::from(u32::from_be_bytes(*bytes.last_chunk()?)) } else { 0 };
        bytes.truncate(local as usize);
        let mut payload = bytes;
        let per_page = self.usable - 4;
        let mut block = Vec::new();
        while (payload.len() as u64) < wanted {
            let first = next;
            let begin = first.checked_sub(1)?.checked_mul(self.page_size)?;
            let needed = (wanted - payload.len() as u64).div_ceil(per_page);
            let in_file = self.file.length().checked_sub(begin)? / self.page_size;
            let pages = needed.min(in_file).min(PAGES_AT_ONCE);
            self.file.read_at(begin, pages.max(1) * self.page_size, &mut block).ok()?;
            for (page, number) in block.chunks(self.page_size as usize).zip(first..) {
                // The chain may leave the pages that follow each other.
                if number != next || payload.len() as u64 >= wanted {
                    break;
                }
                next = u64::from(u32::from_be_bytes(*page.first_chunk()?));
                let take = (length - payload.len() as u64).min(per_page) as usize;
                payload.extend(page.get(4..4 + take)?);
            }
        }
        payload.truncate(wanted as usize);
        Some(payload)
    }
}

impl Value {
    pub fn integer(self, payload: &[u8]) -> Option<i64> {
        match self.kind {
            8 => return Some(0),
            9 => return Some(1),
            1..=6 => {}
            _ => return None,
        }
        let bytes = payload.get(self.offset as usize..)?.get(..self.length as usize)?;
        let is_negative = bytes.first().is_some_and(|byte| *byte >= 128);
        Some(bytes.iter().fold(if is_negative { -1 } else { 0 }, |value, byte| value << 8 | i64::from(*byte)))
    }

    pub fn is_blob(self) -> bool {
        self.kind >= 12 && self.kind.is_multiple_of(2)
    }

    pub fn text(self, payload: &[u8]) -> Option<String> {
        let bytes = payload.get(self.offset as usize..)?.get(..self.length as usize)?;
        (self.kind >= 13 && self.kind % 2 == 1).then(|| String::from_utf8_lossy(bytes).into_owned())
    }
}

/// Reads the head of a record.
pub fn columns(payload: &[u8]) -> Option<Vec<Value>> {
    let (head_length, rest) = varint(payload)?;
    let first = payload.len() - rest.len();
    let mut rest = payload.get(first..usize::try_from(head_length).ok()?)?;
    let (mut offset, mut columns) = (head_length, Vec::new());
    while !rest.is_empty() {
        let (kind, after) = varint(rest)?;
        rest = after;
        let length = match kind {
            1..=4 => kind,
            5 => 6,
            6 | 7 => 8,
            12.. => (kind - 12) / 2,
            _ => 0,
        };
        columns.push(Value { kind, offset, length });
        offset = offset.checked_add(length)?;
    }
    Some(columns)
}

/// Reads a number of up to nine bytes, seven bits in each of the first eight.
fn varint(bytes: &[u8]) -> Option<(u64, &[u8])> {
    let mut value = 0;
    for (index, &byte) in bytes.iter().take(9).enumerate() {
        let rest = bytes.get(index + 1..)?;
        if index == 8 {
            return Some((value << 8 | u64::from(byte), rest));
        }
        value = value << 7 | u64::from(byte & 127);
        if byte < 128 {
            return Some((value, rest));
        }
    }
    None
}

/// Returns the names of the columns in a `CREATE TABLE` without nested parentheses.
fn column_names(sql: &str) -> Vec<String> {
    let inside = sql.split_once('(').map_or("", |(_, rest)| rest);
    let name = |column: &str| {
        column.split_whitespace().next().unwrap_or("").trim_matches(['"', '`', '[', ']', '\'']).to_lowercase()
    };
    inside.split(',').map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With overflow checks, as in the weekly run of all tests, such a difference would be a panic.
    #[test]
    fn pages_smaller_than_what_is_reserved_of_them_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.db3");
        for (size, reserved, is_valid) in [(0u16, 200, false), (3, 4, false), (512, 200, false), (512, 0, true)] {
            let mut bytes = vec![0; 512];
            bytes[..16].copy_from_slice(b"SQLite format 3\0");
            bytes[16..18].copy_from_slice(&size.to_be_bytes());
            bytes[20] = reserved;
            std::fs::write(&path, bytes).unwrap();
            let file = BagFile::open(&path).unwrap();
            assert_eq!(Database::open(&file).is_some(), is_valid, "{size} {reserved}");
        }
    }
}

//! Text in the encodings that camera files come in: UTF-8, UTF-16 with a byte-order mark, and single bytes (Latin-1), which occur in
//! comments.

use std::path::Path;

use crate::error::{Error, Result};
use crate::text::read_bytes;

/// Largest camera file, bytes.
const MAX_BYTES: usize = 8 << 20;

/// Reads a text file, without its byte-order mark.
///
/// # Errors
/// The file cannot be read, is no text or is larger than 8 MiB.
pub fn read_any_text(path: &Path) -> Result<String> {
    let mut bytes = Vec::new();
    read_bytes(path, &mut bytes).map_err(|source| Error::read(path, source))?;
    let refuse = |problem: &str| Err(Error::content(path, problem, "give a camera file, which is a short text"));
    if bytes.len() > MAX_BYTES {
        return refuse("is larger than 8 MiB");
    }
    let text = decode(&bytes);
    if text.contains('\0') { refuse("is no text") } else { Ok(text) }
}

fn decode(bytes: &[u8]) -> String {
    let utf16 = |order: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = bytes.as_chunks::<2>().0.iter().map(|pair| order(*pair)).collect();
        String::from_utf16_lossy(&units)
    };
    let text = match bytes {
        [0xff, 0xfe, ..] => utf16(u16::from_le_bytes),
        [0xfe, 0xff, ..] => utf16(u16::from_be_bytes),
        _ => std::str::from_utf8(bytes)
            .map_or_else(|_| bytes.iter().map(|&byte| char::from(byte)).collect(), str::to_owned),
    };
    text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text)
}

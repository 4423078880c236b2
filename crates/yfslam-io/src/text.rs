//! Reads regular files whole, and text files as numbered lines without comments, blank lines, byte-order mark and CRLF.

use std::fs::{self, File};
use std::io::Read;
use std::path::Path;

use crate::error::{Error, Result};

/// Largest file that is read, bytes: enough for a day of poses at 30 Hz or a 60-megapixel PNG, and a bound for endless devices.
pub const MAX_FILE_BYTES: u64 = 400 << 20;
/// The same for maps, bytes; a dense map of a day can be large.
const MAX_MAP_BYTES: u64 = 64 << 30;

/// Reads a whole regular file into `bytes` and drops their old content.
pub fn read_bytes(path: &Path, bytes: &mut Vec<u8>) -> std::io::Result<()> {
    read_at_most(path, MAX_FILE_BYTES, bytes)
}

/// Reads a whole regular file, such as a network or a map. Devices and pipes, which may never end, are refused.
///
/// # Errors
/// [`Error::Read`], also for what is not a regular file or is larger than 64 GiB.
pub fn read_file(path: &Path) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    read_at_most(path, MAX_MAP_BYTES, &mut bytes).map_err(|source| Error::read(path, source))?;
    Ok(bytes)
}

fn read_at_most(path: &Path, max_bytes: u64, bytes: &mut Vec<u8>) -> std::io::Result<()> {
    bytes.clear();
    let metadata = fs::metadata(path)?;
    if metadata.is_dir() {
        return Err(std::io::ErrorKind::IsADirectory.into());
    }
    if !metadata.is_file() || metadata.len() > max_bytes {
        return Err(std::io::Error::other(format!("not a regular file of at most {} MiB", max_bytes >> 20)));
    }
    File::open(path)?.take(max_bytes).read_to_end(bytes)?;
    Ok(())
}

/// Reads a UTF-8 text file.
pub fn read_text(path: &Path) -> Result<String> {
    let mut bytes = Vec::new();
    read_bytes(path, &mut bytes).map_err(|source| Error::read(path, source))?;
    String::from_utf8(bytes).map_err(|error| {
        let offset = error.utf8_error().valid_up_to();
        Error::content(path, format!("is not UTF-8 text (byte {offset})"), "save it as UTF-8 text")
    })
}

/// Returns the non-empty lines, trimmed, with their numbers from 1. Lines that start with `#` are comments.
pub fn content_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let numbered = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
    numbered.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_blank_lines_bom_and_crlf_are_skipped_and_numbers_kept() {
        let text = "\u{feff}# head\r\n\r\n 1\ta \r\n#x\r\n2 b";
        assert_eq!(content_lines(text).collect::<Vec<_>>(), [(3, "1\ta"), (5, "2 b")]);
    }

    #[test]
    fn a_folder_or_a_device_is_not_read_as_a_file() {
        let mut bytes = Vec::new();
        assert!(read_bytes(Path::new("/dev/zero"), &mut bytes).is_err());
        assert!(read_bytes(Path::new("/"), &mut bytes).is_err());
        let error = read_file(Path::new("/dev/zero")).unwrap_err().to_string();
        assert!(error.contains("/dev/zero") && error.contains("not a regular file"), "{error}");
    }
}

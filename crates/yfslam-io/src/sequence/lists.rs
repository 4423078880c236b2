//! The lists of the TUM RGB-D benchmark: `rgb.txt` and `depth.txt` (`stamp file`), `associations.txt` (`stamp file stamp file`).

use std::path::{Path, PathBuf};

use super::csv::exponent_of;
use crate::error::{Error, Result};
use crate::text::content_lines;
use crate::time::parse_stamp_ns;

/// One image file of a list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ListedFile {
    /// Time stamp, ns.
    pub stamp_ns: i64,
    /// Path relative to the folder of the list.
    pub path: PathBuf,
}

/// Entries of a list, and the number of lines that were skipped because their stamp is `nan`.
pub type Listed<T> = (Vec<T>, usize);

/// Parses lines `stamp file`; the file name may contain blanks.
///
/// # Errors
/// A malformed line, named by number and `source`.
pub fn parse_file_list(text: &str, source: &Path) -> Result<Listed<ListedFile>> {
    let (mut files, mut unstamped) = (Vec::new(), 0);
    for (number, line) in content_lines(text) {
        let Some((stamp, name)) = line.split_once(char::is_whitespace) else {
            let problem = format!("'{line}' has one column");
            return Err(Error::line(
                source,
                number,
                problem,
                "write 'stamp file', such as '1305031102.175304 rgb/1.png'",
            ));
        };
        match listed_file(stamp, name.trim(), source, number)? {
            Some(file) => files.push(file),
            None => unstamped += 1,
        }
    }
    Ok((files, unstamped))
}

/// Parses lines `stamp file stamp file` into pairs in the order of the columns.
///
/// # Errors
/// A malformed line, named by number and `source`.
pub fn parse_pair_list(text: &str, source: &Path) -> Result<Listed<[ListedFile; 2]>> {
    let (mut pairs, mut unstamped) = (Vec::new(), 0);
    for (number, line) in content_lines(text) {
        let columns: Vec<&str> = line.split_whitespace().collect();
        let [stamp_a, name_a, stamp_b, name_b] = columns[..] else {
            let problem = format!("'{line}' has {} columns, not 4", columns.len());
            return Err(Error::line(source, number, problem, "write 'stamp rgb-file stamp depth-file'"));
        };
        match (listed_file(stamp_a, name_a, source, number)?, listed_file(stamp_b, name_b, source, number)?) {
            (Some(a), Some(b)) => pairs.push([a, b]),
            _ => unstamped += 1,
        }
    }
    Ok((pairs, unstamped))
}

/// Returns the entry, or `None` if its stamp is `nan`.
fn listed_file(stamp: &str, name: &str, source: &Path, line: usize) -> Result<Option<ListedFile>> {
    if stamp.eq_ignore_ascii_case("nan") {
        return Ok(None);
    }
    // Numbers that are too large for seconds are in milli-, micro- or nanoseconds.
    let parsed = match exponent_of(stamp) {
        0 => parse_stamp_ns(stamp),
        exponent => parse_stamp_ns(&format!("{stamp}e{exponent}")),
    };
    let stamp_ns = parsed.map_err(|error| {
        Error::line(
            source,
            line,
            format!("stamp '{stamp}' {error}"),
            "write stamps as decimal seconds, such as 1305031102.175304",
        )
    })?;
    Ok(Some(ListedFile { stamp_ns, path: name.into() }))
}

/// Decides from names such as `depth/…` and `rgb/…` whether the second column is the colour image; `None` if they do not show it.
pub fn color_is_second(pairs: &[[ListedFile; 2]]) -> Option<bool> {
    pairs.iter().find_map(|[a, b]| match (names_depth(&a.path), names_depth(&b.path)) {
        (Some(a), Some(b)) if a == b => None,
        (Some(first_is_depth), _) => Some(first_is_depth),
        (None, Some(second_is_depth)) => Some(!second_is_depth),
        (None, None) => None,
    })
}

/// Returns whether the words in the path name a depth image or a colour image; `None` for neither.
pub(super) fn names_depth(path: &Path) -> Option<bool> {
    let name = path.to_string_lossy().to_lowercase();
    if name.contains("depth") {
        return Some(true);
    }
    ["rgb", "color", "colour", "image"].iter().any(|word| name.contains(word)).then_some(false)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn list(text: &str) -> Result<Vec<ListedFile>> {
        Ok(parse_file_list(text, Path::new("rgb.txt"))?.0)
    }

    fn pairs(text: &str) -> Result<Vec<[ListedFile; 2]>> {
        Ok(parse_pair_list(text, Path::new("associations.txt"))?.0)
    }

    #[test]
    fn lines_without_a_time_are_skipped_and_counted() {
        let path = Path::new("a.txt");
        let (files, unstamped) = parse_file_list("1 a\nnan b\nNaN c\n2 d\n", path).unwrap();
        assert_eq!((files.len(), unstamped), (2, 2));
        let (pairs, unstamped) = parse_pair_list("1 a 1 b\nnan c 2 d\n2 e nan f\n", path).unwrap();
        assert_eq!((pairs.len(), unstamped), (1, 2));
    }

    #[test]
    fn a_list_tolerates_comments_crlf_tabs_and_blanks_in_names() {
        let files = list("# color images\r\n\r\n1.5\trgb/1.png\r\n  2.25   rgb/my file.png  \r\n").unwrap();
        assert_eq!(files[0], ListedFile { stamp_ns: 1_500_000_000, path: "rgb/1.png".into() });
        assert_eq!(files[1], ListedFile { stamp_ns: 2_250_000_000, path: "rgb/my file.png".into() });
    }

    #[test]
    fn a_malformed_line_is_named_with_its_number_and_value() {
        let error = list("1.0 a.png\n# x\nnot-a-number b.png\n").unwrap_err().to_string();
        assert!(error.contains("rgb.txt:3") && error.contains("not-a-number"), "{error}");
        let error = list("1.0\n").unwrap_err().to_string();
        assert!(error.contains("rgb.txt:1") && error.contains("one column"), "{error}");
        let error = pairs("1 a 2\n").unwrap_err().to_string();
        assert!(error.contains("associations.txt:1") && error.contains("3 columns"), "{error}");
    }

    #[test]
    fn stamps_that_are_too_large_for_seconds_are_in_smaller_units() {
        let text = "1305031102175304001 a.png\n1305031102275304 b.png\n1305031102375 c.png\n1305031103.5 d.png\n";
        let stamps: Vec<i64> = list(text).unwrap().iter().map(|file| file.stamp_ns).collect();
        let second = 1_305_031_102_000_000_000;
        assert_eq!(stamps, [175_304_001, 275_304_000, 375_000_000, 1_500_000_000].map(|ns| second + ns));
    }

    #[test]
    fn the_colour_column_is_found_by_the_names() {
        assert_eq!(color_is_second(&pairs("1 rgb/1.png 1 depth/1.png").unwrap()), Some(false));
        assert_eq!(color_is_second(&pairs("1 depth/1.png 1 rgb/1.png").unwrap()), Some(true));
        assert_eq!(color_is_second(&pairs("1 a.png 1 b_depth.png").unwrap()), Some(false));
        assert_eq!(color_is_second(&pairs("1 a.png 1 COLOR/b.png").unwrap()), Some(true));
        assert_eq!(color_is_second(&pairs("1 a.png 1 b.png").unwrap()), None);
        assert_eq!(color_is_second(&pairs("1 rgbd/depth/1.png 1 rgbd/rgb/1.png").unwrap()), Some(true));
    }

    proptest! {
        #[test]
        fn lists_of_arbitrary_text_never_panic(text in "([0-9. \t\r\n#a-z/-]|.){0,200}") {
            let _ = list(&text);
            let _ = pairs(&text).map(|pairs| color_is_second(&pairs));
        }
    }
}

//! The images of a folder without a list: their order and their times come from their names.
//!
//! In: a folder. Out: its image files, with the number or the time stamp that their names hold.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use yfslam::{DepthImage, RgbImage};

use super::ImageRef;
use super::lists::ListedFile;
use crate::decode::{DecodeError, decode_color, decode_depth_image};
use crate::error::{Error, Result};
use crate::time::parse_stamp_ns;

/// Endings of the image files that are read, in lower case.
pub const IMAGE_ENDINGS: [&str; 10] = ["png", "jpg", "jpeg", "pgm", "ppm", "pnm", "tif", "tiff", "npy", "exr"];

/// Digits of a frame number; longer ones are time stamps or identifiers.
const MAX_NUMBER_DIGITS: usize = 9;

/// An image file and what its name holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedImage {
    /// The file, an absolute path.
    pub path: PathBuf,
    /// The last number in its name, such as 12 in `frame-000012.color.png`.
    pub number: Option<u64>,
}

/// Returns whether the name ends like an image that is read.
pub fn is_image(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    ending.is_some_and(|ending| IMAGE_ENDINGS.contains(&ending.as_str()))
}

/// Returns the images of `folder` whose names `wanted` accepts, in the order of their numbers, else of their names.
///
/// # Errors
/// The folder cannot be read.
pub fn images_in(folder: &Path, wanted: impl Fn(&str) -> bool) -> Result<Vec<NamedImage>> {
    let entries = std::fs::read_dir(folder).map_err(|source| Error::read(folder, source))?;
    // The folder need not be inside that of the sequence, to which relative paths would belong.
    let folder = std::path::absolute(folder).map_err(|source| Error::read(folder, source))?;
    let named = |path: &Path| path.file_name().is_some_and(|name| wanted(&name.to_string_lossy()));
    let mut images: Vec<NamedImage> = entries
        .flatten()
        .map(|entry| folder.join(entry.file_name()))
        .filter(|path| is_image(path) && named(path) && path.is_file())
        .map(|path| NamedImage { number: number(&stem(&path)), path })
        .collect();
    images.sort_by(|a, b| (a.number, &a.path).cmp(&(b.number, &b.path)));
    Ok(images)
}

/// Returns the width and height of a colour image.
///
/// # Errors
/// It cannot be read or decoded.
pub fn color_size(image: &ImageRef) -> Result<[usize; 2]> {
    let (mut bytes, mut color) = (Vec::new(), RgbImage::default());
    image.read(&mut bytes)?;
    decode_color(&bytes, None, &mut color).map_err(|error| unusable(image, &error))?;
    Ok([color.width(), color.height()])
}

/// Returns the width and height of a depth image.
///
/// # Errors
/// It cannot be read or decoded.
pub fn depth_size(image: &ImageRef) -> Result<[usize; 2]> {
    let (mut bytes, mut depth) = (Vec::new(), DepthImage::default());
    image.read(&mut bytes)?;
    decode_depth_image(&bytes, None, 1.0, &mut depth).map_err(|error| unusable(image, &error))?;
    Ok([depth.raw.width(), depth.raw.height()])
}

fn unusable(image: &ImageRef, error: &DecodeError) -> Error {
    let path = image.file().unwrap_or(Path::new("the first image"));
    Error::content(path, error.to_string(), "unpack the sequence again, or give --camera")
}

/// Returns the name without its ending.
fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}

/// Returns the last number in a name.
fn number(stem: &str) -> Option<u64> {
    let last = stem.split(|c: char| !c.is_ascii_digit()).rfind(|digits| !digits.is_empty())?;
    last.parse().ok().filter(|_| last.trim_start_matches('0').len() <= MAX_NUMBER_DIGITS)
}

/// Returns the images as a list if all their names are time stamps.
pub fn stamped(images: &[NamedImage]) -> Option<Vec<ListedFile>> {
    let file =
        |image: &NamedImage| Some(ListedFile { stamp_ns: stamp_ns(&stem(&image.path))?, path: image.path.clone() });
    let mut files: Vec<ListedFile> = images.iter().map(file).collect::<Option<_>>()?;
    files.sort_by_key(|file| file.stamp_ns);
    Some(files).filter(|files| !files.is_empty())
}

/// Returns the time that a name such as `1305031102.175304` or `1305031102175304000` holds.
fn stamp_ns(stem: &str) -> Option<i64> {
    let is_number = stem.chars().all(|c| c.is_ascii_digit() || c == '.');
    if !is_number {
        return None;
    }
    let text = match (stem.contains('.'), stem.trim_start_matches('0').len()) {
        (true, _) => stem.to_owned(),
        (false, 13) => format!("{stem}e-3"),
        (false, 16) => format!("{stem}e-6"),
        (false, 19) => format!("{stem}e-9"),
        _ => return None,
    };
    parse_stamp_ns(&text).ok()
}

/// Gives images without time stamps the time of their number at `fps` frames per second, the first at 0; without numbers, or with
/// repeated ones, the time of their place in the order.
pub fn numbered(images: &[NamedImage], first: Option<u64>, fps: f64) -> Vec<ListedFile> {
    let numbers: Option<Vec<u64>> = images.iter().map(|image| image.number).collect();
    let ascend = |numbers: &Vec<u64>| numbers.windows(2).all(|pair| pair.first() < pair.last());
    let numbers = numbers.filter(ascend).unwrap_or_else(|| (0..images.len() as u64).collect());
    let first = first.or(numbers.first().copied()).unwrap_or(0);
    let time = |number: u64| (number.saturating_sub(first) as f64 / fps * 1e9).round() as i64;
    let files = images.iter().zip(numbers);
    files.map(|(image, number)| ListedFile { stamp_ns: time(number), path: image.path.clone() }).collect()
}

/// Returns the images of both lists that have the same number; `None` if a number is missing or occurs twice, or none is common.
pub fn common(a: &[NamedImage], b: &[NamedImage]) -> Option<(Vec<NamedImage>, Vec<NamedImage>)> {
    let by_number = |images: &[NamedImage]| {
        let map: BTreeMap<u64, NamedImage> =
            images.iter().map(|image| Some((image.number?, image.clone()))).collect::<Option<_>>()?;
        (map.len() == images.len()).then_some(map)
    };
    let (a, b) = (by_number(a)?, by_number(b)?);
    let pairs: Vec<_> = a.into_iter().filter_map(|(number, a)| Some((a, b.get(&number)?.clone()))).collect();
    (!pairs.is_empty()).then(|| pairs.into_iter().unzip())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn images(names: &[&str]) -> Vec<NamedImage> {
        names.iter().map(|name| NamedImage { number: number(&stem(Path::new(name))), path: name.into() }).collect()
    }

    fn stamps(files: Vec<ListedFile>) -> Vec<i64> {
        files.iter().map(|file| file.stamp_ns).collect()
    }

    #[test]
    fn the_last_number_of_a_name_is_its_frame_number() {
        for (name, expected) in [
            ("frame-000012.color", Some(12)),
            ("depth000007", Some(7)),
            ("cam1_0003_color", Some(3)),
            ("color", None),
            ("1305031102175304", None),
            ("000000000000", Some(0)),
        ] {
            assert_eq!(number(name), expected, "{name}");
        }
    }

    #[test]
    fn names_that_are_times_are_read_in_each_usual_unit() {
        let ns = |names: &[&str]| stamped(&images(names)).map(stamps);
        assert_eq!(
            ns(&["1305031102.175304.png", "1305031102.25.png"]),
            Some(vec![1305031102175304000, 1305031102250000000])
        );
        assert_eq!(ns(&["1305031102175.png"]), Some(vec![1305031102175000000]));
        assert_eq!(ns(&["1305031102175304.png"]), Some(vec![1305031102175304000]));
        assert_eq!(ns(&["1305031102175304123.png"]), Some(vec![1305031102175304123]));
        assert_eq!(ns(&["000001.png"]), None);
        assert_eq!(ns(&["frame-1.5.png"]), None);
        assert_eq!(ns(&[]), None);
    }

    #[test]
    fn numbers_become_times_and_gaps_stay_gaps() {
        assert_eq!(stamps(numbered(&images(&["3.png", "4.png", "7.png"]), None, 10.0)), [0, 100_000_000, 400_000_000]);
        // Without numbers, or with the same number twice, the order counts.
        assert_eq!(stamps(numbered(&images(&["a.png", "b.png"]), None, 10.0)), [0, 100_000_000]);
        assert_eq!(stamps(numbered(&images(&["a1.png", "b1.png"]), None, 10.0)), [0, 100_000_000]);
    }

    #[test]
    fn images_of_the_same_number_belong_together() {
        let (a, b) =
            common(&images(&["c1.png", "c2.png", "c3.png"]), &images(&["d2.png", "d3.png", "d9.png"])).unwrap();
        assert_eq!((a[0].path.to_str(), b[0].path.to_str(), a.len(), b.len()), (Some("c2.png"), Some("d2.png"), 2, 2));
        assert_eq!(common(&images(&["c1.png"]), &images(&["d2.png"])), None);
        assert_eq!(common(&images(&["c.png"]), &images(&["d2.png"])), None);
        assert_eq!(common(&images(&["a1.png", "b1.png"]), &images(&["d1.png"])), None);
    }
}

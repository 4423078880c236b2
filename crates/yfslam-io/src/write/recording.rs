//! A recording in TUM layout, written whole or not at all.
//!
//! In: frames with their numbers, boxes, masks, the true poses. Out: a folder with `rgb/`, `depth/`, `masks/`, their lists,
//! `associations.txt`, `groundtruth.txt`, `camera.toml`, `boxes.json`, which [`Sequence::open`](crate::Sequence::open) reads.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use yfslam::image::Image;
use yfslam::{Camera, RgbdFrame};

use super::Temporary;
use super::png::{encode_color, encode_depth, encode_mask};
use crate::boxes::{BOXES_FILE, BoxList};
use crate::error::{Error, Result};
use crate::time::format_stamp;
use crate::trajectory::{StampedPose, write_trajectory};

/// A recording in the making, in a temporary folder beside its place.
#[derive(Debug)]
pub struct RecordingWriter {
    temporary: Temporary,
    target: PathBuf,
    replace: bool,
    lists: [String; 3],
}

/// Stamps of one frame as the lists say them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ListedStamps {
    /// Time of the colour image, ns; `None` is written as `nan`.
    pub color_ns: Option<i64>,
    /// Time of the depth image, ns.
    pub depth_ns: Option<i64>,
}

impl RecordingWriter {
    /// Begins the recording `target`. A folder that holds something is refused, unless `replace` is set and it is a recording itself.
    ///
    /// # Errors
    /// The folder is in use, or nothing can be written beside it.
    pub fn create(target: &Path, replace: bool) -> Result<Self> {
        let occupied = match fs::read_dir(target) {
            Ok(mut entries) => entries.next().is_some(),
            Err(error) if error.kind() == io::ErrorKind::NotFound => false,
            Err(error) => return Err(Error::write(target, error)),
        };
        if occupied && !replace {
            return Err(Error::content(target, "holds something already", "choose another folder, or give --force"));
        }
        if occupied && !target.join("rgb.txt").is_file() {
            let problem = "is no recording and will not be replaced";
            return Err(Error::content(target, problem, "choose another folder, or remove it by hand"));
        }
        let begin = || {
            let parent = target.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
            fs::create_dir_all(parent)?;
            let temporary = Temporary::create_folder(parent)?;
            for part in ["rgb", "depth", "masks"] {
                fs::create_dir(temporary.path().join(part))?;
            }
            Ok(temporary)
        };
        let temporary = begin().map_err(|error| Error::write(target, error))?;
        let lists = ["# timestamp filename\n", "# timestamp filename\n", "# timestamp rgb timestamp depth\n"];
        Ok(Self { temporary, target: target.into(), replace: occupied, lists: lists.map(str::to_owned) })
    }

    /// Writes the images of delivery `number`; any order, any thread.
    ///
    /// # Errors
    /// A file cannot be written, or an image is empty.
    pub fn write_images(&self, number: usize, frame: &RgbdFrame) -> Result<()> {
        self.write_file(&color_name(number), |file| encode_color(&frame.color, file))?;
        self.write_file(&depth_name(number), |file| encode_depth(&frame.depth.raw, file))
    }

    /// Writes the mask of instances of the frame with this stamp; any order, any thread.
    ///
    /// # Errors
    /// The file cannot be written, or the image is empty.
    pub fn write_mask(&self, timestamp_ns: i64, mask: &Image<u8>) -> Result<()> {
        self.write_file(&format!("masks/{}.png", format_stamp(timestamp_ns)), |file| encode_mask(mask, file))
    }

    /// Lists delivery `number`, after those listed before.
    pub fn list(&mut self, number: usize, stamps: ListedStamps) {
        let text = |stamp: Option<i64>| stamp.map_or("nan".to_owned(), format_stamp);
        let (color, depth) = (text(stamps.color_ns), text(stamps.depth_ns));
        let (color_file, depth_file) = (color_name(number), depth_name(number));
        let [color_list, depth_list, pairs] = &mut self.lists;
        // Writing to a string cannot fail.
        let _ = writeln!(color_list, "{color} {color_file}");
        let _ = writeln!(depth_list, "{depth} {depth_file}");
        let _ = writeln!(pairs, "{color} {color_file} {depth} {depth_file}");
    }

    /// Adds a text file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_text(&self, name: &str, text: &str) -> Result<()> {
        self.write_file(name, |file| file.write_all(text.as_bytes()))
    }

    /// Writes the lists and puts the folder in its place.
    ///
    /// # Errors
    /// A file cannot be written, or the folder cannot be moved to its place.
    pub fn finish(self, camera: &Camera, truth: &[StampedPose], boxes: &BoxList) -> Result<()> {
        let [color, depth, pairs] = &self.lists;
        for (name, text) in [("rgb.txt", color), ("depth.txt", depth), ("associations.txt", pairs)] {
            self.write_text(name, text)?;
        }
        let camera = toml::to_string(camera)
            .map_err(|error| Error::write(&self.target.join("camera.toml"), io::Error::other(error)))?;
        self.write_text("camera.toml", &camera)?;
        write_trajectory(&self.temporary.path().join("groundtruth.txt"), truth)?;
        boxes.write(&self.temporary.path().join(BOXES_FILE))?;
        let Self { temporary, target, replace, .. } = self;
        let fail = |error| Error::write(&target, error);
        // The old recording leaves only once the new one is complete.
        let old = replace.then(|| Temporary::aside(&target)).transpose().map_err(fail)?;
        if let Err(error) = temporary.rename_to(&target) {
            if let Some(old) = old {
                old.rename_to(&target).map_err(fail)?;
            }
            return Err(fail(error));
        }
        Ok(())
    }

    /// One of many files of the temporary folder: the folder as a whole makes it atomic.
    fn write_file(&self, name: &str, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
        let into = || {
            let mut file = BufWriter::with_capacity(1 << 16, File::create(self.temporary.path().join(name))?);
            write(&mut file)?;
            file.flush()
        };
        into().map_err(|error| Error::write(&self.target.join(name), error))
    }
}

fn color_name(number: usize) -> String {
    format!("rgb/{number:06}.png")
}

fn depth_name(number: usize) -> String {
    format!("depth/{number:06}.png")
}

//! A recording in TUM layout, written whole or not at all.
//!
//! In: frames with their numbers, boxes, masks, the true poses. Out: a folder with `rgb/`, `depth/`, `masks/`, their lists,
//! `associations.txt`, `groundtruth.txt`, `camera.toml`, `boxes.json`, which [`Sequence::open`](crate::Sequence::open) reads; of a stereo
//! camera with `right/` and `right.txt` in place of depth.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use yfslam::image::Image;
use yfslam::{Camera, RgbdFrame};

use super::png::{encode_color, encode_depth, encode_mask};
use crate::atomic_file::Temporary;
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
    /// Whether right pictures come in place of depth images.
    stereo: bool,
    lists: [String; 3],
}

/// Stamps of one frame as the lists say them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ListedStamps {
    /// Time of the colour image, ns; `None` is written as `nan`.
    pub color_ns: Option<i64>,
    /// Time of the depth image or right picture, ns.
    pub companion_ns: Option<i64>,
}

impl RecordingWriter {
    /// Begins the recording `target`, of right pictures in place of depth images if `stereo` is set. A folder that holds something is
    /// refused, unless `replace` is set and it is a recording itself.
    ///
    /// # Errors
    /// The folder is in use, or nothing can be written beside it.
    pub fn create(target: &Path, stereo: bool, replace: bool) -> Result<Self> {
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
            for part in ["rgb", companion_folder(stereo), "masks"] {
                fs::create_dir(temporary.path().join(part))?;
            }
            Ok(temporary)
        };
        let temporary = begin().map_err(|error| Error::write(target, error))?;
        let lists = ["# timestamp filename\n", "# timestamp filename\n", "# timestamp rgb timestamp depth\n"];
        Ok(Self { temporary, target: target.into(), replace: occupied, stereo, lists: lists.map(str::to_owned) })
    }

    /// Writes the images of delivery `number`; any order, any thread.
    ///
    /// # Errors
    /// A file cannot be written, or an image is empty or not there.
    pub fn write_images(&self, number: usize, frame: &RgbdFrame) -> Result<()> {
        self.write_file(&color_name(number), |file| encode_color(&frame.color, file))?;
        self.write_file(&self.companion_name(number), |file| match &frame.right {
            Some(right) if self.stereo => encode_color(right, file),
            None if self.stereo => Err(io::Error::new(io::ErrorKind::InvalidData, "the frame has no right picture")),
            _ => encode_depth(&frame.depth.raw, file),
        })
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
        let (color, companion) = (text(stamps.color_ns), text(stamps.companion_ns));
        let (color_file, companion_file) = (color_name(number), self.companion_name(number));
        let [color_list, companion_list, pairs] = &mut self.lists;
        // Writing to a string cannot fail.
        let _ = writeln!(color_list, "{color} {color_file}");
        let _ = writeln!(companion_list, "{companion} {companion_file}");
        let _ = writeln!(pairs, "{color} {color_file} {companion} {companion_file}");
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
        let [color, companions, pairs] = &self.lists;
        self.write_text("rgb.txt", color)?;
        self.write_text(&format!("{}.txt", companion_folder(self.stereo)), companions)?;
        if !self.stereo {
            self.write_text("associations.txt", pairs)?;
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

    fn companion_name(&self, number: usize) -> String {
        format!("{}/{number:06}.png", companion_folder(self.stereo))
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

/// Folder of what comes with the colour images.
fn companion_folder(stereo: bool) -> &'static str {
    if stereo { "right" } else { "depth" }
}

//! Writes a recording in TUM layout, completely or not at all.
//!
//! In: frames with their numbers, boxes, masks, ground truth. Out: a folder with `rgb/`, `depth/`, `masks/`, their lists,
//! `associations.txt`, `groundtruth.txt`, `camera.toml` and `boxes.json`, which [`Sequence::open`](crate::Sequence::open) reads; for a
//! stereo camera with `right/` and `right.txt` instead of depth.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use yfslam::{Camera, Frame, Image};

use super::png::{encode_color, encode_depth, encode_mask};
use crate::atomic_file::{MovedAside, Temporary, prepare_folder};
use crate::boxes::{BOXES_FILE, BoxList};
use crate::camera::camera_toml;
use crate::error::{Error, Result};
use crate::time::format_stamp;
use crate::trajectory::{StampedPose, write_trajectory};

/// A recording that is being written to a temporary folder beside its target.
#[derive(Debug)]
pub struct RecordingWriter {
    temporary: Temporary,
    target: PathBuf,
    replace: bool,
    /// Whether right images are written instead of depth images.
    stereo: bool,
    lists: [String; 3],
}

/// Stamps of one frame in the lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ListedStamps {
    /// Time of the colour image, ns; `None` is written as `nan`.
    pub color_ns: Option<i64>,
    /// Time of the depth or right image, ns.
    pub paired_ns: Option<i64>,
}

impl RecordingWriter {
    /// Begins the recording `target`, with right images instead of depth images if `stereo` is set. A folder that is not empty is
    /// refused, unless `replace` is set and it is a recording.
    ///
    /// # Errors
    /// The folder is refused, or nothing can be written beside it.
    pub fn create(target: &Path, stereo: bool, replace: bool) -> Result<Self> {
        let occupied = match fs::read_dir(target) {
            Ok(mut entries) => entries.next().is_some(),
            Err(error) if error.kind() == io::ErrorKind::NotFound => false,
            Err(error) => return Err(Error::write(target, error)),
        };
        if occupied && !replace {
            return Err(Error::content(target, "is not empty", "choose another folder, or give --force"));
        }
        if occupied && !target.join("rgb.txt").is_file() {
            let problem = "is not a recording and is therefore not replaced";
            return Err(Error::content(target, problem, "choose another folder, or remove it by hand"));
        }
        let parent = target.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        prepare_folder(parent)?;
        let begin = || {
            let temporary = Temporary::create_folder(parent)?;
            for part in ["rgb", paired_folder(stereo), "masks"] {
                fs::create_dir(temporary.path().join(part))?;
            }
            Ok(temporary)
        };
        let temporary = begin().map_err(|error| Error::write(target, error))?;
        let lists = ["# timestamp filename\n", "# timestamp filename\n", "# timestamp rgb timestamp depth\n"];
        Ok(Self { temporary, target: target.into(), replace: occupied, stereo, lists: lists.map(str::to_owned) })
    }

    /// Writes the images of delivery `number`, in any order and from any thread.
    ///
    /// # Errors
    /// A file cannot be written, or an image is empty or missing.
    pub fn write_images(&self, number: usize, frame: &Frame) -> Result<()> {
        self.write_file(&color_name(number), |file| encode_color(&frame.color, file))?;
        self.write_file(&self.paired_name(number), |file| match &frame.right {
            Some(right) if self.stereo => encode_color(right, file),
            None if self.stereo => Err(io::Error::new(io::ErrorKind::InvalidData, "the frame has no right image")),
            _ => encode_depth(frame.depth.as_ref().map_or(&Image::default(), |depth| &depth.raw), file),
        })
    }

    /// Writes the mask of instances of the frame with this stamp, in any order and from any thread.
    ///
    /// # Errors
    /// The file cannot be written, or the image is empty.
    pub fn write_mask(&self, timestamp_ns: i64, mask: &Image<u8>) -> Result<()> {
        self.write_file(&format!("masks/{}.png", format_stamp(timestamp_ns)), |file| encode_mask(mask, file))
    }

    /// Appends delivery `number` to the lists.
    pub fn list(&mut self, number: usize, stamps: ListedStamps) {
        let text = |stamp: Option<i64>| stamp.map_or("nan".to_owned(), format_stamp);
        let (color, paired) = (text(stamps.color_ns), text(stamps.paired_ns));
        let (color_file, paired_file) = (color_name(number), self.paired_name(number));
        let [color_list, paired_list, pairs] = &mut self.lists;
        // Writing to a string cannot fail.
        let _ = writeln!(color_list, "{color} {color_file}");
        let _ = writeln!(paired_list, "{paired} {paired_file}");
        let _ = writeln!(pairs, "{color} {color_file} {paired} {paired_file}");
    }

    /// Adds a text file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_text(&self, name: &str, text: &str) -> Result<()> {
        self.write_file(name, |file| file.write_all(text.as_bytes()))
    }

    /// Writes the lists and moves the folder to its target.
    ///
    /// # Errors
    /// A file cannot be written, or the folder cannot be moved.
    pub fn finish(self, camera: &Camera, depth_factor: f64, truth: &[StampedPose], boxes: &BoxList) -> Result<()> {
        let [color, paired, pairs] = &self.lists;
        self.write_text("rgb.txt", color)?;
        self.write_text(&format!("{}.txt", paired_folder(self.stereo)), paired)?;
        if !self.stereo {
            self.write_text("associations.txt", pairs)?;
        }
        self.write_file("camera.toml", |file| file.write_all(camera_toml(camera, depth_factor, "")?.as_bytes()))?;
        write_trajectory(&self.temporary.path().join("groundtruth.txt"), truth)?;
        boxes.write(&self.temporary.path().join(BOXES_FILE))?;
        let Self { temporary, target, replace, .. } = self;
        let fail = |error| Error::write(&target, error);
        // The old recording is moved away only once the new one is complete.
        let old = replace.then(|| MovedAside::new(&target)).transpose().map_err(fail)?;
        if let Err(error) = temporary.rename_to(&target) {
            if let Some(old) = old {
                old.move_back_to(&target).map_err(fail)?;
            }
            return Err(fail(error));
        }
        Ok(())
    }

    fn paired_name(&self, number: usize) -> String {
        format!("{}/{number:06}.png", paired_folder(self.stereo))
    }

    /// Writes one file of the temporary folder, which is moved as a whole.
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

/// Returns the folder of the images that are paired with the colour images.
fn paired_folder(stereo: bool) -> &'static str {
    if stereo { "right" } else { "depth" }
}

//! Two folders of images without lists: colour and depth, as the recorders of Open3D and RealSense write them; or one folder of colour
//! images, for a single camera.
//!
//! In: a folder with `color/` and `depth/`, or folders of other names. Out: its frames, in the order of the names of their files.

use std::path::{Path, PathBuf};

use yfslam::config::DepthSource;

use super::images::{NamedImage, common, images_in, numbered, stamped};
use super::intrinsics::{has_camera_file, open3d_camera};
use super::layout::{Listing, missing_images};
use super::lists::ListedFile;
use super::pairs::{List, from_lists};
use super::{AssociationReport, FrameEntry, GroundTruthReader, ListedImage, SequenceOptions};
use crate::error::{Error, Result};

/// Names of folders of colour images, the most usual first.
const COLOR_FOLDERS: [&str; 7] = ["color", "rgb", "colour", "image", "images", "rgb_images", "color_images"];

/// Names of folders of depth images that are registered to colour.
const DEPTH_FOLDERS: [&str; 6] =
    ["depth", "aligned_depth", "depth_aligned", "depth_registered", "depths", "depth_images"];

/// The folders of a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImageFolders {
    pub color: PathBuf,
    pub depth: Option<PathBuf>,
}

impl ImageFolders {
    /// Finds the folders in `folder`: those that the user named, else those with a usual name that hold images.
    pub fn find(folder: &Path, options: &SequenceOptions) -> Option<Self> {
        let with_images = |names: &[&str]| {
            let folders = names.iter().map(|name| folder.join(name)).filter(|path| path.is_dir());
            folders.into_iter().find(|path| images_in(path, |_| true).is_ok_and(|images| !images.is_empty()))
        };
        let named = |path: &PathBuf| if path.is_dir() { path.clone() } else { folder.join(path) };
        let own = || {
            let images = images_in(folder, |_| true).ok()?;
            (!images.is_empty()).then(|| folder.to_owned())
        };
        let color = options.color_folder.as_ref().map(named);
        let color = color.or_else(|| with_images(&COLOR_FOLDERS)).or_else(own)?;
        let depth = options.depth_folder.as_ref().map(named).or_else(|| with_images(&DEPTH_FOLDERS));
        Some(Self { color, depth })
    }

    /// Returns why the folder is taken for such a recording.
    pub fn because(&self) -> String {
        match &self.depth {
            Some(depth) => format!("{} and {} hold images", self.color.display(), depth.display()),
            None => format!("{} holds images", self.color.display()),
        }
    }
}

/// Lists the frames of `folder`.
pub fn list(folder: &Path, options: &SequenceOptions) -> Result<Listing> {
    let folders = ImageFolders::find(folder, options).ok_or_else(|| {
        let cure = format!(
            "name the folders with --color DIR and --depth DIR; usual names are {} and {}",
            COLOR_FOLDERS.join(", "),
            DEPTH_FOLDERS.join(", ")
        );
        Error::content(folder, "holds no folder of colour images", cure)
    })?;
    let depth_source = match (options.depth_source, &folders.depth) {
        (Some(DepthSource::Stereo), _) => return Err(missing_images(folder, DepthSource::Stereo)),
        (Some(DepthSource::Image), None) | (None, None) => return Err(no_depth(folder, &folders)),
        (Some(DepthSource::Motion), _) => DepthSource::Motion,
        (Some(DepthSource::Image) | None, Some(_)) => DepthSource::Image,
    };
    let color = images_of(&folders.color)?;
    let depth = folders.depth.as_deref().filter(|_| depth_source == DepthSource::Image).map(images_of).transpose()?;
    let depth_folder = folders.depth.as_deref().unwrap_or(folder);
    let images = Images { color, depth, color_folder: &folders.color, depth_folder, folder };
    let (entries, report, notes) = images.pair(options)?;
    let calibration =
        if options.read_calibration && !has_camera_file(folder) { open3d_camera(folder, options.fps())? } else { None };
    let ground_truth = GroundTruthReader::tum(folder.join("groundtruth.txt"));
    Ok(Listing { depth_source, entries, report, calibration, ground_truth, notes })
}

fn images_of(folder: &Path) -> Result<Vec<NamedImage>> {
    let images = images_in(folder, |_| true)?;
    if images.is_empty() {
        return Err(Error::content(folder, "holds no images", "unpack the images, or name another folder"));
    }
    Ok(images)
}

fn no_depth(folder: &Path, folders: &ImageFolders) -> Error {
    let problem = format!("has colour images in {}, but no folder of depth images", folders.color.display());
    Error::content(folder, problem, "name one with --depth DIR, or use the colour images alone with --sensor mono")
}

/// The images of a recording without lists.
pub struct Images<'a> {
    pub color: Vec<NamedImage>,
    /// `None` for a single camera.
    pub depth: Option<Vec<NamedImage>>,
    /// The folders, named in messages.
    pub color_folder: &'a Path,
    pub depth_folder: &'a Path,
    pub folder: &'a Path,
}

/// Frames, how they were paired, and what the user must be told.
pub type Paired = (Vec<FrameEntry>, AssociationReport, Vec<String>);

impl Images<'_> {
    /// Pairs colour and depth: by time stamp if the names are time stamps, else by number, else by order.
    pub fn pair(self, options: &SequenceOptions) -> Result<Paired> {
        let list = |files: Vec<ListedFile>, folder: &Path| List {
            images: files.into_iter().map(ListedImage::from).collect(),
            unstamped: 0,
            path: folder.to_owned(),
        };
        let (color, depth) = (stamped(&self.color), self.depth.as_deref().map(stamped));
        let all_are_stamps = color.is_some() && depth.as_ref().is_none_or(Option::is_some) && options.fps.is_none();
        if let Some(color) = color.filter(|_| all_are_stamps) {
            let tolerance_ns = options.association_tolerance_ns;
            let (entries, report) = from_lists(
                self.folder,
                list(color, self.color_folder),
                depth.flatten().map(|depth| list(depth, self.depth_folder)),
                tolerance_ns,
            )?;
            return Ok((entries, report, vec!["the names of the images are their time stamps".into()]));
        }
        let fps = options.fps();
        let listed = [self.color.len(), self.depth.as_ref().map_or(0, Vec::len)];
        let (color, depth, mut notes) = match &self.depth {
            None => (self.color.clone(), None, Vec::new()),
            Some(depth) => {
                let (color, depth, note) = self.matched(depth)?;
                (color, Some(depth), note.into_iter().collect())
            }
        };
        let files = numbered(&color, None, fps);
        let (mut entries, mut report) = from_lists(self.folder, list(files, self.color_folder), None, 0)?;
        if let Some(depth) = depth {
            for (entry, depth) in entries.iter_mut().zip(depth) {
                entry.paired_image = Some(ListedImage { stamp_ns: entry.timestamp_ns, image: depth.path.into() });
            }
        }
        [report.color_listed, report.paired_images_listed] = listed;
        report.color_unmatched = listed[0].saturating_sub(entries.len());
        report.paired_images_unmatched = listed[1].saturating_sub(entries.len());
        notes.push(times_note(options, fps));
        Ok((entries, report, notes))
    }

    /// Returns colour and depth images in pairs.
    fn matched(&self, depth: &[NamedImage]) -> Result<(Vec<NamedImage>, Vec<NamedImage>, Option<String>)> {
        if let Some((color, depth)) = common(&self.color, depth) {
            return Ok((color, depth, None));
        }
        if self.color.len() == depth.len() {
            let note = "the names of colour and depth images have no numbers in common: they are paired in the order of their names";
            return Ok((self.color.clone(), depth.to_vec(), Some(note.into())));
        }
        let problem = format!(
            "the names of its {} colour and {} depth images have no numbers in common",
            self.color.len(),
            depth.len()
        );
        Err(Error::content(
            self.folder,
            problem,
            "list the pairs in an associations.txt: 'stamp rgb-file stamp depth-file'",
        ))
    }
}

/// Tells which frame rate gives images without time stamps their times.
pub fn times_note(options: &SequenceOptions, fps: f64) -> String {
    match options.fps {
        Some(_) => format!("the images have no time stamps: {fps} frames per second, from --fps"),
        None => format!("the images have no time stamps: {fps} frames per second are assumed; --fps sets another rate"),
    }
}

//! Masks of movable objects from a segmentation of the user's, one image for each frame.
//!
//! In: the folder and the frames of a sequence. Out: the mask of each frame that has one. A mask has the name of the colour image or of
//! the time stamp, or it is listed in `masks.txt` of the folder in the form of TUM lists: time stamp and file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, ensure};
use serde::Serialize;
use yfslam::{Camera, Image};
use yfslam_io::decode::{ImageSize, decode_mask};
use yfslam_io::sequence::lists::parse_file_list;
use yfslam_io::time::format_stamp;
use yfslam_io::{Sequence, read_file, read_text};

use crate::stats::skip::Skip;

/// Name of the list of masks.
const LIST: &str = "masks.txt";

/// Which frames have a mask.
#[derive(Clone, Debug, Serialize)]
pub struct MaskTally {
    /// The folder.
    pub folder: PathBuf,
    /// Frames with a mask.
    pub found: usize,
    /// Frames without a mask; nothing is masked in them.
    pub missing: usize,
    /// The file that is missing for the first of those.
    pub first_missing: Option<PathBuf>,
}

/// The masks of a sequence.
pub struct Masks {
    /// By the time stamp at which the frame is played, ns.
    files: BTreeMap<i64, PathBuf>,
    size: ImageSize,
    pub tally: MaskTally,
}

impl Masks {
    /// Finds the masks of the frames of `sequence` in `folder`, and reads the first one.
    ///
    /// # Errors
    /// The folder has no mask of these frames, its list is malformed, or the first mask cannot be used.
    pub fn open(folder: &Path, sequence: &Sequence, camera: &Camera) -> Result<Self> {
        ensure!(folder.is_dir(), "--masks {}: there is no such folder; check the path", folder.display());
        let listed = read_list(folder)?;
        let mut files = BTreeMap::new();
        let mut first_missing = None;
        for entry in &sequence.entries {
            let recorded_ns = sequence.mirror.map_or(entry.timestamp_ns, |mirror| mirror.apply(entry.timestamp_ns));
            let named = |stem: &str| folder.join(format!("{stem}.png"));
            let of_stamp = named(&format_stamp(recorded_ns));
            // An image of a bag has no name of its own.
            let stem = entry.color.file().map(|path| path.file_stem().unwrap_or_default().to_string_lossy());
            let like_color = stem.map_or_else(|| of_stamp.clone(), |stem| named(&stem));
            let candidates = match &listed {
                Some(listed) => vec![listed.get(&recorded_ns).cloned().unwrap_or_default()],
                None => vec![like_color.clone(), of_stamp],
            };
            match candidates.into_iter().find(|path| path.is_file()) {
                Some(path) => _ = files.insert(entry.timestamp_ns, path),
                None => _ = first_missing.get_or_insert(if listed.is_some() { folder.join(LIST) } else { like_color }),
            }
        }
        let found = files.len();
        let tally = MaskTally { folder: folder.into(), found, missing: sequence.entries.len() - found, first_missing };
        ensure!(
            found > 0,
            "--masks {}: none of the {} frames has a mask there; give each mask the name of its colour image (the first would be {}), or list \
             time stamp and file in {LIST}",
            folder.display(),
            tally.missing,
            tally.first_missing.as_deref().unwrap_or(folder).display()
        );
        let size = ImageSize { width: camera.width, height: camera.height };
        let masks = Self { files, size, tally };
        if let Some(first) = masks.files.values().next() {
            masks.read(first)?;
        }
        Ok(masks)
    }

    /// Returns the mask of the frame that is played at this time, if it has one.
    ///
    /// # Errors
    /// The file cannot be used.
    pub fn at(&self, played_ns: i64) -> Result<Option<Arc<Image<u8>>>, Skip> {
        let Some(path) = self.files.get(&played_ns) else { return Ok(None) };
        let skip = |error: anyhow::Error| Skip { reason: "unusable mask", message: format!("{error:#}") };
        self.read(path).map(|mask| Some(Arc::new(mask))).map_err(skip)
    }

    fn read(&self, path: &Path) -> Result<Image<u8>> {
        let bytes = read_file(path).with_context(|| format!("cannot read the mask {}", path.display()))?;
        let mut mask = Image::default();
        decode_mask(&bytes, Some(self.size), &mut mask).with_context(|| format!("the mask {}", path.display()))?;
        Ok(mask)
    }
}

/// Returns files by time stamp, ns, if the folder has a list.
fn read_list(folder: &Path) -> Result<Option<BTreeMap<i64, PathBuf>>> {
    let path = folder.join(LIST);
    if !path.is_file() {
        return Ok(None);
    }
    let text = read_text(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let (files, _) = parse_file_list(&text, &path)?;
    Ok(Some(files.into_iter().map(|file| (file.stamp_ns, folder.join(file.path))).collect()))
}

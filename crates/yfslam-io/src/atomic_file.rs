//! Writes files completely or not at all.

mod temporary;

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use temporary::remove_abandoned;
pub(crate) use temporary::{MovedAside, Temporary};

/// Room that an output folder must have, bytes: enough for trajectories and records of a short run.
const MIN_ROOM_BYTES: usize = 1 << 20;

/// Writes `path` with `write`: into a temporary file beside it, which replaces `path` once all of it is on the disk.
///
/// Missing folders are created. After an error an old file is unchanged, and no part of the new one remains. Links are followed;
/// devices and pipes are written directly.
///
/// # Errors
/// [`Error::Write`], also for an error of `write`.
pub fn write_atomically(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    write_or_io_error(path, write).map_err(|source| Error::write(path, source))
}

/// Creates the folder `path`, if it is missing, and checks that files can be written there and that there is room for them. Temporary
/// files of killed processes are removed from it; those of running ones are locked, and stay.
///
/// # Errors
/// [`Error::Write`] if the folder cannot be used.
pub fn prepare_folder(path: &Path) -> Result<()> {
    let folder = if path.as_os_str().is_empty() { Path::new(".") } else { path };
    let prepare = || {
        fs::create_dir_all(folder)?;
        remove_abandoned(folder);
        let (_probe, mut file) = Temporary::create(folder)?;
        file.write_all(&vec![0; MIN_ROOM_BYTES])?;
        // Only now does the file system need to have the room.
        file.sync_all()
    };
    prepare().map_err(|source| Error::write(path, source))
}

/// A file that is written over time and appears once it is finished; dropped before, it leaves nothing.
#[derive(Debug)]
pub struct AtomicFile {
    target: PathBuf,
    temporary: Temporary,
    writer: BufWriter<File>,
}

impl AtomicFile {
    /// Begins to write; missing folders are created.
    ///
    /// # Errors
    /// [`Error::Write`] if the folder cannot be used, or `path` is something other than a file.
    pub fn create(path: &Path) -> Result<Self> {
        let create = || {
            let target = match fs::metadata(path) {
                Ok(metadata) if !metadata.is_file() => return Err(io::Error::other("it is not a file")),
                Ok(_) => path.canonicalize()?,
                Err(_) => path.to_owned(),
            };
            let (temporary, file) = create_beside(&target)?;
            Ok(Self { temporary, writer: BufWriter::with_capacity(1 << 16, file), target })
        };
        create().map_err(|source| Error::write(path, source))
    }

    /// Puts the file in its place.
    ///
    /// # Errors
    /// [`Error::Write`]; an earlier file is then unchanged.
    pub fn finish(self) -> Result<()> {
        let Self { target, temporary, writer } = self;
        let finish = || {
            writer.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()?;
            temporary.rename_to(&target)
        };
        finish().map_err(|source| Error::write(&target, source))
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

/// Creates a temporary file in the folder of `target`, which is created if it is missing.
fn create_beside(target: &Path) -> io::Result<(Temporary, File)> {
    let folder = folder_of(target);
    fs::create_dir_all(folder)?;
    Temporary::create(folder)
}

fn folder_of(target: &Path) -> &Path {
    target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn write_or_io_error(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let target = match fs::metadata(path) {
        Ok(metadata) if metadata.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
        Ok(metadata) if !metadata.is_file() => return write_through(OpenOptions::new().write(true).open(path)?, write),
        Ok(_) => path.canonicalize()?,
        Err(_) => path.to_owned(),
    };
    let (temporary, file) = create_beside(&target)?;
    write_through(file, write)?;
    temporary.rename_to(&target)?;
    // The new name is on the disk once the folder is; on file systems that cannot do this, only the name may be lost.
    let _ = File::open(folder_of(&target)).and_then(|folder| folder.sync_all());
    Ok(())
}

fn write_through(file: File, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let is_regular = file.metadata()?.is_file();
    let mut writer = BufWriter::with_capacity(1 << 16, file);
    write(&mut writer)?;
    let file = writer.into_inner().map_err(io::IntoInnerError::into_error)?;
    if is_regular { file.sync_all() } else { Ok(()) }
}

#[cfg(test)]
mod tests;

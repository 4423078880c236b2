//! Writes files completely or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Error, Result};

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

fn write_or_io_error(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let target = match fs::metadata(path) {
        Ok(metadata) if metadata.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
        Ok(metadata) if !metadata.is_file() => return write_through(OpenOptions::new().write(true).open(path)?, write),
        Ok(_) => path.canonicalize()?,
        Err(_) => path.to_owned(),
    };
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    fs::create_dir_all(folder)?;
    let (temporary, file) = Temporary::create(folder)?;
    write_through(file, write)?;
    temporary.rename_to(&target)?;
    // The new name is on the disk once the folder is; on file systems that cannot do this, only the name may be lost.
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
    Ok(())
}

fn write_through(file: File, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let is_regular = file.metadata()?.is_file();
    let mut writer = BufWriter::with_capacity(1 << 16, file);
    write(&mut writer)?;
    let file = writer.into_inner().map_err(io::IntoInnerError::into_error)?;
    if is_regular { file.sync_all() } else { Ok(()) }
}

/// A temporary file or folder, which is removed unless it was renamed, also when its writer panics.
#[derive(Debug)]
pub(crate) struct Temporary(PathBuf);

impl Temporary {
    fn create(folder: &Path) -> io::Result<(Self, File)> {
        Self::claim(folder, |path| OpenOptions::new().write(true).create_new(true).open(path))
    }

    pub(crate) fn create_folder(folder: &Path) -> io::Result<Self> {
        Ok(Self::claim(folder, |path| fs::create_dir(path))?.0)
    }

    /// Moves `path` to a temporary name beside it.
    pub(crate) fn aside(path: &Path) -> io::Result<Self> {
        let path = path.canonicalize()?;
        let aside = Self::create_folder(path.parent().unwrap_or(Path::new(".")))?;
        fs::rename(&path, &aside.0)?;
        Ok(aside)
    }

    /// Creates a file or folder with an unused name.
    fn claim<T>(folder: &Path, create: impl Fn(&Path) -> io::Result<T>) -> io::Result<(Self, T)> {
        static COUNTER: AtomicU64 = AtomicU64::new(0);
        loop {
            let number = COUNTER.fetch_add(1, Ordering::Relaxed);
            let path = folder.join(format!(".yfslam-{}-{number}.tmp", std::process::id()));
            match create(&path) {
                Ok(created) => return Ok((Self(path), created)),
                // The file of a process with the same number that was killed.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.0
    }

    pub(crate) fn rename_to(mut self, target: &Path) -> io::Result<()> {
        fs::rename(&self.0, target)?;
        self.0.clear();
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.0.as_os_str().is_empty() {
            // It is either a file or a folder.
            let _ = fs::remove_file(&self.0).or_else(|_| fs::remove_dir_all(&self.0));
        }
    }
}

#[cfg(test)]
mod tests;

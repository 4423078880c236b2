//! Temporary files and folders, which are locked while their process runs.
//!
//! The lock distinguishes an abandoned file from one in use, also between containers, in which process numbers mean nothing.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Names of temporary files and folders: prefix, process number, `-`, number, and one of two endings.
const PREFIX: &str = ".yfslam-";
/// Ending of what is incomplete and may be removed once nothing writes it any more.
const INCOMPLETE: &str = ".tmp";
/// Ending of what was complete before it was moved aside; it is never taken for an abandoned file.
const OLD: &str = ".old";

/// A temporary file or folder, which is removed unless it was renamed, also when its writer panics.
#[derive(Debug)]
pub(crate) struct Temporary {
    path: PathBuf,
    /// Holds the lock until it is dropped; `None` where the file system has no locks.
    _lock: Option<File>,
}

impl Temporary {
    /// Creates an empty file.
    pub(super) fn create(folder: &Path) -> io::Result<(Self, File)> {
        let create = |path: &Path| OpenOptions::new().write(true).create_new(true).open(path);
        let (path, file) = claim(folder, INCOMPLETE, create, lock)?;
        // Clones of a file share its lock.
        Ok((Self { path, _lock: file.try_clone().ok() }, file))
    }

    /// Creates an empty folder.
    pub(crate) fn create_folder(folder: &Path) -> io::Result<Self> {
        // Not every operating system opens folders.
        let create = |path: &Path| fs::create_dir(path).map(|()| File::open(path).ok());
        let (path, folder) = claim(folder, INCOMPLETE, create, |folder| folder.as_ref().is_none_or(lock))?;
        Ok(Self { path, _lock: folder })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn rename_to(mut self, target: &Path) -> io::Result<()> {
        fs::rename(&self.path, target)?;
        self.path.clear();
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        remove(&self.path);
    }
}

/// A complete folder under a temporary name, which is removed unless it was moved back.
#[derive(Debug)]
pub(crate) struct MovedAside(PathBuf);

impl MovedAside {
    /// Moves `path` to a temporary name beside it.
    pub(crate) fn new(path: &Path) -> io::Result<Self> {
        let path = path.canonicalize()?;
        let parent = path.parent().unwrap_or(Path::new("."));
        let (aside, ()) = claim(parent, OLD, |path| fs::create_dir(path), |()| true)?;
        let aside = Self(aside);
        fs::rename(&path, &aside.0)?;
        Ok(aside)
    }

    pub(crate) fn move_back_to(mut self, path: &Path) -> io::Result<()> {
        fs::rename(&self.0, path)?;
        self.0.clear();
        Ok(())
    }
}

impl Drop for MovedAside {
    fn drop(&mut self) {
        remove(&self.0);
    }
}

/// Removes incomplete files and folders that nothing writes any more, because their process was killed. What cannot be locked is in
/// use, or on a file system without locks, and stays.
pub(super) fn remove_abandoned(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let is_ours = entry.file_name().to_str().is_some_and(is_incomplete);
        let Some(kind) = entry.file_type().ok().filter(|kind| is_ours && (kind.is_file() || kind.is_dir())) else {
            continue;
        };
        let path = entry.path();
        // Network file systems give an exclusive lock only on a file that is open for writing.
        let opened = if kind.is_file() { OpenOptions::new().write(true).open(&path) } else { File::open(&path) };
        if let Ok(file) = opened
            && file.try_lock().is_ok()
        {
            remove(&path);
        }
    }
}

/// Returns whether [`Temporary`] gives such a name.
fn is_incomplete(name: &str) -> bool {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    let numbers = name.strip_prefix(PREFIX).and_then(|name| name.strip_suffix(INCOMPLETE));
    numbers.and_then(|numbers| numbers.split_once('-')).is_some_and(|(a, b)| is_number(a) && is_number(b))
}

/// Creates a file or folder with an unused name, of which `lock` takes possession.
fn claim<T>(
    folder: &Path,
    ending: &str,
    create: impl Fn(&Path) -> io::Result<T>,
    lock: impl Fn(&T) -> bool,
) -> io::Result<(PathBuf, T)> {
    static COUNTER: AtomicU64 = AtomicU64::new(0);
    loop {
        let number = COUNTER.fetch_add(1, Ordering::Relaxed);
        let path = folder.join(format!("{PREFIX}{}-{number}{ending}", std::process::id()));
        match create(&path) {
            // Another process that removes abandoned files may come between creation and lock; then the next name is taken.
            Ok(created) if lock(&created) && path.exists() => return Ok((path, created)),
            Ok(_) => {}
            // The file of a process with the same number that was killed.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
        }
    }
}

/// Locks the file; `false` if another process has locked it. Without locks in the file system it counts as locked, for then nothing
/// that is abandoned is ever removed.
fn lock(file: &File) -> bool {
    !matches!(file.try_lock(), Err(TryLockError::WouldBlock))
}

fn remove(path: &Path) {
    if !path.as_os_str().is_empty() {
        // It is either a file or a folder.
        let _ = fs::remove_file(path).or_else(|_| fs::remove_dir_all(path));
    }
}

//! Errors of files and arguments: every message names the file, what is wrong with which value, and what to do.

use std::io;
use std::path::{Path, PathBuf};

/// Result of reading or writing a file.
pub type Result<T> = std::result::Result<T, Error>;

/// A file, folder or setting that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The file or folder cannot be read.
    #[error("cannot read {}: {source}; {cure}", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
        /// What to do.
        cure: String,
    },
    /// The file cannot be written; an earlier file at `path` is unchanged.
    #[error("cannot write {}: {source}; {cure}", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
        /// What to do.
        cure: String,
    },
    /// A line of a text file is malformed.
    #[error("{}:{line}: {problem}; {cure}", path.display())]
    Line {
        /// The text file.
        path: PathBuf,
        /// Line number, from 1.
        line: usize,
        /// What is wrong, with the value.
        problem: String,
        /// What to do.
        cure: String,
    },
    /// The content as a whole is unusable.
    #[error("{}: {problem}; {cure}", path.display())]
    Content {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong, with the value.
        problem: String,
        /// What to do.
        cure: String,
    },
    /// An option or argument is out of its range.
    #[error("{problem}; {cure}")]
    Argument {
        /// What is wrong, with the value.
        problem: String,
        /// What to do.
        cure: String,
    },
}

impl Error {
    pub(crate) fn read(path: &Path, source: io::Error) -> Self {
        let cure = match source.kind() {
            io::ErrorKind::NotFound => "check the path",
            io::ErrorKind::PermissionDenied => "give this user the right to read it",
            io::ErrorKind::IsADirectory => "name a file inside this folder",
            io::ErrorKind::NotADirectory => "a part of this path is a file; name a folder",
            _ => "check the disk and the path",
        };
        Self::Read { path: path.into(), source, cure: cure.into() }
    }

    pub(crate) fn write(path: &Path, source: io::Error) -> Self {
        let cure = match source.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::FileTooLarge => {
                "free some space or choose another disk"
            }
            io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
                "choose a folder that this user may write to"
            }
            io::ErrorKind::IsADirectory => "name a file, not a folder",
            io::ErrorKind::NotADirectory | io::ErrorKind::AlreadyExists => {
                "a part of this path is a file; choose another folder"
            }
            io::ErrorKind::InvalidData => "nothing was written; please report this as a defect",
            _ => "choose another path",
        };
        Self::Write { path: path.into(), source, cure: cure.into() }
    }

    pub(crate) fn line(path: &Path, line: usize, problem: impl Into<String>, cure: impl Into<String>) -> Self {
        Self::Line { path: path.into(), line, problem: problem.into(), cure: cure.into() }
    }

    pub(crate) fn content(path: &Path, problem: impl Into<String>, cure: impl Into<String>) -> Self {
        Self::Content { path: path.into(), problem: problem.into(), cure: cure.into() }
    }

    pub(crate) fn argument(problem: impl Into<String>, cure: impl Into<String>) -> Self {
        Self::Argument { problem: problem.into(), cure: cure.into() }
    }
}

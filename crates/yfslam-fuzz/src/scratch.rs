//! Files for the readers that take a path. One folder for each thread, which is removed when the thread ends.

use std::cell::OnceCell;
use std::fs;
use std::path::Path;

use tempfile::TempDir;

thread_local! {
    static FOLDER: OnceCell<Option<TempDir>> = const { OnceCell::new() };
}

/// Calls `use_folder` with a folder of this thread, the same in every call; `None` if there is no room for one.
pub fn with_folder<T>(use_folder: impl FnOnce(&Path) -> T) -> Option<T> {
    FOLDER
        .with(|folder| folder.get_or_init(|| tempfile::tempdir().ok()).as_ref().map(|folder| use_folder(folder.path())))
}

/// Calls `read` with the path of a file of these bytes; `None` if it cannot be written.
pub fn with_file<T>(name: &str, bytes: &[u8], read: impl FnOnce(&Path) -> T) -> Option<T> {
    with_folder(|folder| {
        let path = folder.join(name);
        fs::write(&path, bytes).ok()?;
        Some(read(&path))
    })?
}

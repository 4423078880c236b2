use super::*;

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn put(path: &Path, text: &str) -> Result<()> {
    write_atomically(path, |w| w.write_all(text.as_bytes()))
}

#[test]
fn a_file_is_written_and_replaced_and_its_folders_are_created() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a/b/poses.txt");
    put(&path, "old").unwrap();
    put(&path, "new").unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), "new");
    assert_eq!(names(path.parent().unwrap()), ["poses.txt"]);
}

#[test]
fn a_failed_write_leaves_the_old_file_and_no_part_of_the_new() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("poses.txt");
    put(&path, "old").unwrap();
    let error = write_atomically(&path, |w| {
        w.write_all(&[b'x'; 1 << 20])?;
        Err(io::ErrorKind::StorageFull.into())
    });
    let text = error.unwrap_err().to_string();
    assert!(text.contains("poses.txt") && text.contains("free some space"), "{text}");
    let panicked = std::panic::catch_unwind(|| write_atomically(&path, |_| panic!("a defect of the writer")));
    assert!(panicked.is_err());
    assert_eq!(
        (fs::read_to_string(&path).unwrap().as_str(), names(folder.path())),
        ("old", vec!["poses.txt".to_owned()])
    );
}

#[test]
fn a_full_device_is_an_error_also_if_only_the_flush_fails() {
    let error = put(Path::new("/dev/full"), "few bytes").unwrap_err().to_string();
    assert!(error.contains("/dev/full") && error.contains("free some space"), "{error}");
    put(Path::new("/dev/null"), "few bytes").unwrap();
    assert!(!fs::metadata("/dev/null").unwrap().is_file(), "a device is not replaced by a file");
}

#[test]
fn paths_that_cannot_be_files_are_refused_with_a_cure() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    put(&file, "x").unwrap();
    for path in [file.join("poses.txt"), file.join("deeper/poses.txt")] {
        let error = put(&path, "x").unwrap_err().to_string();
        assert!(error.contains("poses.txt") && error.contains("a part of this path is a file"), "{error}");
    }
    let error = put(folder.path(), "x").unwrap_err().to_string();
    assert!(error.contains("name a file, not a folder"), "{error}");
    assert!(put(Path::new(""), "x").is_err());
}

#[test]
fn a_link_stays_a_link_to_the_new_content() {
    let folder = tempfile::tempdir().unwrap();
    let (real, link) = (folder.path().join("real.txt"), folder.path().join("link.txt"));
    put(&real, "old").unwrap();
    std::os::unix::fs::symlink(&real, &link).unwrap();
    put(&link, "new").unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(fs::read_to_string(&real).unwrap(), "new");
}

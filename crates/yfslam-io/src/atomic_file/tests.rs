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

#[test]
fn files_of_killed_processes_are_removed_and_those_of_running_ones_and_of_others_stay() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (live, _file) = Temporary::create(folder.path()).unwrap();
    let live_folder = Temporary::create_folder(folder.path()).unwrap();
    // A killed process leaves files without a lock.
    fs::write(at(".yfslam-4000000000-7.tmp"), "half a trajectory").unwrap();
    fs::create_dir(at(".yfslam-4000000000-8.tmp")).unwrap();
    fs::write(at(".yfslam-4000000000-8.tmp/rgb.txt"), "half a recording").unwrap();
    let others = [".yfslam-4-7.old", ".yfslam-x-7.tmp", ".yfslam-4.tmp", "yfslam-4-7.tmp", ".yfslam-4-7.tmp.txt"];
    for other in others {
        fs::write(at(other), "not ours, or complete").unwrap();
    }
    std::os::unix::fs::symlink("/dev/null", at(".yfslam-4-9.tmp")).unwrap();
    prepare_folder(folder.path()).unwrap();
    let left = names(folder.path());
    let own = [live.path(), live_folder.path()].map(|path| path.file_name().unwrap().to_str().unwrap().to_owned());
    let expected = others.map(str::to_owned).into_iter().chain([".yfslam-4-9.tmp".to_owned()]).chain(own);
    assert_eq!(left.iter().collect::<std::collections::BTreeSet<_>>(), expected.collect::<Vec<_>>().iter().collect());
    live.rename_to(&at("poses.txt")).unwrap();
    assert!(at("poses.txt").is_file());
}

#[test]
fn a_folder_that_cannot_be_used_is_refused_with_a_cure() {
    let folder = tempfile::tempdir().unwrap();
    prepare_folder(&folder.path().join("a/b")).unwrap();
    assert_eq!(names(&folder.path().join("a/b")), Vec::<String>::new(), "no probe stays");
    fs::write(folder.path().join("file"), "").unwrap();
    for path in [folder.path().join("file"), folder.path().join("file/deeper")] {
        let error = prepare_folder(&path).unwrap_err().to_string();
        assert!(error.contains("file") && error.contains("a part of this path is a file"), "{error}");
    }
}

//! The dynamic sequences of public benchmarks, by their names.
//!
//! In: a folder with folders. Out: which of them are sequences, and which sequences of the benchmarks are missing.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

/// Sequences of one data set.
pub struct DataSet {
    /// Name of the data set.
    pub name: &'static str,
    /// Where to get it.
    pub home: &'static str,
    /// Folder names, with the preset of the camera.
    pub sequences: &'static [(&'static str, &'static str)],
}

/// The data sets with their dynamic sequences.
pub const DATA_SETS: [DataSet; 2] = [
    DataSet {
        name: "TUM RGB-D benchmark, dynamic objects",
        home: "the page \"RGB-D SLAM Dataset and Benchmark\" of the Computer Vision Group of TU Munich (cvg.cit.tum.de)",
        sequences: &[
            ("rgbd_dataset_freiburg2_desk_with_person", "tum2"),
            ("rgbd_dataset_freiburg3_sitting_static", "tum3"),
            ("rgbd_dataset_freiburg3_sitting_xyz", "tum3"),
            ("rgbd_dataset_freiburg3_sitting_halfsphere", "tum3"),
            ("rgbd_dataset_freiburg3_sitting_rpy", "tum3"),
            ("rgbd_dataset_freiburg3_walking_static", "tum3"),
            ("rgbd_dataset_freiburg3_walking_xyz", "tum3"),
            ("rgbd_dataset_freiburg3_walking_halfsphere", "tum3"),
            ("rgbd_dataset_freiburg3_walking_rpy", "tum3"),
        ],
    },
    DataSet {
        name: "Bonn RGB-D Dynamic Dataset",
        home: "the page \"Bonn RGB-D Dynamic Dataset\" of the photogrammetry group of the University of Bonn (www.ipb.uni-bonn.de)",
        sequences: &[
            ("rgbd_bonn_balloon", "bonn"),
            ("rgbd_bonn_balloon2", "bonn"),
            ("rgbd_bonn_balloon_tracking", "bonn"),
            ("rgbd_bonn_balloon_tracking2", "bonn"),
            ("rgbd_bonn_crowd", "bonn"),
            ("rgbd_bonn_crowd2", "bonn"),
            ("rgbd_bonn_crowd3", "bonn"),
            ("rgbd_bonn_kidnapping_box", "bonn"),
            ("rgbd_bonn_kidnapping_box2", "bonn"),
            ("rgbd_bonn_moving_nonobstructing_box", "bonn"),
            ("rgbd_bonn_moving_nonobstructing_box2", "bonn"),
            ("rgbd_bonn_moving_obstructing_box", "bonn"),
            ("rgbd_bonn_moving_obstructing_box2", "bonn"),
            ("rgbd_bonn_person_tracking", "bonn"),
            ("rgbd_bonn_person_tracking2", "bonn"),
            ("rgbd_bonn_placing_nonobstructing_box", "bonn"),
            ("rgbd_bonn_placing_nonobstructing_box2", "bonn"),
            ("rgbd_bonn_placing_nonobstructing_box3", "bonn"),
            ("rgbd_bonn_placing_obstructing_box", "bonn"),
            ("rgbd_bonn_removing_nonobstructing_box", "bonn"),
            ("rgbd_bonn_removing_nonobstructing_box2", "bonn"),
            ("rgbd_bonn_removing_obstructing_box", "bonn"),
            ("rgbd_bonn_synchronous", "bonn"),
            ("rgbd_bonn_synchronous2", "bonn"),
        ],
    },
];

/// Benchmark sequences in a folder.
pub struct FoundSequences {
    /// Sequences that exist, in the order of the data sets.
    pub folders: Vec<PathBuf>,
    /// Which sequences are missing and where to get them; empty if none is missing.
    pub missing: String,
}

/// Searches for benchmark sequences in `root` and in its folders: some archives unpack into a folder of their data set.
///
/// # Errors
/// The folder cannot be read, or has no such sequence.
pub fn find(root: &Path) -> Result<FoundSequences> {
    let folders = sub_folders(root)?;
    let parents: Vec<&Path> = [root].into_iter().chain(folders.iter().map(PathBuf::as_path)).collect();
    let mut found = FoundSequences { folders: Vec::new(), missing: String::new() };
    for set in &DATA_SETS {
        let mut missing = Vec::new();
        for (name, _) in set.sequences {
            match parents.iter().map(|parent| parent.join(name)).find(|folder| is_sequence(folder)) {
                Some(folder) => found.folders.push(folder),
                None => missing.push(*name),
            }
        }
        if !missing.is_empty() {
            found.missing += &format!(
                "{}: {} of {} sequences are missing: {}. Get them from {} and unpack each as a folder of its name into {}.\n",
                set.name,
                missing.len(),
                set.sequences.len(),
                missing.join(", "),
                set.home,
                root.display()
            );
        }
    }
    ensure!(
        !found.folders.is_empty(),
        "{} holds none of the benchmark sequences\n{}",
        root.display(),
        found.missing.trim_end()
    );
    Ok(found)
}

/// Returns the folder itself if it is a sequence, else the sequences in it.
///
/// # Errors
/// The folder cannot be read, or there is no sequence.
pub fn sequences_in(folder: &Path) -> Result<Vec<PathBuf>> {
    if is_sequence(folder) {
        return Ok(vec![folder.into()]);
    }
    let sequences: Vec<PathBuf> = sub_folders(folder)?.into_iter().filter(|sub| is_sequence(sub)).collect();
    ensure!(
        !sequences.is_empty(),
        "neither {} nor any folder in it has lists of images (rgb.txt and depth.txt, or associations.txt); give a sequence in TUM or \
         Bonn layout, or a folder of sequences",
        folder.display()
    );
    Ok(sequences)
}

/// Returns the camera of a benchmark sequence, if the folder has its name and no camera file.
pub fn camera_of(folder: &Path) -> Option<&'static str> {
    let name = folder.file_name()?.to_str()?;
    let (_, camera) = DATA_SETS.iter().flat_map(|set| set.sequences).find(|(known, _)| *known == name)?;
    let has_own = ["toml", "yaml", "yml"].iter().any(|ending| folder.join(format!("camera.{ending}")).is_file());
    (!has_own).then_some(camera)
}

fn is_sequence(folder: &Path) -> bool {
    let has = |name: &str| folder.join(name).is_file();
    has("associations.txt") || (has("rgb.txt") && has("depth.txt"))
}

/// Returns the folders in a folder, sorted by name.
fn sub_folders(folder: &Path) -> Result<Vec<PathBuf>> {
    let cannot = || format!("cannot read the folder {}; check the path", folder.display());
    let mut folders = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(cannot)? {
        let path = entry.with_context(cannot)?.path();
        if path.is_dir() {
            folders.push(path);
        }
    }
    folders.sort();
    Ok(folders)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn make(root: &Path, name: &str) {
        fs::create_dir_all(root.join(name)).unwrap();
        for list in ["rgb.txt", "depth.txt"] {
            fs::write(root.join(name).join(list), "").unwrap();
        }
    }

    #[test]
    fn benchmark_sequences_are_found_and_the_missing_ones_are_listed_with_their_source() {
        let temporary = tempfile::tempdir().unwrap();
        let root = temporary.path();
        fs::create_dir_all(root.join("rgbd_bonn_crowd2")).unwrap();
        let message = find(root).err().unwrap().to_string();
        assert!(
            message.contains("none of the benchmark") && message.contains("9 of 9") && message.contains("24 of 24")
        );
        make(root, "rgbd_bonn_dataset/rgbd_bonn_crowd");
        make(root, "rgbd_dataset_freiburg3_walking_xyz");
        make(root, "elsewhere");
        let found = find(root).unwrap();
        let names: Vec<_> = found.folders.iter().map(|folder| folder.file_name().unwrap().to_str().unwrap()).collect();
        assert_eq!(names, ["rgbd_dataset_freiburg3_walking_xyz", "rgbd_bonn_crowd"]);
        assert!(found.missing.contains("8 of 9") && found.missing.contains("23 of 24"), "{}", found.missing);
        assert!(found.missing.contains("rgbd_bonn_crowd2,") && !found.missing.contains("rgbd_bonn_crowd,"));
        assert!(found.missing.contains("cvg.cit.tum.de") && found.missing.contains("ipb.uni-bonn.de"));
        assert_eq!(sequences_in(root).unwrap().len(), 2, "only those directly in the folder");
        assert!(sequences_in(&root.join("rgbd_bonn_crowd2")).err().unwrap().to_string().contains("lists of images"));
        assert!(find(&root.join("nowhere")).err().unwrap().to_string().contains("check the path"));
    }

    #[test]
    fn a_benchmark_sequence_without_a_camera_file_has_the_camera_of_its_data_set() {
        let temporary = tempfile::tempdir().unwrap();
        let folder = temporary.path().join("rgbd_bonn_crowd");
        make(temporary.path(), "rgbd_bonn_crowd");
        assert_eq!(camera_of(&folder), Some("bonn"));
        fs::write(folder.join("camera.yaml"), "").unwrap();
        assert_eq!(camera_of(&folder), None);
        assert_eq!(camera_of(Path::new("bonn_crowd_dev")), None);
        for (_, camera) in DATA_SETS.iter().flat_map(|set| set.sequences) {
            assert!(yfslam_io::camera::preset(camera).is_some(), "{camera}");
        }
    }
}

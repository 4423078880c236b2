//! Recorded sequences in which things move, by the names that their data sets give them.
//!
//! In: a folder with folders. Out: which of them are sequences, and which of the known sequences are missing.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

/// Sequences recorded by one group with one camera, or two.
pub struct DataSet {
    /// Its name.
    pub name: &'static str,
    /// Where it can be had.
    pub home: &'static str,
    /// Folder names, with the preset of the camera.
    pub sequences: &'static [(&'static str, &'static str)],
}

/// The data sets whose dynamic sequences are known, with all of these.
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

/// Known sequences in a folder.
pub struct Found {
    /// Those that are there, in the order of the data sets.
    pub folders: Vec<PathBuf>,
    /// What is missing and where it can be had; empty if nothing is.
    pub missing: String,
}

/// Seeks the known sequences in `root`, or in its folders: archives may unpack into a folder of their data set.
///
/// # Errors
/// The folder cannot be read, or none of them is there.
pub fn find(root: &Path) -> Result<Found> {
    let folders = sub_folders(root)?;
    let places: Vec<&Path> = [root].into_iter().chain(folders.iter().map(PathBuf::as_path)).collect();
    let mut found = Found { folders: Vec::new(), missing: String::new() };
    for set in &DATA_SETS {
        let mut missing = Vec::new();
        for (name, _) in set.sequences {
            match places.iter().map(|place| place.join(name)).find(|folder| is_sequence(folder)) {
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
        "{} holds none of the known sequences\n{}",
        root.display(),
        found.missing.trim_end()
    );
    Ok(found)
}

/// The sequences that are meant by a folder: itself if it has lists of images, else the folders in it that have.
///
/// # Errors
/// The folder cannot be read, or there are none.
pub fn sequences_in(folder: &Path) -> Result<Vec<PathBuf>> {
    if is_sequence(folder) {
        return Ok(vec![folder.into()]);
    }
    let sequences: Vec<PathBuf> = sub_folders(folder)?.into_iter().filter(|sub| is_sequence(sub)).collect();
    ensure!(
        !sequences.is_empty(),
        "neither {} nor any folder in it has lists of images (rgb.txt and depth.txt, or associations.txt); name a sequence in TUM or \
         Bonn layout, or a folder of such",
        folder.display()
    );
    Ok(sequences)
}

/// The camera of the sequence that has this name, if it is known and the folder has no camera file of its own.
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

/// Sorted by name.
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
    fn known_sequences_are_found_and_the_missing_ones_named_with_their_source() {
        let temporary = tempfile::tempdir().unwrap();
        let root = temporary.path();
        fs::create_dir_all(root.join("rgbd_bonn_crowd2")).unwrap();
        let message = find(root).err().unwrap().to_string();
        assert!(message.contains("none of the known") && message.contains("9 of 9") && message.contains("24 of 24"));
        make(root, "rgbd_bonn_dataset/rgbd_bonn_crowd");
        make(root, "rgbd_dataset_freiburg3_walking_xyz");
        make(root, "elsewhere");
        let found = find(root).unwrap();
        let names: Vec<_> = found.folders.iter().map(|folder| folder.file_name().unwrap().to_str().unwrap()).collect();
        assert_eq!(names, ["rgbd_dataset_freiburg3_walking_xyz", "rgbd_bonn_crowd"]);
        assert!(found.missing.contains("8 of 9") && found.missing.contains("23 of 24"), "{}", found.missing);
        assert!(found.missing.contains("rgbd_bonn_crowd2,") && !found.missing.contains("rgbd_bonn_crowd,"));
        assert!(found.missing.contains("cvg.cit.tum.de") && found.missing.contains("ipb.uni-bonn.de"));
        assert_eq!(sequences_in(root).unwrap().len(), 2, "those right in the folder");
        assert!(sequences_in(&root.join("rgbd_bonn_crowd2")).err().unwrap().to_string().contains("lists of images"));
        assert!(find(&root.join("nowhere")).err().unwrap().to_string().contains("check the path"));
    }

    #[test]
    fn a_known_sequence_without_a_camera_file_has_that_of_its_data_set() {
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

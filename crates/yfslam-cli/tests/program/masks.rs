//! `yfslam run --masks`: masks of movable objects from a folder of images.

use std::fs;
use std::path::Path;

use crate::common::{ate_rmse, fails, record, report, succeeds};
use yfslam::Image;
use yfslam_io::write::{write_color_png, write_depth_png};

/// People who walk past; without masks the error is large.
const WALKING: &str = "walking_static?people=3&share=0.4&width=320&height=240&frames=60";

/// Writes the same 16-bit mask for each of the first `count` frames of a recording.
fn mask(folder: &Path, count: usize, size: [usize; 2]) {
    let mut mask = Image::<u16>::new(size[0], size[1]);
    mask.row_mut(5).fill(300);
    for index in 0..count {
        write_depth_png(&folder.join(format!("{index}.png")), &mask).unwrap();
    }
}

#[test]
fn masks_alone_suffice_to_drop_walking_people() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    succeeds(root, &["synth", WALKING, "--out", "rec", "-q"]);
    let args = ["run", "rec", "--masks", "rec/masks", "--method", "none,full,dyna", "--out", "out"];
    let output = succeeds(root, &args);
    assert!(
        output.stderr.contains("no detector is running") && output.stderr.contains("60 of 60"),
        "{}",
        output.stderr
    );
    let [none, full, dyna] = ["none", "full", "dyna"].map(|method| report(&root.join("out").join(method)));
    assert_eq!(full["boxes"], "masks");
    assert_eq!((&full["masks"]["found"], &full["masks"]["missing"]), (&60.into(), &0.into()));
    assert_eq!(full["dynamic"]["boxes"], 0);
    for report in [&full, &dyna] {
        assert_eq!(report["frames"]["tracked"], 60);
        assert!(
            ate_rmse(report) < 0.01 && 4.0 * ate_rmse(report) < ate_rmse(&none),
            "{} {}",
            ate_rmse(report),
            ate_rmse(&none)
        );
    }
    // In reverse order, each frame has its own mask.
    succeeds(root, &["run", "rec", "--masks", "rec/masks", "--reverse", "--out", "back", "-q"]);
    assert!(ate_rmse(&report(&root.join("back"))) < 0.01);
}

#[test]
fn missing_masks_are_counted_and_a_list_may_name_them() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    record(&root.join("seq"));
    mask(&root.join("m"), 9, [320, 240]);
    let args = ["run", "seq", "--masks", "m", "--out", "out"];
    let output = succeeds(root, &args);
    assert!(output.stderr.contains("9 of 12 frames have a mask"), "{}", output.stderr);
    assert!(output.stderr.contains("3 frames have no mask") && output.stderr.contains("9.png"), "{}", output.stderr);
    assert_eq!(report(&root.join("out"))["masks"]["missing"], 3);
    // If a list exists, only the list counts.
    let first = fs::read_to_string(root.join("seq/rgb.txt")).unwrap().lines().next().unwrap().replace("rgb/0", "7");
    fs::write(root.join("m/masks.txt"), first + "\n").unwrap();
    let output = succeeds(root, &args);
    assert!(output.stderr.contains("1 of 12 frames have a mask"), "{}", output.stderr);
    fails(root, &["run", "seq", "--masks", "m", "--method", "yf"], &["yf needs boxes", "--detector"]);
}

#[test]
fn masks_that_cannot_be_used_are_reported_with_the_expected_format() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    record(&root.join("seq"));
    mask(&root.join("small"), 12, [160, 120]);
    fails(root, &["run", "seq", "--masks", "small"], &["0.png", "160×120", "320×240"]);
    fs::create_dir(root.join("empty")).unwrap();
    fails(root, &["run", "seq", "--masks", "empty"], &["none of the 12 frames", "0.png"]);
    fails(root, &["run", "seq", "--masks", "nowhere"], &["nowhere", "no such folder"]);
    fails(root, &["run", "synth:walking_xyz?frames=3", "--masks", "empty"], &["yfslam synth"]);
    // A mask of another size among usable ones: its frame is skipped and reported.
    mask(&root.join("m"), 12, [320, 240]);
    write_color_png(&root.join("m/5.png"), &Image::new(16, 16)).unwrap();
    let output = succeeds(root, &["run", "seq", "--masks", "m", "--out", "out"]);
    assert!(output.stdout.contains("1 × unusable mask") && output.stdout.contains("5.png"), "{}", output.stdout);
}

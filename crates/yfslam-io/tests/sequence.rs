//! The reader of sequences: order, parts, playing backward, and clear errors for other folders.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may")]

mod common;

use std::fs;
use std::path::Path;

use common::{real_data, write_sequence};
use proptest::prelude::*;
use yfslam_io::sequence::{FrameEntry, ImageRef};
use yfslam_io::{Sequence, SequenceOptions};

fn depth_ns(entry: &FrameEntry) -> i64 {
    entry.paired_image.as_ref().unwrap().stamp_ns
}

fn ends_with(image: &ImageRef, name: &str) -> bool {
    image.file().unwrap().ends_with(name)
}

fn refusal(folder: &Path) -> String {
    Sequence::open(folder, &SequenceOptions::default()).unwrap_err().to_string()
}

#[test]
fn a_tum_folder_is_paired_by_time() {
    let folder = tempfile::tempdir().unwrap();
    write_sequence(folder.path(), 12);
    let sequence = Sequence::open(folder.path(), &SequenceOptions::default()).unwrap();
    assert_eq!((sequence.entries.len(), sequence.report.paired, sequence.report.color_unmatched), (12, 12, 0));
    let entry = &sequence.entries[11];
    assert_eq!((entry.timestamp_ns, depth_ns(entry)), (101_100_000_000, 101_105_000_000));
    assert_eq!(entry.color.file(), Some(folder.path().join("rgb/11.png").as_path()));
    let strict = SequenceOptions { association_tolerance_ns: 4_000_000, ..Default::default() };
    let error = Sequence::open(folder.path(), &strict).unwrap_err().to_string();
    assert!(
        error.contains("4.0 ms") && error.contains("100.000000000 and 100.005000000") && error.contains("clock"),
        "{error}"
    );
}

#[test]
fn unmatched_duplicate_and_backward_images_are_counted_and_skipped() {
    let folder = tempfile::tempdir().unwrap();
    write_sequence(folder.path(), 6);
    let path = folder.path();
    fs::write(
        path.join("rgb.txt"),
        "100.0 rgb/0.png\n100.0 rgb/0.png\n100.2 rgb/2.png\n100.1 rgb/1.png\n100.5 rgb/5.png\n",
    )
    .unwrap();
    fs::write(path.join("depth.txt"), "100.005 depth/0.png\n100.205 depth/2.png\n100.3 depth/3.png\n").unwrap();
    let report = Sequence::open(path, &SequenceOptions::default()).unwrap().report;
    assert_eq!((report.color_listed, report.paired_images_listed, report.paired), (5, 3, 2));
    assert_eq!((report.duplicates_skipped, report.backward_skipped), (1, 1));
    assert_eq!((report.color_unmatched, report.paired_images_unmatched), (1, 1));
}

#[test]
fn the_pairs_of_an_associations_file_are_used_in_either_order_of_columns() {
    let folder = tempfile::tempdir().unwrap();
    write_sequence(folder.path(), 3);
    for text in [
        "# t rgb t depth\r\n100.0\trgb/0.png\t100.9\tdepth/0.png\r\n\r\n100.1 rgb/1.png 100.1 depth/1.png\r\n",
        "100.9 depth/0.png 100.0 rgb/0.png\n100.1 depth/1.png 100.1 rgb/1.png\n",
    ] {
        fs::write(folder.path().join("associations.txt"), text).unwrap();
        let sequence = Sequence::open(folder.path(), &SequenceOptions::default()).unwrap();
        assert!(sequence.report.from_associations_file);
        let first = &sequence.entries[0];
        assert_eq!((first.timestamp_ns, depth_ns(first)), (100_000_000_000, 100_900_000_000));
        let depth = &first.paired_image.as_ref().unwrap().image;
        assert!(ends_with(&first.color, "rgb/0.png") && ends_with(depth, "depth/0.png"));
    }
    fs::write(folder.path().join("associations.txt"), "1 rgb/0.png 1 depth/0.png\n2 rgb/1.png 2 depth/0.png\n")
        .unwrap();
    let sequence = Sequence::open(folder.path(), &SequenceOptions::default()).unwrap();
    assert_eq!((sequence.entries.len(), sequence.report.duplicates_skipped), (1, 1));
}

#[test]
fn a_part_is_cut_out_and_played_backward_with_ascending_stamps() {
    let folder = tempfile::tempdir().unwrap();
    write_sequence(folder.path(), 10);
    let options = SequenceOptions { start: 2, end: Some(6), reverse: true, ..Default::default() };
    let sequence = Sequence::open(folder.path(), &options).unwrap();
    let stamps: Vec<i64> = sequence.entries.iter().map(|e| e.timestamp_ns / 1_000_000).collect();
    assert_eq!(stamps, [100_200, 100_300, 100_400, 100_500]);
    assert!(ends_with(&sequence.entries[0].color, "rgb/5.png") && ends_with(&sequence.entries[3].color, "rgb/2.png"));
    assert_eq!(depth_ns(&sequence.entries[0]), 100_195_000_000);
    let mirror = sequence.mirror.unwrap();
    assert_eq!((mirror.first_ns, mirror.last_ns), (100_200_000_000, 100_500_000_000));

    for (start, end) in [(10, None), (5, Some(5)), (6, Some(3))] {
        let error = Sequence::open(folder.path(), &SequenceOptions { start, end, ..Default::default() })
            .unwrap_err()
            .to_string();
        assert!(error.contains(&format!("from frame {start} to")) && error.contains("10 frames"), "{error}");
    }
    let whole = SequenceOptions { end: Some(1000), ..Default::default() };
    assert_eq!(Sequence::open(folder.path(), &whole).unwrap().entries.len(), 10);
}

#[test]
fn folders_without_a_sequence_are_refused_with_a_cure() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    assert!(refusal(&path.join("nowhere")).contains("nowhere: "));
    assert!(
        refusal(path)
            .contains("holds no rgb.txt, no depth.txt and no associations.txt; name a folder in TUM RGB-D layout")
    );

    write_sequence(&path.join("inner"), 2);
    assert!(refusal(path).contains(&format!("did you mean {}?", path.join("inner").display())));
    let archive = path.join("rgbd.tgz");
    fs::write(&archive, "x").unwrap();
    assert!(refusal(&archive).contains("is a file, not a folder; unpack"));
    fs::write(path.join("rgb.txt"), "").unwrap();
    let text = refusal(path);
    assert!(
        text.contains("no list of depth or right images (depth.txt, right.txt)") && text.contains("--sensor mono"),
        "{text}"
    );
}

#[test]
fn empty_malformed_unsorted_and_binary_lists_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    write_sequence(folder.path(), 4);
    let list = folder.path().join("rgb.txt");
    let refusal_of = |content: &[u8]| {
        fs::write(&list, content).unwrap();
        refusal(folder.path())
    };
    assert!(refusal_of(b"# nothing\n").contains("rgb.txt: lists no image"));
    assert!(refusal_of(b"100.0 rgb/0.png\n100.1\n").contains("rgb.txt:2"));
    assert!(refusal_of(b"nan rgb/0.png\n").contains("lists no image with a time stamp"));
    assert!(refusal_of(b"5 a\n4 a\n3 a\n2 a\n").contains("3 of its 4 stamps run backward; sort"));
    assert!(refusal_of(b"\xff\xfe1\x00").contains("not UTF-8"));
    fs::write(folder.path().join("associations.txt"), "\n").unwrap();
    assert!(refusal(folder.path()).contains("associations.txt: lists no image"));
}

#[test]
fn missing_images_are_counted_and_a_sequence_without_any_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    write_sequence(folder.path(), 3);
    fs::remove_file(folder.path().join("depth/1.png")).unwrap();
    assert_eq!(Sequence::open(folder.path(), &SequenceOptions::default()).unwrap().report.missing_files, 1);
    fs::remove_dir_all(folder.path().join("rgb")).unwrap();
    let error = refusal(folder.path());
    assert!(
        error.contains("none of its 3 frames") && error.contains("rgb/0.png") && error.contains("unpack"),
        "{error}"
    );
}

#[test]
fn a_negative_tolerance_is_refused() {
    let options = SequenceOptions { association_tolerance_ns: -1, ..Default::default() };
    assert!(Sequence::open(Path::new("."), &options).unwrap_err().to_string().contains("-1 ns"));
}

#[test]
fn association_of_the_development_recordings_equals_their_published_pairs() {
    for name in ["rgbd/tum_fr1_xyz_dev", "rgbd/bonn_crowd_dev"] {
        let Some(folder) = real_data(name) else { return };
        let published = Sequence::open(&folder, &SequenceOptions::default()).unwrap();
        assert!(published.report.from_associations_file);
        let lists = tempfile::tempdir().unwrap();
        for file in ["rgb.txt", "depth.txt"] {
            fs::copy(folder.join(file), lists.path().join(file)).unwrap();
        }
        for images in ["rgb", "depth"] {
            std::os::unix::fs::symlink(folder.join(images), lists.path().join(images)).unwrap();
        }
        let ours = Sequence::open(lists.path(), &SequenceOptions::default()).unwrap();
        let stamps = |s: &Sequence| s.entries.iter().map(|e| (e.timestamp_ns, depth_ns(e))).collect::<Vec<_>>();
        assert_eq!(stamps(&ours), stamps(&published), "{name}");
    }
}

/// Generates a list with one or two images per line, and some lines of arbitrary text.
fn list_text(images_a_line: usize) -> impl Strategy<Value = String> {
    let stamp = "[0-9]{1,2}|-?[0-9]{8,9}\\.[0-9]{1,9}";
    let image = (stamp, "(rgb/0|depth/0|rgb/1|x)\\.png").prop_map(|(stamp, file)| format!("{stamp} {file}"));
    let line = prop::collection::vec(image, images_a_line).prop_map(|images| images.join(" "));
    let lines = prop::collection::vec(prop_oneof![40 => line, 1 => ".{0,20}"], 0..12);
    lines.prop_map(|lines| lines.join("\n"))
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(200) })]
    #[test]
    fn a_folder_of_arbitrary_lists_never_panics_and_every_image_is_counted(
        (rgb, depth, associations) in (list_text(1), list_text(1), list_text(2)),
        with_associations: bool,
        reverse: bool,
        tolerance in prop_oneof![0..1i64 << 34, 0..=i64::MAX],
    ) {
        let folder = tempfile::tempdir().unwrap();
        write_sequence(folder.path(), 1);
        fs::write(folder.path().join("rgb.txt"), rgb).unwrap();
        fs::write(folder.path().join("depth.txt"), depth).unwrap();
        if with_associations {
            fs::write(folder.path().join("associations.txt"), associations).unwrap();
        }
        let options = SequenceOptions { association_tolerance_ns: tolerance, reverse, ..Default::default() };
        if let Ok(sequence) = Sequence::open(folder.path(), &options) {
            prop_assert!(sequence.entries.windows(2).all(|w| w[0].timestamp_ns < w[1].timestamp_ns));
            let report = &sequence.report;
            prop_assert_eq!(report.paired, sequence.entries.len());
            let skipped = report.duplicates_skipped + report.backward_skipped;
            let unmatched = report.color_unmatched + report.paired_images_unmatched;
            let accounted = match report.from_associations_file {
                true => 2 * (report.paired + skipped),
                false => 2 * report.paired + skipped + unmatched,
            };
            prop_assert_eq!(report.color_listed + report.paired_images_listed, accounted);
            let _ = sequence.info();
        }
    }
}

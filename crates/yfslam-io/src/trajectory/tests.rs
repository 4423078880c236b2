use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use proptest::prelude::*;

use super::*;

fn parse(text: &str) -> Result<TrajectoryFile> {
    TrajectoryFile::parse(text, Path::new("groundtruth.txt"))
}

fn refusal(text: &str) -> String {
    parse(text).unwrap_err().to_string()
}

const GOOD: &str = "# ground truth\r\n1305031101.1759 1.3812 0.6186 1.6987 0.6520 0.6182 -0.2954 -0.3248\r\n\n\
    1.305031102175899982e+09\t0 0 0 0 0 0 1\n";

#[test]
fn comments_crlf_tabs_and_exponents_are_read() {
    let file = parse(GOOD).unwrap();
    assert_eq!(file.poses.len(), 2);
    assert_eq!(file.poses[0].timestamp_ns, 1_305_031_101_175_900_000);
    assert_eq!(file.poses[0].t_world_cam.translation.vector.as_slice(), [1.3812, 0.6186, 1.6987]);
    assert!(
        (file.poses[0].t_world_cam.rotation.w + 0.3248).abs() < 1e-4
            && (file.poses[0].t_world_cam.rotation.norm() - 1.0).abs() < 1e-12
    );
    assert_eq!(file.poses[1].timestamp_ns, 1_305_031_102_175_899_982);
}

#[test]
fn malformed_poses_are_refused_with_line_and_value() {
    for (line, expected) in [
        ("1 nan 0 0 0 0 0 1", "tx is 'nan'"),
        ("1 0 0 inf 0 0 0 1", "tz is 'inf'"),
        ("1 0 0 0 0 0 0 x", "qw is 'x'"),
        ("NaN 0 0 0 0 0 0 1", "stamp 'NaN'"),
        ("1 0 0 0 0 0 1", "7 columns, not 8"),
        ("1 0 0 0 0 0 0 1 9", "9 columns, not 8"),
        ("1 0 0 0 0 0 0 0", "length 0.000"),
        ("1 0 0 0 0 1 1 1", "length 1.732"),
    ] {
        let error = refusal(&format!("{GOOD}{line}\n"));
        assert!(error.starts_with("groundtruth.txt:5: ") && error.contains(expected), "{error}");
    }
    assert!(refusal("# nothing\n").contains("contains no pose"));
    assert!(TrajectoryFile::read(Path::new("/nowhere/x.txt")).unwrap_err().to_string().contains("/nowhere/x.txt"));
}

#[test]
fn repeated_and_backward_stamps_are_skipped_and_counted() {
    let lines: String = ["1", "2", "2", "9", "3", "4"].iter().map(|t| format!("{t} {t} 0 0 0 0 0 1\n")).collect();
    let file = parse(&lines).unwrap();
    assert_eq!((file.poses.len(), file.duplicates_skipped, file.backward_skipped), (4, 1, 1));
    let unsorted =
        parse("4 4 0 0 0 0 0 1\n3 3 0 0 0 0 0 1\n2 2 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 9 0 0 0 0 0 1\n").unwrap();
    let found: Vec<f64> = unsorted.poses.iter().map(|pose| pose.t_world_cam.translation.x).collect();
    assert_eq!((found, unsorted.duplicates_skipped), (vec![1.0, 2.0, 3.0, 4.0], 1));
    assert!(unsorted.notes[0].contains("sorted"), "{:?}", unsorted.notes);
}

#[test]
fn a_mirrored_trajectory_ascends_and_keeps_its_poses() {
    let lines: String = (1..=3).map(|t| format!("{t} {t} 0 0 0 0 0 1\n")).collect();
    let poses = parse(&lines).unwrap().poses;
    let mirrored = mirror_trajectory(&poses, TimeMirror { first_ns: 1_000_000_000, last_ns: 4_000_000_000 });
    let seen: Vec<_> = mirrored.iter().map(|p| (p.timestamp_ns / 1_000_000_000, p.t_world_cam.translation.x)).collect();
    assert_eq!(seen, [(2, 3.0), (3, 2.0), (4, 1.0)]);
}

#[test]
fn a_pose_that_is_not_finite_is_never_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("poses.txt");
    let pose = StampedPose::new(5, Isometry3::translation(f64::NAN, 0.0, 0.0));
    let error = write_trajectory(&path, &[pose]).unwrap_err().to_string();
    assert!(error.contains("poses.txt") && error.contains("0.000000005"), "{error}");
    assert!(!path.exists());
}

/// Two poses in every format: the second is turned by 90° about x.
const HALF: &str = "0.7071067811865476";

#[test]
fn the_formats_of_tum_euroc_and_kitti_give_the_same_poses() {
    let tum = format!("1403636579.763555584 1 2 3 0 0 0 1\n1403636579.813555456 4 5 6 {HALF} 0 0 {HALF}\n");
    let comma = tum.replace(' ', ",");
    let euroc = format!(
        "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v [m s^-1]\n\
         1403636579763555584,1,2,3,1,0,0,0,0.5\n1403636579813555456,4,5,6,{HALF},{HALF},0,0,0.5\n"
    );
    let short = format!("1403636579763555584,1,2,3,1,0,0,0\n1403636579813555456,4,5,6,{HALF},{HALF},0,0\n");
    let named = format!(
        "ts (ns),tx (m),ty (m),tz (m),qx,qy,qz,qw\n1403636579763555584,1,2,3,0,0,0,1\n1403636579813555456,4,5,6,{HALF},0,0,{HALF}\n"
    );
    let wanted = parse(&tum).unwrap();
    for (text, format) in [
        (comma, TrajectoryFormat::Tum),
        (euroc, TrajectoryFormat::Euroc),
        (short, TrajectoryFormat::Euroc),
        (named, TrajectoryFormat::Tum),
    ] {
        let file = parse(&text).unwrap();
        assert_eq!((&file.poses, file.format), (&wanted.poses, format), "{text}");
    }
    let kitti = parse("1 0 0 1 0 1 0 2 0 0 1 3\n1 0 0 4 0 0 -1 5 0 1 0 6\n").unwrap();
    let full = parse("1 0 0 1 0 1 0 2 0 0 1 3 0 0 0 1\n1 0 0 4 0 0 -1 5 0 1 0 6 0 0 0 1\n").unwrap();
    let times: Vec<i64> = wanted.poses.iter().map(|pose| pose.timestamp_ns).collect();
    for file in [kitti, full] {
        assert!(file.format == TrajectoryFormat::Kitti && file.notes[0].contains("no times"));
        let file = file.with_times(&times, Path::new("times.txt")).unwrap();
        for (found, wanted) in file.poses.iter().zip(&wanted.poses) {
            assert_eq!(found.timestamp_ns, wanted.timestamp_ns);
            let apart = found.t_world_cam.inverse() * wanted.t_world_cam;
            assert!(apart.translation.vector.norm() < 1e-12 && apart.rotation.angle() < 1e-7);
        }
        assert!(file.with_times(&[1], Path::new("times.txt")).unwrap_err().to_string().contains("1 times"));
    }
    assert!(refusal("1 0 0 1 0 1 0 2 0 0 2 3\n").contains("orthonormal"));
    assert!(refusal("1 0 0 1 0 1 0 2 0 0 1 3\n1 0 0 0 0 0 0 1\n").contains("8 columns, not 12"));
}

#[test]
fn every_format_that_is_written_is_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let pose = |t: i64| {
        let pose = Isometry3::new(
            nalgebra::Vector3::new(t as f64, -0.25, 1e-3),
            nalgebra::Vector3::new(0.3, -0.2, 0.1 * t as f64),
        );
        StampedPose::new(t * KITTI_PERIOD_NS, pose)
    };
    let poses: Vec<StampedPose> = (0..5).map(pose).collect();
    for (format, read_as) in [
        (TrajectoryFormat::Tum, TrajectoryFormat::Tum),
        (TrajectoryFormat::Euroc, TrajectoryFormat::Euroc),
        (TrajectoryFormat::Kitti, TrajectoryFormat::Kitti),
        (TrajectoryFormat::VslamLab, TrajectoryFormat::Tum),
    ] {
        let path = folder.path().join("poses.txt");
        write_trajectory_as(&path, &poses, format).unwrap();
        let file = TrajectoryFile::read(&path).unwrap();
        assert_eq!(file.format, read_as);
        for (found, wanted) in file.poses.iter().zip(&poses) {
            assert_eq!(found.timestamp_ns, wanted.timestamp_ns, "{format:?}");
            let apart = found.t_world_cam.inverse() * wanted.t_world_cam;
            assert!(apart.translation.vector.norm() < 1e-8 && apart.rotation.angle() < 1e-7, "{format:?}: {apart}");
        }
    }
}

proptest! {
    #[test]
    fn what_is_written_is_read_again(raw in prop::collection::vec((0i64..1 << 60, prop::array::uniform6(-9.0..9.0f64)), 1..20)) {
        let mut poses: Vec<_> = raw
            .into_iter()
            .map(|(timestamp_ns, [x, y, z, a, b, c])| {
                let rotation = UnitQuaternion::from_euler_angles(a, b, c);
                StampedPose::new(timestamp_ns, Isometry3::from_parts(Translation3::new(x, y, z), rotation))
            })
            .collect();
        poses.sort_by_key(|p| p.timestamp_ns);
        poses.dedup_by_key(|p| p.timestamp_ns);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("poses.txt");
        write_trajectory(&path, &poses).unwrap();
        let read = TrajectoryFile::read(&path).unwrap();
        prop_assert_eq!(read.poses.len(), poses.len());
        for (read, written) in read.poses.iter().zip(&poses) {
            prop_assert_eq!(read.timestamp_ns, written.timestamp_ns);
            prop_assert!((read.t_world_cam.translation.vector - written.t_world_cam.translation.vector).norm() < 2e-9);
            prop_assert!(read.t_world_cam.rotation.angle_to(&written.t_world_cam.rotation) < 2e-8);
        }
    }

    #[test]
    fn arbitrary_text_never_panics(text in "([0-9]{1,3} ){0,9}|([-0-9.e \tnaif\n#]|.){0,200}") {
        let _ = parse(&text);
    }
}

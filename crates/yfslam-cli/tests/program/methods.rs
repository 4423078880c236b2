//! Several methods in one run: each has the results of a separate run.

use std::fs;
use std::path::Path;

use crate::common::{ate_rmse, fails, record, report, succeeds};

/// People who walk through the image; small enough to be quick.
const WALKING: &str = "synth:walking_xyz?people=2&share=0.3&width=320&height=240&frames=30";

const METHODS: [&str; 3] = ["none", "boxes", "yf"];

/// Runs all methods together and each alone, and compares what depends on the input and the configuration alone.
fn assert_same_together_and_alone(folder: &Path, args: &[&str]) {
    succeeds(folder, &[args, &["--method", "none,boxes,yf,none", "--out", "all", "-q"]].concat());
    for method in METHODS {
        succeeds(folder, &[args, &["--method", method, "--out", method, "-q"]].concat());
        let (together, alone) = (folder.join("all").join(method), folder.join(method));
        for name in ["trajectory.txt", "keyframes.txt", "live.txt", "map.ply", "config.toml"] {
            assert_eq!(fs::read(together.join(name)).unwrap(), fs::read(alone.join(name)).unwrap(), "{method}: {name}");
        }
        let (together, alone) = (report(&together), report(&alone));
        for key in ["evaluation", "frames", "boxes", "config", "loops_and_relocalisation", "map"] {
            assert_eq!(together[key], alone[key], "{method}: {key}");
        }
        assert_eq!(together["dynamic"]["dynamic_features"], alone["dynamic"]["dynamic_features"], "{method}");
    }
}

#[test]
fn methods_run_together_give_the_results_of_separate_runs_also_with_faults() {
    let folder = tempfile::tempdir().unwrap();
    let faults = ["--fault", "repeated@0.3+0.1", "--fault", "covered@0.6+0.1", "--overlay"];
    assert_same_together_and_alone(folder.path(), &[&["run", WALKING][..], &faults].concat());
    for method in METHODS {
        let images = fs::read_dir(folder.path().join("all").join(method).join("overlay")).unwrap();
        assert!(images.count() > 20, "{method}");
    }
    assert!(!folder.path().join("all/report.html").exists() && !folder.path().join("all/trajectory.txt").exists());
    // The next run in the same folder has one method: nothing of the earlier one stays, but for what is not of a run.
    fs::write(folder.path().join("all/none/notes.txt"), "mine").unwrap();
    succeeds(folder.path(), &["run", WALKING, "--end", "3", "--out", "all", "-q"]);
    for method in METHODS {
        let left: Vec<_> =
            fs::read_dir(folder.path().join("all").join(method)).unwrap().flatten().map(|e| e.file_name()).collect();
        let expected: &[&str] = if method == "none" { &["config.toml", "notes.txt"] } else { &["config.toml"] };
        assert_eq!(left.len(), expected.len(), "{method}: {left:?}");
        assert!(expected.iter().all(|name| left.iter().any(|l| l == name)), "{method}: {left:?}");
    }
}

#[test]
fn methods_that_share_a_detector_give_the_results_of_separate_runs() {
    let folder = tempfile::tempdir().unwrap();
    assert_same_together_and_alone(folder.path(), &["run", WALKING, "--detector", "embedded"]);
    let all = folder.path().join("all");
    let detections = |method: &str| report(&all.join(method))["times"]["detector"]["count"].as_u64();
    assert_eq!(METHODS.map(detections), [None, Some(30), Some(30)]);
    assert_eq!(report(&all.join("yf"))["boxes"]["detector"]["file"], "embedded");
    assert_eq!(report(&all.join("none"))["boxes"], "none");
    // The network detects some of the people.
    assert!(report(&all.join("yf"))["dynamic"]["dynamic_features"].as_u64().unwrap() > 0);
}

#[test]
#[ignore = "long: see CONTRIBUTING.md"]
fn images_of_a_rolled_camera_are_turned_upright_for_the_detector_for_one_method_and_for_several() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let world = WALKING.replace("walking_xyz", "walking_rpy").replace("frames=30", "frames=60");
    for (name, limit) in [("turned", 4.0), ("never", 180.0)] {
        fs::create_dir(root.join(name)).unwrap();
        fs::write(root.join(name).join("roll.toml"), format!("[dynamic]\nroll_compensation_deg = {limit:?}\n"))
            .unwrap();
        let args = ["run", &world, "--detector", "embedded", "--config", "roll.toml"];
        assert_same_together_and_alone(&root.join(name), &args);
    }
    let trajectory = |name: &str| fs::read(root.join(name).join("yf/trajectory.txt")).unwrap();
    assert_ne!(trajectory("turned"), trajectory("never"));
}

#[test]
fn detection_on_every_third_frame_works_for_one_method_and_for_several() {
    let folder = tempfile::tempdir().unwrap();
    assert_same_together_and_alone(folder.path(), &["run", WALKING, "--detector", "embedded", "--detect-every", "3"]);
    for out in ["yf", "all/yf"] {
        let report = report(&folder.path().join(out));
        assert_eq!(report["times"]["detector"]["count"].as_u64(), Some(10), "{out}");
        assert_eq!(report["config"]["dynamic"]["detect_every"].as_u64(), Some(3));
    }
}

#[test]
fn detection_every_three_seconds_is_enough_to_track_walking_people() {
    let folder = tempfile::tempdir().unwrap();
    for (world, limit_m) in [("walking_xyz", 0.02), ("walking_static", 0.02)] {
        let spec = format!("synth:{world}?width=320&height=240&fps=15&frames=45");
        succeeds(folder.path(), &["run", &spec, "--detect-every", "45", "--out", world, "-q"]);
        let report = report(&folder.path().join(world));
        assert_eq!(report["frames"]["tracked"], 45, "{world}");
        // Without tracks of people it is 0.1 to 0.3 m.
        assert!(ate_rmse(&report) < limit_m, "{world}: {}", ate_rmse(&report));
    }
}

#[test]
fn an_image_that_people_cover_by_four_fifths_is_tracked() {
    let folder = tempfile::tempdir().unwrap();
    let world = "synth:walking_static?people=6&share=0.8&frames=45";
    succeeds(folder.path(), &["run", world, "--out", "out", "-q"]);
    let report = report(&folder.path().join("out"));
    assert_eq!(report["frames"]["tracked"], 45);
    assert!(ate_rmse(&report) < 0.05, "{}", ate_rmse(&report));
}

#[test]
fn the_network_in_the_program_detects_people_in_a_recording_without_boxes() {
    let folder = tempfile::tempdir().unwrap();
    record(&folder.path().join("seq"));
    let output = succeeds(folder.path(), &["run", "seq", "--out", "out"]);
    assert!(output.stderr.contains("the network in this program"), "{}", output.stderr);
    let identity = report(&folder.path().join("out"))["boxes"]["detector"].clone();
    let version = succeeds(folder.path(), &["--version"]).stdout;
    let hash = identity["sha256"].as_str().unwrap();
    assert!(hash.len() == 64 && version.contains(hash), "{version} {identity}");
    // The same network, given as a file.
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/../yfslam-detect/models/person.onnx");
    succeeds(folder.path(), &["run", "seq", "--detector", model, "--out", "given", "-q"]);
    let given = report(&folder.path().join("given"))["boxes"]["detector"].clone();
    assert_eq!((&given["file"], &given["sha256"]), (&model.into(), &identity["sha256"]));
}

#[test]
fn methods_are_compared_on_a_recording_as_on_a_world() {
    let folder = tempfile::tempdir().unwrap();
    let world = WALKING.trim_start_matches("synth:");
    succeeds(folder.path(), &["synth", world, "--out", "rec", "-q"]);
    let output = succeeds(folder.path(), &["run", "rec", "--method", "none,yf", "--report", "--out", "out"]);
    for words in ["boxes: exact, from the recording's boxes.json", "less RMSE (%)", "30 of 30"] {
        assert!(output.stdout.contains(words), "no '{words}' in {}", output.stdout);
    }
    let html = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(html.contains("Configuration of none") && html.contains("Configuration of yf"));
}

#[test]
fn a_method_that_fails_writes_the_reason_to_its_folder_and_does_not_stop_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let seq = folder.path().join("seq");
    record(&seq);
    // One person fills every image: the method `boxes` has no feature, and `none` does not use the boxes.
    let stamps = fs::read_to_string(seq.join("rgb.txt")).unwrap();
    let frame = |line: &str| {
        let stamp = line.split_once(' ').unwrap().0.replace('.', "");
        let bbox = r#"[{"instance":1,"class":"person","bbox":[0,0,320,240]}]"#;
        format!(r#"{{"timestamp_ns":{},"boxes":{bbox}}}"#, stamp.parse::<i64>().unwrap())
    };
    let frames: Vec<_> = stamps.lines().map(frame).collect();
    let everywhere = format!(r#"{{"classes":["person"],"frames":[{}]}}"#, frames.join(","));
    fs::write(seq.join("boxes.json"), everywhere).unwrap();
    fs::write(folder.path().join("strict.toml"), "[dynamic]\nmin_trusted = 0\n").unwrap();
    let args = ["run", "seq", "--overlay", "--out", "out", "--method", "none,boxes", "--config", "strict.toml"];
    let output = succeeds(folder.path(), &args);
    assert!(output.stderr.contains("warning: boxes: no trajectory"), "{}", output.stderr);
    assert_eq!(report(&folder.path().join("out/none"))["frames"]["tracked"], 12);
    assert!(!folder.path().join("out/boxes/run.json").exists());
    let failure = folder.path().join("out/boxes/failure.txt");
    assert!(fs::read_to_string(&failure).unwrap().contains("no trajectory"));
    fs::write(seq.join("boxes.json"), r#"{"classes":["person"],"frames":[]}"#).unwrap();
    succeeds(folder.path(), &args);
    assert!(!failure.exists());
    // A file in place of a folder is found before the run.
    fs::remove_dir_all(folder.path().join("out/none/overlay")).unwrap();
    fs::write(folder.path().join("out/none/overlay"), "").unwrap();
    fails(folder.path(), &args, &["out/none/overlay cannot be used", "a part of this path is a file"]);
    fs::remove_file(folder.path().join("out/none/overlay")).unwrap();
    // Faulty frames fail every method.
    let black = [&args[..], &["--fault", "black@0+9"]].concat();
    fails(folder.path(), &black, &["none: no trajectory", "boxes: no trajectory", "no method has a trajectory"]);
}

#[test]
fn options_for_one_method_are_refused_with_several() {
    let folder = tempfile::tempdir().unwrap();
    for (options, word) in [
        (&["--save-map", "a.map"][..], "--save-map"),
        (&["--threaded"], "--threaded"),
        (&["--load-map", "a.map", "--localise"], "--load-map"),
    ] {
        let args = [&["run", WALKING, "--method", "none,yf"], options].concat();
        fails(folder.path(), &args, &[word, "several methods", "give one --method"]);
    }
    fails(folder.path(), &["run", WALKING, "--method", "none,orb"], &["orb", "boxes"]);
}

/// Short forms of worlds of the suite in which tracking without a filter has a large error.
const CHAIR: &str = "synth:pushed_chair?width=320&height=240&fps=15";
const STATIC: &str = "synth:walking_static?width=320&height=240&fps=15&frames=40";

#[test]
#[ignore = "long: see CONTRIBUTING.md"]
fn dyna_drops_people_with_and_without_boxes_and_ds_needs_the_boxes() {
    let folder = tempfile::tempdir().unwrap();
    let of = |out: &str, method: &str| report(&folder.path().join(out).join(method));
    let chair = format!("{CHAIR}&frames=40");
    succeeds(folder.path(), &["run", &chair, "--method", "none,dyna", "--out", "boxes", "-q"]);
    let [none, dyna] = ["none", "dyna"].map(|method| ate_rmse(&of("boxes", method)));
    assert!(4.0 * dyna < none && dyna < 0.01, "dyna {dyna} m, none {none} m");
    // Boxes of robots, of which there are none: only geometry finds what moves.
    fs::write(folder.path().join("blind.toml"), "[dynamic]\nmovable = [\"robot\"]\n").unwrap();
    let chair = format!("{CHAIR}&frames=60");
    let blind = ["run", &chair, "--method", "none,ds,dyna", "--config", "blind.toml", "--out", "blind", "-q"];
    succeeds(folder.path(), &blind);
    let [none, ds, dyna] = ["none", "ds", "dyna"].map(|method| ate_rmse(&of("blind", method)));
    assert!(dyna < 0.7 * none && ds == none, "dyna {dyna} m, ds {ds} m, none {none} m");
    let counts = &of("blind", "dyna")["dynamic"];
    assert!(counts["boxes"] == 0 && counts["dynamic_features"].as_u64().unwrap() > 0, "{counts}");
}

#[test]
fn ds_drops_people_who_walk_in_front_of_a_static_camera() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(folder.path(), &["run", STATIC, "--method", "none,ds", "--out", "out", "-q"]);
    let [none, ds] = ["none", "ds"].map(|method| ate_rmse(&report(&folder.path().join("out").join(method))));
    assert!(4.0 * ds < none, "ds {ds} m, none {none} m");
}

#[test]
fn dms_runs_without_boxes_and_without_a_network() {
    let folder = tempfile::tempdir().unwrap();
    let output =
        succeeds(folder.path(), &["run", WALKING, "--method", "dms", "--detector", "embedded", "--out", "out"]);
    assert!(!output.stderr.contains("network"), "{}", output.stderr);
    let report = report(&folder.path().join("out"));
    assert_eq!((&report["boxes"], &report["frames"]["tracked"]), (&"none".into(), &30.into()));
    assert!(report["times"].get("detector").is_none() && report["dynamic"]["boxes"] == 0);
    assert!(report["dynamic"]["dynamic_features"].as_u64().unwrap() > 0);
}

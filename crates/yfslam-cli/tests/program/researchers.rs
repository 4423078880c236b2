//! Camera files of other programs in a run, and what `eval` and `convert` offer for trajectories of other systems.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use crate::common::{fails, record, report, succeeds};
use serde_json::Value;

/// Settings of ORB-SLAM for the camera of the small world, without size and depth factor.
fn settings(folder: &Path) -> String {
    let toml: toml::Table = fs::read_to_string(folder.join("camera.toml")).unwrap().parse().unwrap();
    let mut text = "%YAML:1.0\n".to_owned();
    for key in ["fx", "fy", "cx", "cy", "bf", "fps"] {
        writeln!(text, "Camera.{key}: {}", toml[key].as_float().unwrap()).unwrap();
    }
    text
}

#[test]
fn a_file_without_size_and_depth_factor_gives_the_trajectory_of_the_complete_one() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    record(&folder.join("seq"));
    fs::write(folder.join("orb.yaml"), settings(&folder.join("seq"))).unwrap();
    succeeds(folder, &["run", "seq", "--method", "none", "--out", "own"]);
    let args = ["run", "seq", "--method", "none", "--camera", "orb.yaml"];
    fails(folder, &args, &["orb.yaml", "depth factor is missing", "--depth-factor"]);
    let output = succeeds(folder, &[&args[..], &["--depth-factor", "5000", "--out", "orb"]].concat());
    assert!(output.stderr.contains("320×240 px"), "{}", output.stderr);
    let trajectory = |out: &str| fs::read_to_string(folder.join(out).join("trajectory.txt")).unwrap();
    assert_eq!(trajectory("own"), trajectory("orb"));

    let plain = succeeds(folder, &["run", "seq", "--method", "none", "--out", "plain"]).stderr;
    assert!(!plain.contains("is used, not"), "{plain}");
    let mut toml = fs::read_to_string(folder.join("seq/camera.toml")).unwrap();
    toml = toml.replace("depth_factor = 5000.0", "depth_factor = 4000.0").replace("cy = 1", "cy = 2");
    assert!(toml.contains("4000") && toml.contains("cy = 2"), "{toml}");
    fs::write(folder.join("other.toml"), toml).unwrap();
    let output = succeeds(
        folder,
        &["run", "seq", "--method", "none", "--camera", "other.toml", "--depth-factor", "5000", "--out", "x"],
    );
    for words in ["--depth-factor 5000 is used, not its own factor 4000", "not the camera file of the folder"] {
        assert!(output.stderr.contains(words), "{}", output.stderr);
    }
    assert_eq!(report(&folder.join("x"))["frames"]["tracked"], 12);
}

#[test]
fn stereo_needs_a_baseline_and_stereo_and_mono_need_no_depth_factor() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let world = "walking_xyz?people=0&width=320&height=240&frames=12&stereo=0.11";
    succeeds(folder, &["synth", world, "--out", "seq"]);
    let settings = settings(&folder.join("seq"));
    let without = settings.lines().filter(|line| !line.starts_with("Camera.bf")).collect::<Vec<_>>().join("\n") + "\n";
    let second = without.replace("%YAML:1.0\n", "").replace("Camera.", "Camera2.");
    let pair = |turn: &str| {
        let motion = format!("1.0, {turn}, 0.0, 0.11, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0");
        format!("{without}{second}Stereo.T_c1_c2: !!opencv-matrix\n  rows: 4\n  cols: 4\n  dt: f\n  data: [{motion}]\n")
    };
    for (name, text) in [("bf", &settings), ("nobf", &without), ("pair", &pair("0.0")), ("turned", &pair("0.1"))] {
        fs::write(folder.join(format!("{name}.yaml")), text).unwrap();
    }
    let run = |camera: &str, out: &str| {
        succeeds(folder, &["run", "seq", "--method", "none", "--camera", camera, "--out", out]);
        fs::read_to_string(folder.join(out).join("trajectory.txt")).unwrap()
    };
    assert_eq!(run("bf.yaml", "bf"), run("pair.yaml", "pair"));
    let args = |camera| ["run", "seq", "--method", "none", "--camera", camera];
    fails(folder, &args("nobf.yaml"), &["nobf.yaml", "baseline of the stereo camera is missing", "Stereo.b"]);
    fails(folder, &args("turned.yaml"), &["turned.yaml", "Camera2.fx", "rectify"]);
    fails(folder, &args("tum3"), &["preset tum3", "baseline"]);
    // A single camera needs neither; twelve frames are too few for a map of its own.
    fails(folder, &[&args("nobf.yaml")[..], &["--sensor", "mono"]].concat(), &["no map could be initialised"]);
}

#[test]
fn a_camera_file_is_printed_as_toml_that_is_read_again() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    fs::write(
        folder.join("k.yaml"),
        "cam0:\n  intrinsics: [500, 501, 320, 240]\n  resolution: [640, 480]\n  rostopic: /cam\n",
    )
    .unwrap();
    let text = succeeds(folder, &["camera", "k.yaml", "--depth-factor", "1000"]).stdout;
    assert!(
        text.contains("Kalibr camchain") && text.contains("not used: cam0.rostopic") && text.contains("fx = 500.0"),
        "{text}"
    );
    fs::write(folder.join("camera.toml"), &text).unwrap();
    let again = succeeds(folder, &["camera", "camera.toml"]).stdout;
    let keys = |text: &str| text.lines().filter(|line| !line.starts_with('#')).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(keys(&text), keys(&again));
    assert!(succeeds(folder, &["camera", "d435i"]).stdout.contains("typical values"));
    fails(folder, &["camera", "d436"], &["d436", "d435i"]);
}

/// A curve in the three formats; `shift` moves every second pose.
fn formats(folder: &Path, name: &str, shift: f64) {
    let (mut tum, mut euroc, mut kitti) =
        (String::new(), "#timestamp [ns],x,y,z,qw,qx,qy,qz\n".to_owned(), String::new());
    for i in 0..40u32 {
        let angle = f64::from(i) * 0.1;
        let (x, y, z) = (angle.cos(), angle.sin(), 0.3 * angle + if i % 2 == 0 { shift } else { -shift });
        writeln!(tum, "{:.1} {x} {y} {z} 0 0 0 1", f64::from(i) * 0.1).unwrap();
        writeln!(euroc, "{},{x},{y},{z},1,0,0,0", u64::from(i) * 100_000_000).unwrap();
        writeln!(kitti, "1 0 0 {x} 0 1 0 {y} 0 0 1 {z}").unwrap();
    }
    for (ending, text) in [("tum", tum), ("csv", euroc), ("kitti", kitti)] {
        fs::write(folder.join(format!("{name}.{ending}")), text).unwrap();
    }
}

fn ate(folder: &Path, args: &[&str]) -> f64 {
    let output = succeeds(folder, &[args, &["--json"]].concat());
    let json: Value = serde_json::from_str(&output.stdout).unwrap();
    json["estimate"]["ate"]["translation_m"]["rmse"].as_f64().unwrap()
}

#[test]
fn eval_gives_the_same_errors_for_every_format() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    formats(folder, "truth", 0.0);
    formats(folder, "estimate", 0.01);
    let wanted = ate(folder, &["eval", "truth.tum", "estimate.tum"]);
    for (truth, estimate) in [("csv", "tum"), ("tum", "csv"), ("csv", "csv"), ("kitti", "kitti")] {
        let found = ate(folder, &["eval", &format!("truth.{truth}"), &format!("estimate.{estimate}")]);
        assert!((found - wanted).abs() < 1e-12, "{truth} {estimate}: {found}");
    }
    fails(folder, &["eval", "truth.tum", "estimate.kitti"], &["estimate.kitti", "no times", "--times"]);
    let times: String = (0..40).map(|i| format!("{:.1}\n", f64::from(i) * 0.1)).collect();
    fs::write(folder.join("times.txt"), times).unwrap();
    assert!((ate(folder, &["eval", "truth.tum", "estimate.kitti", "--times", "times.txt"]) - wanted).abs() < 1e-12);
    // Without an alignment, the shift of every pose is the error.
    assert!((ate(folder, &["eval", "truth.tum", "estimate.tum", "--align", "none"]) - 0.01).abs() < 1e-9);
    let origin = ate(folder, &["eval", "truth.tum", "estimate.tum", "--align", "origin"]);
    assert!((origin - 0.02 * 0.5f64.sqrt()).abs() < 1e-9, "{origin}");

    let table = succeeds(folder, &["eval", "truth.tum", "estimate.tum"]).stdout;
    assert!(
        table.contains("ATE, SE(3) (m)") && table.contains("ATE, Sim(3) (m)") && table.contains("scale s = "),
        "{table}"
    );
    let swapped = succeeds(folder, &["eval", "estimate.tum", "truth.tum"]).stderr;
    assert!(swapped.contains("looks like the ground truth"), "{swapped}");
    let calibrated = succeeds(folder, &["eval", "truth.tum", "estimate.tum", "--calibrate"]).stdout;
    assert!(calibrated.contains("not comparable") && calibrated.contains("time to add"), "{calibrated}");
}

#[test]
fn converted_trajectories_are_the_same_and_figures_are_whole_files() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    formats(folder, "truth", 0.0);
    formats(folder, "estimate", 0.01);
    for format in ["euroc", "kitti"] {
        succeeds(folder, &["convert", "estimate.tum", "other", "--to", format]);
        let times: &[&str] = if format == "kitti" { &["--times", "times.txt"] } else { &[] };
        fs::write(
            folder.join("times.txt"),
            (0..40).map(|i| format!("{:.1}\n", f64::from(i) * 0.1)).collect::<String>(),
        )
        .unwrap();
        succeeds(folder, &[&["convert", "other", "again.tum", "--to", "tum"], times].concat());
        let same = ate(folder, &["eval", "estimate.tum", "again.tum", "--align", "none"]);
        assert!(same < 1e-8, "{format}: {same}");
    }
    fails(folder, &["convert", "estimate.tum", "estimate.tum", "--to", "kitti"], &["input and output"]);
    succeeds(folder, &["eval", "truth.tum", "estimate.tum", "--plots", "plots"]);
    for name in ["trajectory-from-above", "translation-error"] {
        let svg = fs::read_to_string(folder.join(format!("plots/{name}.svg"))).unwrap();
        assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>") && svg.contains("estimate"), "{name}");
        let pdf = fs::read(folder.join(format!("plots/{name}.pdf"))).unwrap();
        assert!(pdf.starts_with(b"%PDF-") && pdf.trim_ascii_end().ends_with(b"%%EOF") && pdf.len() > 2000, "{name}");
    }
}

/// Writes a curve that turns, and an estimate of it with errors and a scale of 1.02, in the three formats.
fn turning_curves(folder: &Path) {
    for (name, e) in [("truth", 0.0), ("estimate", 1.0)] {
        let (mut tum, mut euroc, mut kitti) =
            (String::new(), "#timestamp [ns],x,y,z,qw,qx,qy,qz\n".to_owned(), String::new());
        for i in 0..200u32 {
            let a = 0.05 * f64::from(i);
            let scale = 1.0 + 0.02 * e;
            let x = (2.0 * a.cos() + e * 0.02 * (7.0 * a).sin()) * scale;
            let y = (1.5 * a.sin() + e * 0.015 * (5.0 * a).cos()) * scale;
            let z = (0.3 * a + e * 0.01 * (11.0 * a).sin()) * scale;
            let yaw = a + e * 0.01 * (3.0 * a).sin();
            let (sin, cos, qz, qw) = (yaw.sin(), yaw.cos(), (yaw / 2.0).sin(), (yaw / 2.0).cos());
            let stamp_ns = 1_500_000_000_000_000_000 + u64::from(i) * 100_000_000;
            writeln!(tum, "{}.{:09} {x} {y} {z} 0 0 {qz} {qw}", stamp_ns / 1_000_000_000, stamp_ns % 1_000_000_000)
                .unwrap();
            writeln!(euroc, "{stamp_ns},{x},{y},{z},{qw},0,0,{qz}").unwrap();
            writeln!(kitti, "{cos} {} 0 {x} {sin} {cos} 0 {y} 0 0 1 {z}", -sin).unwrap();
        }
        for (ending, text) in [("tum", tum), ("csv", euroc), ("kitti", kitti)] {
            fs::write(folder.join(format!("{name}.{ending}")), text).unwrap();
        }
    }
}

#[test]
fn errors_equal_those_of_evo_for_every_format_and_alignment() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    turning_curves(folder);
    let near = |value: &Value, expected: f64, what: &str| {
        assert!((value.as_f64().unwrap() - expected).abs() < 1e-9, "{what}: {value}, not {expected}");
    };
    let eval = |args: &[&str]| -> Value {
        let common = ["--delta", "10f", "--json"];
        serde_json::from_str(&succeeds(folder, &[&["eval"], args, &common].concat()).stdout).unwrap()
    };
    let ape = succeeds(folder, &["ape", "kitti", "truth.kitti", "estimate.kitti", "--align_origin"]).stdout;
    assert!(ape.contains("ATE, first pose (m)  0.0686"), "{ape}");
    // evo 1.38.1 on these files: evo_ape tum|euroc|kitti with -a, -as, --align_origin and without; evo_rpe -d 10 -u f.
    for files in [["truth.tum", "estimate.tum"], ["truth.csv", "estimate.tum"], ["truth.kitti", "estimate.kitti"]] {
        let json = eval(&files);
        let what = files.join(" ");
        near(&json["estimate"]["ate"]["translation_m"]["rmse"], 0.044094211651, &what);
        near(&json["estimate"]["ate"]["translation_m"]["mean"], 0.041584349085, &what);
        near(&json["estimate"]["ate"]["translation_m"]["max"], 0.066480209533, &what);
        near(&json["estimate"]["beside"]["translation_m"]["rmse"], 0.018955232464, &what);
        near(&json["estimate"]["rpe"][0]["translation_m"]["rmse"], 0.039609383199, &what);
        near(&json["estimate"]["rpe"][0]["translation_m"]["max"], 0.057617623846, &what);
        near(&json["estimate"]["rpe"][0]["rotation_deg"]["rmse"], 0.555490096974, &what);
        let origin = eval(&[&files[..], &["--align", "origin"]].concat());
        near(&origin["estimate"]["ate"]["translation_m"]["rmse"], 0.068561327733, &what);
        near(&origin["estimate"]["ate"]["translation_m"]["max"], 0.116103861613, &what);
        let none = eval(&[&files[..], &["--align", "none"]].concat());
        near(&none["estimate"]["ate"]["translation_m"]["rmse"], 0.053667204954, &what);
    }
}

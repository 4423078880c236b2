//! The commands `eval`, `ape`, `rpe`, `info`, `demo`, `config`, `completions`, and the help.

use std::fs;

use crate::common::{SMALL_WORLD, fails, record, report, succeeds, yfslam};
use serde_json::Value;

/// A closed curve, displaced by `error_m` to either side in turn.
fn trajectory(error_m: f64) -> String {
    let line = |i: u32| {
        let angle = f64::from(i) * 0.1;
        let side = if i.is_multiple_of(2) { error_m } else { -error_m };
        format!("{:.1} {} {} {} 0 0 0 1\n", f64::from(i) * 0.1, angle.cos(), angle.sin(), side)
    };
    (0..60).map(line).collect()
}

#[test]
fn eval_prints_the_errors_and_the_improvement() {
    let folder = tempfile::tempdir().unwrap();
    for (name, error_m) in [("truth.txt", 0.0), ("good.txt", 0.01), ("bad.txt", 0.04)] {
        fs::write(folder.path().join(name), trajectory(error_m)).unwrap();
    }
    let args = ["eval", "truth.txt", "good.txt", "--versus", "bad.txt", "--delta", "1f", "--delta", "0.5m"];
    let output = succeeds(folder.path(), &[&args[..], &["--json"]].concat());
    let json: Value = serde_json::from_str(&output.stdout).unwrap();
    let near = |value: &Value, expected: f64| assert!((value.as_f64().unwrap() - expected).abs() < 1e-3, "{value}");
    near(&json["estimate"]["ate"]["translation_m"]["rmse"], 0.01);
    near(&json["versus"]["ate"]["translation_m"]["rmse"], 0.04);
    near(&json["estimate"]["rpe"][0]["translation_m"]["rmse"], 0.02);
    assert_eq!(json["estimate"]["rpe"][1]["options"]["delta"]["metres"], 0.5);
    let improvement = &json["improvement_percent"][0];
    assert_eq!(improvement["error"], "ATE (m)");
    assert!((improvement["rmse"].as_f64().unwrap() - 75.0).abs() < 0.1, "{improvement}");

    let table = succeeds(folder.path(), &args).stdout;
    assert!(table.contains("ATE, SE(3) (m)") && table.contains("improvement (%)"), "{table}");
    let scaled = succeeds(folder.path(), &["eval", "truth.txt", "good.txt", "--align", "sim3"]).stdout;
    assert!(scaled.contains("ATE, Sim(3) (m)") && scaled.contains("; Sim(3), scale s = "), "{scaled}");
    fails(folder.path(), &["eval", "truth.txt", "good.txt", "--delta", "1x"], &["'1x'", "1f", "0.5m"]);
    fails(folder.path(), &["eval", "truth.txt", "good.txt", "--delta", "90s"], &["90 s", "smaller"]);
    fails(folder.path(), &["eval", "truth.txt", "nowhere.txt"], &["nowhere.txt"]);
}

#[test]
fn ape_and_rpe_take_the_options_of_evo_and_print_one_error() {
    let folder = tempfile::tempdir().unwrap();
    for (name, error_m) in [("truth.txt", 0.0), ("estimate.txt", 0.01)] {
        fs::write(folder.path().join(name), trajectory(error_m)).unwrap();
    }
    let run = |args: &[&str]| succeeds(folder.path(), args).stdout;
    let ape = run(&["ape", "tum", "truth.txt", "estimate.txt", "-va", "-r", "trans_part"]);
    assert!(ape.contains("ATE, SE(3) (m)") && ape.contains("0.0100") && !ape.contains("RPE"), "{ape}");
    assert!(run(&["ape", "truth.txt", "estimate.txt", "-as"]).contains("ATE, Sim(3) (m)"));
    let rpe = run(&["rpe", "truth.txt", "estimate.txt", "-r", "trans_part", "-d", "2", "-u", "f", "--all_pairs"]);
    assert!(rpe.contains("RPE per 2 frames, all pairs (m)") && !rpe.contains("(deg)"), "{rpe}");
    let rpe = run(&["rpe", "truth.txt", "estimate.txt", "-r", "full", "-u", "s", "--t_max_diff", "0.02"]);
    assert!(rpe.contains("RPE per 1 s, all pairs (m)") && rpe.contains("RPE per 1 s, all pairs (deg)"), "{rpe}");
    let refused = |args: &[&str], words: &[&str]| fails(folder.path(), args, words);
    refused(&["ape", "truth.txt", "estimate.txt", "-r", "angle_deg"], &["trans_part", "yfslam rpe"]);
    refused(&["ape", "truth.txt", "estimate.txt", "-s"], &["--align"]);
    refused(&["ape", "gpx", "truth.txt", "estimate.txt"], &["gpx", "tum, kitti or euroc"]);
    refused(&["ape", "bag", "truth.txt", "estimate.txt"], &["a file and two topics"]);
    refused(&["ape", "truth.txt", "estimate.txt", "-ap"], &["--plot", "--report"]);
    refused(&["rpe", "truth.txt", "estimate.txt", "-d", "1.5"], &["1.5 frames", "whole number"]);
    refused(&["rpe", "truth.txt", "estimate.txt", "-u", "d"], &["'d'", "f, s, m"]);
}

#[test]
fn info_describes_a_sequence_even_if_a_run_would_fail() {
    let folder = tempfile::tempdir().unwrap();
    record(&folder.path().join("seq"));
    let text = succeeds(folder.path(), &["info", "seq"]).stdout;
    for found in ["12 pairs", "30.00 Hz", "320×240", "camera.toml", "groundtruth.txt: 12 poses", "spans 12 of 12"] {
        assert!(text.contains(found), "no '{found}' in {text}");
    }
    let text = succeeds(folder.path(), &["info", "seq", "--depth-factor", "1"]).stdout;
    assert!(text.contains("implausible") && text.contains("--depth-factor 5000"), "{text}");
    fs::remove_file(folder.path().join("seq/camera.toml")).unwrap();
    fs::write(folder.path().join("seq/depth/0.png"), "").unwrap();
    let text = succeeds(folder.path(), &["info", "seq"]).stdout;
    assert!(text.contains("not usable") && text.contains("raw") && text.contains("depth/0.png"), "{text}");
    assert!(succeeds(folder.path(), &["info", SMALL_WORLD]).stdout.contains("12 in 0.367 s, 30 Hz"));
}

#[test]
fn the_demo_compares_all_methods_and_says_where_the_boxes_come_from() {
    let folder = tempfile::tempdir().unwrap();
    let output = succeeds(folder.path(), &["demo", "--frames", "24", "--out", "demo"]);
    assert!(output.stdout.contains("boxes: exact, from the renderer"), "{}", output.stdout);
    assert!(output.stderr.contains("--method none,boxes,yf,full --report --out demo"), "{}", output.stderr);
    assert!(output.stdout.contains("less RMSE (%)"), "{}", output.stdout);
    let mut errors_m = Vec::new();
    for method in ["none", "boxes", "yf", "full"] {
        let out = folder.path().join("demo").join(method);
        assert!(out.join("trajectory.txt").is_file());
        let report = report(&out);
        assert_eq!(report["config"]["dynamic"]["method"], method);
        assert_eq!(report["frames"]["tracked"], 24);
        errors_m.push(crate::common::ate_rmse(&report));
    }
    // Without a filter the error is 6.8 to 19 times that of `yf` for the seeds 1 to 5.
    let [none, boxes, yf, full] = errors_m[..] else { unreachable!("four methods") };
    assert!(boxes.max(yf).max(full) < 0.01, "boxes {boxes} m, yf {yf} m, full {full} m");
    assert!(none > 4.0 * yf && none > 4.0 * full, "none {none} m, yf {yf} m, full {full} m");
}

#[test]
fn the_printed_configuration_can_be_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let text = succeeds(folder.path(), &["config", "--method", "none", "--seed", "5"]).stdout;
    assert!(text.contains("method = \"none\"") && text.contains("seed = 5"), "{text}");
    fs::write(folder.path().join("my.toml"), &text).unwrap();
    assert_eq!(succeeds(folder.path(), &["config", "--config", "my.toml"]).stdout, text);
}

#[test]
fn help_lists_every_command_and_completions_exist_for_every_shell() {
    let folder = tempfile::tempdir().unwrap();
    let help = succeeds(folder.path(), &["--help"]).stdout;
    for command in [
        "run",
        "eval",
        "ape",
        "rpe",
        "convert",
        "demo",
        "detect",
        "synth",
        "bench",
        "calibrate",
        "camera",
        "info",
        "config",
        "completions",
    ] {
        assert!(help.contains(&format!("  {command} ")), "{help}");
        let own = succeeds(folder.path(), &[command, "--help"]).stdout;
        assert!(own.contains("Examples:"), "{own}");
    }
    assert!(succeeds(folder.path(), &["--version"]).stdout.starts_with("yfslam "));
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        assert!(succeeds(folder.path(), &["completions", shell]).stdout.contains("groundtruth"), "{shell}");
    }
    assert!(!yfslam(folder.path(), &[]).success);
}

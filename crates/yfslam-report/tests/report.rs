//! Pages of unusual input: long, lost, with large errors, without ground truth.

#![allow(clippy::unwrap_used, reason = "a test may")]

mod common;

use common::{FRAME_NS, circles, method, report, wobble};
use yfslam_eval::{EvalOptions, evaluate};

/// Returns the number of points of all lines of the page.
fn points(html: &str) -> usize {
    html.split("points=\"").skip(1).map(|part| part.split('"').next().unwrap().split_whitespace().count()).sum()
}

#[test]
fn half_an_hour_with_a_method_a_thousand_times_worse_stays_small_and_readable() {
    let frames = 54_000;
    let frames_ns: Vec<i64> = (0..frames).map(|i| i * FRAME_NS).collect();
    let truth = circles(frames, |_| 0.0, |_| 0.0);
    let good = circles(frames, wobble(0.002), wobble(0.1));
    let mut bad = circles(frames, |t| 0.01 * t, |t| 0.05 * t);
    bad.drain(20_000..30_000);
    let [of_bad, of_good] = [&bad, &good].map(|e| evaluate(&truth, e, &EvalOptions::default()).unwrap());
    let methods = vec![method("none", &bad, Some(&of_bad)), method("yf", &good, Some(&of_good))];
    let html = report(&frames_ns, Some(&truth), methods).html();
    std::fs::write(std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("long.html"), &html).unwrap();
    assert!(html.len() < 1_500_000, "{}", html.len());
    assert!(points(&html) < 60_000 && points(&html) > 5_000, "{}", points(&html));
    assert!(html.contains("Clipped where an estimate is far from the ground truth"));
    assert!(
        html.contains("error, logarithmic")
            && html.contains("ATE, logarithmic")
            && html.contains("error (°), logarithmic")
    );
    assert!(html.contains("A cross is where tracking was lost"));
    // The largest error in the figure equals that in the table.
    let largest = of_good.ate.translation_m.max * 1e3;
    assert!(html.contains(&format!("yf {largest:.2} mm")), "{largest}");
}

#[test]
fn a_page_without_ground_truth_without_poses_or_without_methods_is_valid() {
    let frames_ns: Vec<i64> = (0..100).map(|i| i * FRAME_NS).collect();
    let poses = circles(100, |_| 0.0, |_| 0.0);
    let without_truth = report(&frames_ns, None, vec![method("yf", &poses, None)]).html();
    assert!(without_truth.contains("no ground truth") && without_truth.contains("From above"));
    assert!(!without_truth.contains("Error over time"));
    let not_comparable = report(&frames_ns, Some(&poses), vec![method("yf", &poses[..1], None)]).html();
    assert!(not_comparable.contains("The trajectory of yf cannot be compared"));
    let one_pose = report(&frames_ns[..1], None, vec![method("yf", &poses[..1], None)]).html();
    assert!(one_pose.contains("From above"));
    let nothing = report(&[], None, Vec::new()).html();
    assert!(nothing.ends_with("</html>"));
    for html in [without_truth, not_comparable, one_pose, nothing] {
        assert!(!html.contains("NaN") && !html.contains("inf"), "{html}");
    }
}

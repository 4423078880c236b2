//! The official detector finds the synthetic people, with sensor noise. Needs the model of the data folder.
#![allow(clippy::unwrap_used, reason = "a test may")]

mod recall;

use recall::{Table, measure, official_detector};
use yfslam_synth::{World, parse};

#[test]
#[ignore = "long: see CONTRIBUTING.md"]
fn the_official_detector_finds_six_of_ten_people_taller_than_thirty_percent_of_the_image() {
    let Some(mut detector) = official_detector() else {
        eprintln!("skipped: no official model; set YFSLAM_DATA to a folder that has models/yolo-fastestv2-coco.onnx");
        return;
    };
    let mut table = Table::new();
    for (spec, step) in [
        ("walking_xyz?seed=1", 30),
        ("walking_static?seed=2", 30),
        ("walking_rpy?seed=3", 30),
        ("walking_halfsphere?seed=4", 30),
        ("sitting_xyz?seed=5", 75),
        ("sitting_rpy?seed=6", 75),
        ("walking_xyz?activity=crowd&people=6&share=0.35&seed=7", 30),
    ] {
        let mut config = parse(spec).unwrap();
        // Soft shadows take most of the time to build a world and change people little.
        config.light.shadow_rays = 2;
        measure(&World::new(&config).unwrap(), spec, step, &mut detector, &mut table, |_, _, _, _| {});
    }
    let all = table["all"];
    assert!(all.seen >= 80, "{} people make no test", all.seen);
    assert!(all.recall() >= 0.6, "{} of {} people found:\n{table:#?}", all.found, all.seen);
    // Walking and sitting are checked separately. In a crowd many stand behind others; it counts in the sum only.
    for activity in ["walking", "sitting"] {
        let of = |name: &str| name.starts_with(activity) && !name.contains("crowd");
        let counts = table.iter().filter(|(name, _)| of(name)).map(|(_, count)| *count);
        let (seen, found) = counts.fold((0, 0), |sum, c| (sum.0 + c.seen, sum.1 + c.found));
        assert!(found as f64 >= 0.6 * seen as f64, "{activity}: {found} of {seen} people found:\n{table:#?}");
    }
}

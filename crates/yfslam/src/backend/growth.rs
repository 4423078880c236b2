//! How cost grows with the map, on maps of any size without images. `cargo test --release -p yfslam --lib growth:: -- --ignored --nocapture
//! --test-threads 1` prints the tables.
#![allow(clippy::print_stdout, reason = "these tests print tables")]

use std::sync::Mutex;
use std::time::Instant;

use crate::features::FrameFeatures;
use crate::loops::{GlobalBundle, LoopCloser, PlaceRecogniser};
use crate::map::Map;
use crate::map::warehouse::Warehouse;

/// Returns the milliseconds since a moment.
fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

/// Closes the loop of a round of about so many keyframes, and prints the times and the errors.
fn close_loop(keyframes: usize) -> [f64; 3] {
    let mut warehouse = Warehouse::new(keyframes, 40, 0);
    let (mut map, mut closer) = (Map::default(), LoopCloser::default());
    let recogniser = Mutex::new(PlaceRecogniser::default());
    let context = warehouse.context.clone();
    let count = warehouse.truth.len();
    for k in 0..count {
        let id = warehouse.add(&mut map, k);
        recogniser.lock().unwrap().add_keyframe(&map, id);
        if k + 40 < count {
            continue;
        }
        let before = warehouse.error_m(&map);
        assert_eq!(map.submap_count(), 1, "the path has no gap");
        let started = Instant::now();
        let Some(closed) = closer.close(&context, &recogniser, &mut map, id) else { continue };
        let closing = ms(started);
        let graph = warehouse.error_m(&map);
        let started = Instant::now();
        let mut bundle = GlobalBundle::copy(&context.sensor, &map, id).unwrap();
        let copying = ms(started);
        let started = Instant::now();
        bundle.adjust(&context.config.bundle, &|| true);
        let adjusting = ms(started);
        let started = Instant::now();
        bundle.merge(&context.sensor, &mut map);
        let merging = ms(started);
        let after = warehouse.error_m(&map);
        map.validate().unwrap();
        println!(
            "{:6} keyframes {:7} landmarks: loop {closing:7.1} ms, copy {copying:6.1}, adjust {adjusting:8.1}, merge {merging:6.1}; \
             error {before:.3} m, pose graph {graph:.3}, adjusted {after:.3}; {} inliers",
            map.keyframe_count(),
            map.landmark_count(),
            closed.inliers
        );
        return [before, graph, after];
    }
    panic!("no loop was closed");
}

#[test]
fn a_round_through_a_warehouse_is_closed_and_adjusted() {
    let [before, graph, after] = close_loop(1000);
    assert!(graph < 0.3 * before && after < 0.3 * before, "{before} {graph} {after}");
}

#[test]
#[ignore = "prints times"]
fn growth_of_loops() {
    for keyframes in [200, 500, 1000, 2000, 5000] {
        close_loop(keyframes);
    }
}

#[test]
#[ignore = "prints times"]
fn growth_of_snapshots() {
    for keyframes in [250, 500, 1000, 2000] {
        let mut warehouse = Warehouse::new(keyframes, 0, 850);
        let mut map = Map::default();
        for k in 0..warehouse.truth.len() {
            warehouse.add(&mut map, k);
        }
        let shared = best_ms(|| map.clone());
        let features = best_ms(|| map.keyframes().map(|(_, k)| FrameFeatures::clone(&k.features)).collect::<Vec<_>>());
        println!(
            "{:6} keyframes {:7} landmarks: snapshot {shared:7.2} ms; copies of the features would take another {features:7.2} ms",
            map.keyframe_count(),
            map.landmark_count()
        );
    }
}

/// Returns the least milliseconds of five calls.
fn best_ms<T>(mut call: impl FnMut() -> T) -> f64 {
    let mut times = (0..5).map(|_| {
        let started = Instant::now();
        let kept = call();
        let time = ms(started);
        drop(kept);
        time
    });
    let first = times.next().unwrap_or_default();
    times.fold(first, f64::min)
}

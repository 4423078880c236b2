//! The same bits on every machine: a rendered world with people, tracked without threads, files or network, prints its trajectory.
//!
//! `cargo run --release -p yfslam-examples --example 07_any_machine`, and for WebAssembly as `tools/same_bits.sh` does.
#![allow(clippy::print_stdout, reason = "an example prints")]

use yfslam::Slam;
use yfslam_synth::{World, parse};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let world =
        std::env::args().nth(1).unwrap_or_else(|| "walking_xyz?frames=60&width=320&height=240&seed=5".to_owned());
    let mut config = parse(&world)?;
    config.detections = true;
    let world = World::new(&config)?;
    let mut slam = Slam::builder(world.config().camera.clone()).build()?;
    for index in 0..world.len() {
        // The frame comes with exact boxes: a detector would run on a thread of its own, which WebAssembly does not have.
        slam.track(&world.frame(index).frame)?;
    }
    for (timestamp_ns, pose) in slam.trajectory() {
        let (p, q) = (pose.translation, pose.rotation);
        // All digits: equal lines are equal bits.
        println!("{timestamp_ns} {:?} {:?} {:?} {:?} {:?} {:?} {:?}", p.x, p.y, p.z, q.i, q.j, q.k, q.w);
    }
    Ok(())
}

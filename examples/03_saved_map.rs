//! A map that outlives the session: made and saved on the first day, localised in on the second.
//!
//! `cargo run --release -p yfslam-examples --example 03_saved_map`
#![allow(clippy::print_stdout, reason = "an example prints")]

use yfslam::{MapUse, SavedMap, Slam};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (camera, frames) = yfslam_examples::rendered("walking_xyz?people=0&frames=40")?;

    let mut first_day = Slam::builder(camera.clone()).build()?;
    for frame in &frames {
        first_day.track(frame)?;
    }
    let path = std::env::temp_dir().join("yfslam-example.map");
    std::fs::write(&path, first_day.save_map()?)?;
    println!("{}: {} keyframes", path.display(), first_day.map().keyframe_count());

    let saved = SavedMap::from_bytes(&std::fs::read(&path)?)?;
    let mut second_day = Slam::builder(camera).map(saved, MapUse::Localise).build()?;
    for (index, frame) in frames.iter().enumerate().skip(20) {
        let tracked = second_day.track(frame)?;
        match (tracked.t_world_cam, tracked.lost_reason) {
            (Some(pose), _) => println!("frame {index}: in the map at {:.3}", pose.translation.vector.transpose()),
            (None, reason) => {
                println!("frame {index}: {}", reason.map_or_else(String::new, |reason| reason.to_string()))
            }
        }
    }
    Ok(())
}

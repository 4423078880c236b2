//! Renders frames of a synthetic world into PNG files, in colour and in depth, and prints the time for it.
//!
//! `cargo run --release -p yfslam-synth --example render -- 'synth:walking_xyz?seed=7' out 0 30 60` writes `out/color_0000.png`,
//! `out/depth_0000.png` and so on. Without frame numbers it only measures.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use yfslam::Image;
use yfslam_io::write::write_color_png;
use yfslam_synth::{SynthFrame, World, parse};

/// Frames rendered for the mean rate, spread over the sequence.
const MEASURED: usize = 20;
/// Depth that is drawn white, m.
const WHITE_M: f32 = 5.0;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (spec, folder, indices) = match arguments.as_slice() {
        [spec] => (spec, "", &[][..]),
        [spec, folder, indices @ ..] => (spec, folder.as_str(), indices),
        [] => return Err("usage: render SPEC [FOLDER FRAME...]".into()),
    };
    let started = Instant::now();
    let world = World::new(&parse(spec)?)?;
    let built = started.elapsed();
    drop(world.frame(0));
    eprintln!("world after {:.2} s, first frame after {:.2} s", built.as_secs_f64(), started.elapsed().as_secs_f64());
    eprintln!("actors cover {:.3} of the view", world.person_share());
    for index in indices {
        let index: usize = index.parse()?;
        let shot = world.frame(index);
        write_color_png(&Path::new(folder).join(format!("color_{index:04}.png")), &shot.frame.color)?;
        write_color_png(&Path::new(folder).join(format!("depth_{index:04}.png")), &depth_image(&shot)?)?;
        eprintln!("frame {index}: boxes {:?}", shot.boxes);
    }
    // The first rendering is not measured: textures are painted when they are first visible.
    let spread = || (0..MEASURED).map(|k| k * world.len() / MEASURED);
    spread().for_each(|index| drop(world.frame(index)));
    let started = Instant::now();
    spread().for_each(|index| drop(world.frame(index)));
    let rate = MEASURED as f64 / started.elapsed().as_secs_f64();
    eprintln!("{rate:.1} frames/s on {} threads", rayon::current_num_threads());
    Ok(())
}

/// Returns the measured depth as grey, with tinted actors.
fn depth_image(shot: &SynthFrame) -> Result<Image<[u8; 3]>, Box<dyn Error>> {
    let depth = shot.frame.depth.as_deref().ok_or("a stereo camera has no depth image")?;
    let pixels = depth.raw.data().iter().zip(shot.instances.data()).map(|(&raw, &instance)| {
        let grey = (f32::from(raw) * depth.metres_per_unit / WHITE_M * 255.0).min(255.0) as u8;
        [grey, if instance > 0 { grey / 2 } else { grey }, grey]
    });
    Ok(Image::from_vec(depth.raw.width(), depth.raw.height(), pixels.collect()).ok_or("no pixels")?)
}

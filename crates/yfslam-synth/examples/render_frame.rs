//! Renders frames of a synthetic world to PNG and tells how long it took.
//!
//! `cargo run --release -p yfslam-synth --example render_frame -- 'synth:walking_xyz?scene=lab' out 0 60 120` writes
//! `out/000000.png` and so on. Without frame numbers it only measures.
#![allow(clippy::print_stdout, reason = "an example talks to its user")]

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use yfslam::image::RgbImage;
use yfslam_synth::{World, parse};

/// Frames rendered for the mean rate, spread over the sequence.
const MEASURED: usize = 20;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (spec, folder, indices) = match arguments.as_slice() {
        [spec] => (spec, None, &[][..]),
        [spec, folder, indices @ ..] => (spec, Some(Path::new(folder)), indices),
        [] => return Err("usage: render_frame SPEC [FOLDER FRAME...]".into()),
    };
    let started = Instant::now();
    let world = World::new(&parse(spec)?)?;
    let built = started.elapsed();
    let _first = world.frame(0);
    println!("world after {:.2} s, first frame after {:.2} s", built.as_secs_f64(), started.elapsed().as_secs_f64());
    if let Some(folder) = folder {
        std::fs::create_dir_all(folder)?;
        for index in indices {
            let index: usize = index.parse()?;
            write_png(&folder.join(format!("{index:06}.png")), &world.frame(index).frame.color)?;
        }
    }
    // Once unmeasured: textures are painted when they are first seen.
    let spread = || (0..MEASURED).map(|k| k * world.len() / MEASURED);
    spread().for_each(|index| drop(world.frame(index)));
    let started = Instant::now();
    spread().for_each(|index| drop(world.frame(index)));
    println!("{:.1} frames/s", MEASURED as f64 / started.elapsed().as_secs_f64());
    Ok(())
}

fn write_png(path: &Path, image: &RgbImage) -> Result<(), Box<dyn Error>> {
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, image.width() as u32, image.height() as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(image.data().as_flattened())?;
    Ok(())
}

//! Renders a few frames of a synthetic world into PNG files, and tells how long a frame takes.
//!
//! `cargo run --release -p yfslam-synth --example render -- 'synth:walking_xyz?seed=7' out 0 30 60`; the folder `-` writes
//! nothing.

use std::error::Error;
use std::fs::File;
use std::path::Path;
use std::time::Instant;

fn save(path: &Path, width: usize, height: usize, rgb: &[u8]) -> Result<(), Box<dyn Error>> {
    let mut encoder = png::Encoder::new(std::io::BufWriter::new(File::create(path)?), width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(rgb)?;
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let spec = arguments.next().unwrap_or_else(|| "synth:walking_xyz".to_owned());
    let folder = arguments.next().unwrap_or_else(|| "synth_out".to_owned());
    let indices = arguments.map(|a| a.parse()).collect::<Result<Vec<usize>, _>>()?;
    let indices = if indices.is_empty() { vec![0, 60, 120] } else { indices };
    if folder != "-" {
        std::fs::create_dir_all(&folder)?;
    }
    let started = Instant::now();
    let world = yfslam_synth::World::new(&yfslam_synth::parse(&spec)?)?;
    eprintln!("built in {:?}; people cover {:.3} of the view", started.elapsed(), world.person_share());
    let mut best = f64::INFINITY;
    for &index in &indices {
        let started = Instant::now();
        let shot = world.frame(index);
        best = best.min(started.elapsed().as_secs_f64());
        if folder == "-" {
            continue;
        }
        let (width, height) = (shot.instances.width(), shot.instances.height());
        let color: Vec<u8> = shot.frame.color.data().iter().flatten().copied().collect();
        // Depth as grey (5 m is white), people tinted.
        let depth: Vec<u8> = shot
            .frame
            .depth
            .raw
            .data()
            .iter()
            .zip(shot.instances.data())
            .flat_map(|(&raw, &instance)| {
                let grey = (f32::from(raw) / 5000.0 * 51.0).min(255.0) as u8;
                [grey, if instance > 0 { grey / 2 } else { grey }, grey]
            })
            .collect();
        save(&Path::new(&folder).join(format!("color_{index:04}.png")), width, height, &color)?;
        save(&Path::new(&folder).join(format!("depth_{index:04}.png")), width, height, &depth)?;
        eprintln!("frame {index}: boxes {:?}", shot.boxes);
    }
    eprintln!("fastest frame: {:.1} ms on {} threads", best * 1e3, rayon::current_num_threads());
    Ok(())
}

//! How well the official detector finds the synthetic people: a table, and the pictures with its boxes.
//!
//! `YFSLAM_DATA=... cargo run --release -p yfslam-synth --example recall -- out 30 walking_xyz?seed=1 sitting_rpy?seed=2` takes
//! every 30th frame; the folder `-` writes no pictures. Green is a person who is found, red one who is missed, blue a detection.

use std::error::Error;
use std::fs::File;
use std::path::Path;

use yfslam::BoundingBox;
use yfslam_synth::{World, parse};

#[path = "../tests/recall/mod.rs"]
mod recall;

fn outline(rgb: &mut [u8], [width, height]: [usize; 2], b: &BoundingBox, color: [u8; 3]) {
    let clip = |v: f32, n: usize| (v.max(0.0) as usize).min(n - 1);
    let ([x0, x1], [y0, y1]) =
        ([b.x_min, b.x_max - 1.0].map(|v| clip(v, width)), [b.y_min, b.y_max - 1.0].map(|v| clip(v, height)));
    let border = (x0..=x1).flat_map(|x| [(x, y0), (x, y1)]).chain((y0..=y1).flat_map(|y| [(x0, y), (x1, y)]));
    for (x, y) in border {
        rgb[3 * (y * width + x)..][..3].copy_from_slice(&color);
    }
}

fn save(path: &Path, [width, height]: [usize; 2], rgb: &[u8]) -> Result<(), Box<dyn Error>> {
    let mut encoder = png::Encoder::new(std::io::BufWriter::new(File::create(path)?), width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(rgb)?;
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, step, specs @ ..] = arguments.as_slice() else {
        return Err("arguments: folder, step, specs".into());
    };
    let mut detector = recall::official_detector().ok_or("no official model: set YFSLAM_DATA")?;
    if folder != "-" {
        std::fs::create_dir_all(folder)?;
    }
    let mut table = recall::Table::new();
    for spec in specs {
        let world = World::new(&parse(spec)?)?;
        let name = spec.split('?').next().unwrap_or(spec);
        let mut failure: Option<Box<dyn Error>> = None;
        recall::measure(&world, name, step.parse()?, &mut detector, &mut table, |index, shot, detections, seen| {
            if folder == "-" || seen.is_empty() {
                return;
            }
            let size = [shot.instances.width(), shot.instances.height()];
            let mut rgb: Vec<u8> = shot.frame.color.data().iter().flatten().copied().collect();
            for d in detections.iter().filter(|d| d.class == 0) {
                outline(&mut rgb, size, &d.bbox, [40, 80, 255]);
            }
            for s in seen {
                outline(&mut rgb, size, &s.bbox, if s.found { [0, 230, 0] } else { [255, 0, 0] });
            }
            let miss = if seen.iter().any(|s| !s.found) { "miss" } else { "all" };
            let file = format!("{miss}_{}_{index:04}.png", spec.replace(['?', '&', '=', ':'], "-"));
            failure = save(&Path::new(folder).join(file), size, &rgb).err().or(failure.take());
        });
        if let Some(error) = failure {
            return Err(error);
        }
    }
    for (key, count) in &table {
        eprintln!("{key:34} {:4} of {:4}  {:.3}", count.found, count.seen, count.recall());
    }
    Ok(())
}

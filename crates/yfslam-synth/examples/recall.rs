//! Measures how many synthetic people the official detector finds: a table, and images with its boxes.
//!
//! `YFSLAM_DATA=... cargo run --release -p yfslam-synth --example recall -- out 30 walking_xyz?seed=1 sitting_rpy?seed=2` takes
//! every 30th frame; with the folder `-` no images are written. Green: a person who is found; red: one who is missed; blue: a
//! detection.

use std::error::Error;
use std::path::Path;

use yfslam::{BoundingBox, RgbImage};
use yfslam_io::write::write_color_png;
use yfslam_synth::{World, parse};

#[path = "../tests/recall/mod.rs"]
mod recall;

fn outline(image: &mut RgbImage, b: &BoundingBox, color: [u8; 3]) {
    let clip = |v: f32, n: usize| (v.max(0.0) as usize).min(n - 1);
    let (width, height) = (image.width(), image.height());
    let ([x0, x1], [y0, y1]) =
        ([b.x_min, b.x_max - 1.0].map(|v| clip(v, width)), [b.y_min, b.y_max - 1.0].map(|v| clip(v, height)));
    let border = (x0..=x1).flat_map(|x| [(x, y0), (x, y1)]).chain((y0..=y1).flat_map(|y| [(x0, y), (x1, y)]));
    for (x, y) in border {
        image.data_mut()[y * width + x] = color;
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, step, specs @ ..] = arguments.as_slice() else {
        return Err("arguments: folder, step, specs".into());
    };
    let mut detector = recall::official_detector().ok_or("no official model: set YFSLAM_DATA")?;
    let mut table = recall::Table::new();
    for spec in specs {
        let world = World::new(&parse(spec)?)?;
        let name = spec.split('?').next().unwrap_or(spec);
        let mut failure = None;
        recall::measure(&world, name, step.parse()?, &mut detector, &mut table, |index, shot, detections, seen| {
            if folder == "-" || seen.is_empty() {
                return;
            }
            let mut rendering = shot.frame.color.as_ref().clone();
            for d in detections.iter().filter(|d| d.class == 0) {
                outline(&mut rendering, &d.bbox, [40, 80, 255]);
            }
            for s in seen {
                outline(&mut rendering, &s.bbox, if s.found { [0, 230, 0] } else { [255, 0, 0] });
            }
            let miss = if seen.iter().any(|s| !s.found) { "miss" } else { "all" };
            let file = format!("{miss}_{}_{index:04}.png", spec.replace(['?', '&', '=', ':'], "-"));
            failure = write_color_png(&Path::new(folder).join(file), &rendering).err().or(failure.take());
        });
        if let Some(error) = failure {
            return Err(error.into());
        }
    }
    for (key, count) in &table {
        eprintln!("{key:34} {:4} of {:4}  {:.3}", count.found, count.seen, count.recall());
    }
    Ok(())
}

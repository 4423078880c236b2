//! Small recorded sequences for tests, which are written to a temporary folder or read from the folder named by `YFSLAM_DATA`.
#![allow(dead_code, reason = "each test file uses a part")]
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may")]

pub mod bags;
pub mod sqlite;

use std::fs;
use std::path::{Path, PathBuf};

use yfslam::Camera;
use yfslam_io::CameraSource;

/// Size of the images of [`write_sequence`], px.
pub const SIZE: (u32, u32) = (8, 6);

/// Returns the camera of [`write_sequence`].
pub fn camera() -> CameraSource {
    CameraSource::new(Camera::pinhole(SIZE.0 as usize, SIZE.1 as usize, 8.0, 8.0, 4.0, 3.0), 5000.0, "test")
}

pub fn png(size: (u32, u32), color: png::ColorType, depth: png::BitDepth, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size.0, size.1);
    encoder.set_color(color);
    encoder.set_depth(depth);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(data).unwrap();
    writer.finish().unwrap();
    bytes
}

pub fn color_png(size: (u32, u32), value: u8) -> Vec<u8> {
    png(size, png::ColorType::Rgb, png::BitDepth::Eight, &vec![value; (size.0 * size.1 * 3) as usize])
}

pub fn depth_png(size: (u32, u32), value: u16) -> Vec<u8> {
    png(
        size,
        png::ColorType::Grayscale,
        png::BitDepth::Sixteen,
        &value.to_be_bytes().repeat((size.0 * size.1) as usize),
    )
}

/// Writes `count` frames at 10 Hz from second 100 on, depth 5 ms late; frame i has grey value i and depth 5000 + i.
pub fn write_sequence(folder: &Path, count: usize) {
    for name in ["rgb", "depth"] {
        fs::create_dir_all(folder.join(name)).unwrap();
    }
    let (mut rgb, mut depth) = ("# color images\n# timestamp filename\n".to_owned(), "# depth maps\n".to_owned());
    for i in 0..count {
        let (second, tenth) = (100 + i / 10, i % 10);
        rgb += &format!("{second}.{tenth}00 rgb/{i}.png\n");
        depth += &format!("{second}.{tenth}05 depth/{i}.png\n");
        fs::write(folder.join(format!("rgb/{i}.png")), color_png(SIZE, i as u8)).unwrap();
        fs::write(folder.join(format!("depth/{i}.png")), depth_png(SIZE, 5000 + i as u16)).unwrap();
    }
    fs::write(folder.join("rgb.txt"), rgb).unwrap();
    fs::write(folder.join("depth.txt"), depth).unwrap();
}

/// Returns a file or folder of the development data; prints a message and returns `None` if it is missing.
pub fn real_data(name: &str) -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let root = std::env::var_os("YFSLAM_DATA").map_or(beside, PathBuf::from);
    let path = root.join(name);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: {name} is not in the folder named by YFSLAM_DATA");
    None
}

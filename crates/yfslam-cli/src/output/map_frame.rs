//! The map frame in the output folder: the transformation from the world of `trajectory.txt` to the frame of maps.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::Result;
use serde::Serialize;
use yfslam::MapFrame;
use yfslam::dense::Up;
use yfslam_io::write::Coordinates;
use yfslam_io::write_atomically;

/// Name of the file.
pub const MAP_FRAME_FILE: &str = "T_map_world.txt";

/// The frames of the files of a run, in `run.json`.
#[derive(Clone, Debug, Serialize)]
pub struct Frames {
    /// The frame of `trajectory.txt`, `keyframes.txt`, `live.txt` and `map.ply`; poses are of the colour camera.
    pub trajectory: String,
    /// The frame of all that `yfslam map` makes.
    pub map: String,
    /// What gave the up direction of the map frame: `level`, from surfaces, or `camera`, from an upright first image.
    pub up: &'static str,
    /// Homogeneous matrix that takes points of the world into the map frame, by rows.
    pub t_map_world: [[f64; 4]; 4],
}

impl From<&MapFrame> for Frames {
    fn from(frame: &MapFrame) -> Self {
        Self {
            trajectory: Coordinates::World.to_string(),
            map: Coordinates::Map.to_string(),
            up: name_of(frame.up),
            t_map_world: rows(frame),
        }
    }
}

/// Writes the matrix, which `numpy.loadtxt` reads, into `folder`.
///
/// # Errors
/// The file cannot be written; an earlier file then stays.
pub fn write(folder: &Path, frame: &MapFrame) -> Result<()> {
    let mut text = format!(
        "# p_map = T_map_world * p_world, by rows; up: {}\n# {}\n# {}\n",
        name_of(frame.up),
        Coordinates::World,
        Coordinates::Map
    );
    for row in rows(frame) {
        let row = row.map(|value| format!("{value:.17}"));
        writeln!(text, "{}", row.join(" "))?;
    }
    Ok(write_atomically(&folder.join(MAP_FRAME_FILE), |file| file.write_all(text.as_bytes()))?)
}

fn rows(frame: &MapFrame) -> [[f64; 4]; 4] {
    let matrix = frame.r_map_world.to_homogeneous();
    // Adding 0 makes a negative zero positive.
    std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)] + 0.0))
}

fn name_of(up: Up) -> &'static str {
    match up {
        Up::Level => "level",
        Up::Camera => "camera",
        Up::Direction(_) => "given",
    }
}

//! Occupancy grids for the navigation of ROS (nav2_map_server, map_server): a grey image and its description.
//!
//! In: a grid. Out: `NAME.pgm`, whose first row has the largest y, and `NAME.yaml`. Occupied is black (0), free is 254, unknown is 205.

use std::path::Path;

use yfslam::dense::{GridCell, GroundGrid};

use super::Coordinates;
use crate::atomic_file::write_atomically;
use crate::error::Result;

/// Writes `path` (`.pgm`) and the `.yaml` beside it.
///
/// # Errors
/// A file cannot be written.
pub fn write_nav2(path: &Path, grid: &GroundGrid) -> Result<()> {
    write_atomically(path, |writer| {
        write!(writer, "P5\n{} {}\n255\n", grid.width, grid.height)?;
        for row in grid.cells.chunks(grid.width.max(1)).rev() {
            let shades: Vec<u8> = row.iter().map(|cell| shade(*cell)).collect();
            writer.write_all(&shades)?;
        }
        Ok(())
    })?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let [x, y] = grid.origin_m;
    write_atomically(&path.with_extension("yaml"), |writer| {
        // The grey level 205 is read as (255 - 205) / 255 = 0.19608, which must not be below the threshold of free space.
        write!(
            writer,
            "# {}\nimage: {name}\nmode: trinary\nresolution: {}\norigin: [{x}, {y}, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
            Coordinates::Map,
            grid.resolution_m
        )
    })
}

fn shade(cell: GridCell) -> u8 {
    match cell {
        GridCell::Occupied => 0,
        GridCell::Free => 254,
        GridCell::Unknown => 205,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_row_has_the_largest_y_and_map_server_reads_each_grey_level_as_meant() {
        use GridCell::{Free, Occupied, Unknown};
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("grid.pgm");
        let cells = vec![Free, Occupied, Unknown, Free, Free, Unknown];
        let grid = GroundGrid { origin_m: [-1.5, 2.0], resolution_m: 0.05, width: 3, height: 2, cells };
        write_nav2(&path, &grid).unwrap();
        let image = std::fs::read(&path).unwrap();
        assert_eq!(image, [b"P5\n3 2\n255\n".as_slice(), &[254, 254, 205, 254, 0, 205]].concat());
        let yaml = std::fs::read_to_string(folder.path().join("grid.yaml")).unwrap();
        let value = |key: &str| yaml.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(": ")).unwrap();
        assert_eq!((value("image"), value("resolution"), value("origin")), ("grid.pgm", "0.05", "[-1.5, 2, 0.0]"));
        // As map_server reads it: the share of black, against both thresholds.
        let (occupied, free): (f64, f64) =
            (value("occupied_thresh").parse().unwrap(), value("free_thresh").parse().unwrap());
        let means = |cell| match (255.0 - f64::from(shade(cell))) / 255.0 {
            share if share > occupied => Occupied,
            share if share < free => Free,
            _ => Unknown,
        };
        for cell in [Occupied, Free, Unknown] {
            assert_eq!(means(cell), cell);
        }
    }
}

//! The live occupancy grid: obstacles between two heights, seen along the z-axis of the map.
//!
//! In: the volume of the dense map, and its pose in the map frame. Out: `nav_msgs/OccupancyGrid`. The axes of the volume need not be
//! those of the map: a camera that looks down is levelled by its pose on the robot.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3};
use yfslam::dense::{KnownVoxel, Volume};

use crate::messages::{Bytes, Header, OccupancyGrid, Time};

const FREE: u8 = 0;
const OCCUPIED: u8 = 100;
/// -1 as a byte.
const UNKNOWN: u8 = 0xff;

/// Most cells of a grid: 100 million would be 500 m by 500 m at 5 cm.
const MOST_CELLS: usize = 100_000_000;

/// Projects the volume; `None` while nothing is known between the heights, or if the map is too large for a grid.
pub fn occupancy_grid(
    header: Header,
    volume: &Volume,
    t_map_volume: &Isometry3<f64>,
    heights_m: [f64; 2],
) -> Option<OccupancyGrid> {
    let config = volume.config();
    let side_m = f64::from(config.resolution_m);
    let mut columns: BTreeMap<[i32; 2], u8> = BTreeMap::new();
    for known in volume.voxels() {
        let center = Point3::from(known.voxel.map(|v| (f64::from(v) + 0.5) * side_m));
        let point = t_map_volume * center;
        if point.z < heights_m[0] || point.z > heights_m[1] {
            continue;
        }
        let column = [point.x, point.y].map(|v| (v / side_m).floor() as i32);
        let is_obstacle = known.occupied && has_neighbours(volume, &known, config.min_neighbours);
        let state = columns.entry(column).or_insert(FREE);
        if is_obstacle {
            *state = OCCUPIED;
        }
    }
    let range = |axis: usize| {
        let values = columns.keys().map(move |column| column[axis]);
        Some((values.clone().min()?, values.max()?))
    };
    let ((left, right), (low, high)) = (range(0)?, range(1)?);
    let cells = |from: i32, to: i32| usize::try_from(i64::from(to) - i64::from(from) + 1).ok();
    let (width, height) = (cells(left, right)?, cells(low, high)?);
    let size = width.checked_mul(height).filter(|size| *size <= MOST_CELLS)?;
    let mut data = vec![UNKNOWN; size];
    for ([x, y], state) in columns {
        if let Some(cell) = data.get_mut((y - low) as usize * width + (x - left) as usize) {
            *cell = state;
        }
    }
    Some(OccupancyGrid {
        map_load_time: Time::default(),
        resolution: config.resolution_m,
        width: width as u32,
        height: height as u32,
        origin: Isometry3::translation(f64::from(left) * side_m, f64::from(low) * side_m, 0.0).into(),
        data: Bytes(data),
        header,
    })
}

/// Returns whether enough of the 26 voxels around are occupied, too: single ones are outliers.
fn has_neighbours(volume: &Volume, known: &KnownVoxel, wanted: usize) -> bool {
    let [x, y, z] = known.voxel;
    let mut found = 0;
    for step in 0..27 {
        let [dx, dy, dz] = [step % 3 - 1, step / 3 % 3 - 1, step / 9 - 1];
        let is_other = (dx, dy, dz) != (0, 0, 0);
        found += usize::from(is_other && volume.get([x + dx, y + dy, z + dz]).is_some_and(|other| other.occupied));
        if found >= wanted {
            return true;
        }
    }
    found >= wanted
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may")]

    use yfslam::Slam;
    use yfslam_synth::World;

    use super::*;
    use crate::mount::optical;

    /// The grid of a level camera is that of the core; a camera that was turned about the vertical gives the same one, turned.
    #[test]
    fn the_grid_is_that_of_the_core_and_turns_with_the_map() {
        let world =
            World::new(&yfslam_synth::parse("synth:sitting_xyz?people=0&width=320&height=240&frames=10").unwrap())
                .unwrap();
        let config = yfslam::Config::default();
        let builder = Slam::builder(world.config().camera.clone()).config(config.clone()).dense(config.dense);
        let mut slam = builder.build().unwrap();
        for index in 0..world.len() {
            slam.track(&world.frame(index).frame).unwrap();
        }
        let heights = [-0.3, 0.3];
        let mut dense = slam.dense().unwrap();
        let (volume, expected) = (dense.volume(), dense.ground_grid(heights.map(|v| v as f32)));
        let level = Isometry3::identity();
        let found = occupancy_grid(Header::new(5, "map"), &volume, &level, heights).unwrap();
        assert_eq!((found.width as usize, found.height as usize), (expected.width, expected.height));
        let bytes: Vec<u8> = expected
            .cells
            .iter()
            .map(|cell| match cell {
                yfslam::dense::GridCell::Unknown => UNKNOWN,
                yfslam::dense::GridCell::Free => FREE,
                yfslam::dense::GridCell::Occupied => OCCUPIED,
            })
            .collect();
        assert!(found.data.0 == bytes && bytes.contains(&OCCUPIED) && bytes.contains(&FREE));
        assert!((found.origin.position.x - expected.origin_m[0]).abs() < 1e-6);
        let quarter = Isometry3::rotation(nalgebra::Vector3::z() * std::f64::consts::FRAC_PI_2);
        let turned = occupancy_grid(Header::default(), &volume, &quarter, heights).unwrap();
        assert_eq!((turned.width, turned.height), (found.height, found.width));
        let count = |grid: &OccupancyGrid| grid.data.0.iter().filter(|&&cell| cell == OCCUPIED).count();
        assert_eq!(count(&turned), count(&found));
        assert!(
            occupancy_grid(
                Header::default(),
                &volume,
                &Isometry3::from_parts(Default::default(), optical()),
                [90.0, 91.0]
            )
            .is_none()
        );
    }
}

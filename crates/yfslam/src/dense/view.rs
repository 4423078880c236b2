//! Access to the dense map while the system runs.
//!
//! In: the patches of the mapper and the present map. Out: the volume and the products.

use super::cloud::{CloudPoint, cloud};
use super::grid::{GroundGrid, ground_grid};
use super::mesh::{Mesh, mesh};
use super::{DenseMap, DenseMapper, Volume};
use crate::map::Map;

/// The present dense map, in the world of the submap that has most keyframe patches, turned so that the z-axis points up in the
/// first image (ROS, REP 103). With [`Execution::Threaded`](crate::Execution::Threaded) each call waits until all patches are
/// integrated.
pub struct DenseView<'a> {
    mapper: &'a mut DenseMapper,
    map: &'a Map,
}

impl<'a> DenseView<'a> {
    pub(crate) fn new(mapper: &'a mut DenseMapper, map: &'a Map) -> Self {
        Self { mapper, map }
    }

    /// Returns occupied, free and unknown space.
    pub fn volume(&mut self) -> Volume {
        self.mapper.volume(self.map)
    }

    /// Returns a coloured point for each occupied voxel.
    pub fn cloud(&mut self) -> Vec<CloudPoint> {
        cloud(&self.snapshot(), &self.volume(), |_| {})
    }

    /// Returns the grid of obstacles between two heights, m, for navigation.
    pub fn ground_grid(&mut self, heights_m: [f32; 2]) -> GroundGrid {
        ground_grid(&self.volume(), heights_m)
    }

    /// Returns the coloured mesh of the surfaces.
    pub fn mesh(&mut self) -> Mesh {
        mesh(&self.snapshot(), &self.volume(), |_, _| {})
    }

    /// Returns the keyframe patches with their poses, which can be saved and from which all products are made.
    pub fn snapshot(&mut self) -> DenseMap {
        self.mapper.snapshot(self.map)
    }
}

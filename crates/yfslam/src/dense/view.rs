//! Access to the dense map while the system runs.
//!
//! In: the patches of the mapper and the present map. Out: the volume and the products.

use super::cloud::{CloudPoint, cloud};
use super::grid::{GroundGrid, ground_grid};
use super::mesh::{Mesh, mesh};
use super::{DenseMap, DenseMapper, MapFrame, Volume};
use crate::map::Map;

/// The present dense map of the submap that has most keyframe patches, in the map frame of the saved map that the session continues, else in
/// that of an upright first image ([`MapFrame::default`]). With [`Execution::Threaded`](crate::Execution::Threaded) each call waits until all patches are
/// integrated.
pub struct DenseView<'a> {
    mapper: &'a mut DenseMapper,
    map: &'a Map,
    frame: Option<MapFrame>,
}

impl<'a> DenseView<'a> {
    pub(crate) fn new(mapper: &'a mut DenseMapper, map: &'a Map, frame: Option<MapFrame>) -> Self {
        Self { mapper, map, frame }
    }

    /// Returns occupied, free and unknown space.
    pub fn volume(&mut self) -> Volume {
        self.mapper.volume(self.map)
    }

    /// Returns a coloured point for each occupied voxel.
    pub fn cloud(&mut self) -> Vec<CloudPoint> {
        cloud(&self.mapper.snapshot(self.map), &self.volume(), |_| {})
    }

    /// Returns the grid of obstacles between two heights, m, for navigation.
    pub fn ground_grid(&mut self, heights_m: [f32; 2]) -> GroundGrid {
        ground_grid(&self.volume(), heights_m)
    }

    /// Returns the coloured mesh of the surfaces.
    pub fn mesh(&mut self) -> Mesh {
        mesh(&self.mapper.snapshot(self.map), &self.volume(), |_, _| {})
    }

    /// Returns the keyframe patches with their poses, which can be saved and from which all products are made. The map frame is fixed: that
    /// of the level surfaces, if the session continues no saved map.
    pub fn snapshot(&mut self) -> DenseMap {
        let mut dense_map = self.mapper.snapshot(self.map);
        dense_map.frame = Some(self.frame.unwrap_or_else(|| MapFrame::of_dense_map(&dense_map)));
        dense_map
    }
}

//! Path, landmarks and grid, at intervals and for those who listen.

use std::time::{Duration, Instant};

use nalgebra::{Isometry3, Translation3};
use yfslam_live::LiveSession;

use super::Node;
use crate::convert;
use crate::grid_worker::GridJob;
use crate::messages::Header;
use crate::mount::optical;
use crate::transport::{Outgoing, Topic, Transport};

impl<T: Transport> Node<T> {
    fn map_header(&self) -> Header {
        Header::new(self.last_stamp_ns, self.parameters.text("map_frame"))
    }

    /// Returns the pose of the world of SLAM in the map frame.
    fn t_map_world(&self) -> Option<Isometry3<f64>> {
        self.mount.as_ref().map(|mount| self.t_map_moved * mount.t_map_world)
    }

    pub(super) fn publish_products(&mut self) {
        let (Some(session), Some(mount), Some(t_map_world)) = (&self.session, &self.mount, self.t_map_world()) else {
            return;
        };
        let map = session.slam().map();
        if map.keyframe_count() == 0 {
            return;
        }
        if self.transport.is_wanted(Topic::Path) {
            let path = convert::path(self.map_header(), map, &t_map_world, &mount.t_base_cam);
            self.transport.publish(Outgoing::Path(path));
        }
        if self.transport.is_wanted(Topic::Landmarks) {
            let landmarks = convert::landmarks(self.map_header(), map, &t_map_world);
            self.transport.publish(Outgoing::Landmarks(landmarks));
        }
        if self.transport.is_wanted(Topic::Graph) {
            let graph = convert::graph(&self.map_header(), map, &t_map_world);
            self.transport.publish(Outgoing::Graph(graph));
        }
    }

    /// Publishes a grid that is ready, and begins the next one when it is time and the map has grown.
    pub(super) fn publish_grid(&mut self, now: Instant) {
        let (header, t_map_world) = (self.map_header(), self.t_map_world());
        let Some(worker) = &mut self.grid else { return };
        if let Some((grid, took_ms)) = worker.poll()
            && let Some(grid) = grid
        {
            self.grid_note = Some((took_ms, grid.data.0.len()));
            self.transport.publish(Outgoing::Grid(grid));
        }
        let patches = self.session.as_ref().map_or(0, |session| session.slam().statistics().dense_patches);
        if worker.is_busy() || now < self.due.grid || patches == self.grid_keyframes {
            return;
        }
        self.due.grid = now + Duration::from_secs_f64(self.parameters.number("grid_period"));
        let (Some(t_map_world), Some(slam)) = (t_map_world, self.session.as_mut().map(LiveSession::slam_mut)) else {
            return;
        };
        let Ok(mut dense) = slam.dense() else { return };
        self.grid_keyframes = patches;
        // The volume stands as an upright first camera would see it.
        let t_volume_world = Isometry3::from_parts(Translation3::identity(), optical());
        worker.begin(GridJob {
            header,
            volume: dense.volume(),
            t_map_volume: t_map_world * t_volume_world.inverse(),
            heights_m: ["grid_min_height", "grid_max_height"].map(|name| self.parameters.number(name)),
        });
    }
}

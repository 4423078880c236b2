//! Trajectory, landmarks, cloud, grid: arrays that C gets and frees.

use yfslam::dense::GridCell;

use super::slam::System;
use crate::error::Failure;
use crate::ffi::{Handle, Out, OutHandle, export, guarded};
use crate::structs::{GridInfo, Point, Pose};

export! {
    fn yfslam_get_trajectory(slam: Handle<'_, System>, trajectory: OutHandle<'_, Vec<Pose>>) -> i32 {
        guarded(|| {
            trajectory.check("trajectory")?;
            let poses = slam.required("slam")?.lock()?.slam.trajectory();
            trajectory.set("trajectory", poses.iter().map(|(stamp, pose)| Pose::of(*stamp, pose)).collect())
        })
    }

    fn yfslam_trajectory_data(trajectory: Handle<'_, Vec<Pose>>) -> *const Pose {
        trajectory.get().map_or(std::ptr::null(), |poses| poses.as_ptr())
    }

    fn yfslam_trajectory_size(trajectory: Handle<'_, Vec<Pose>>) -> usize {
        trajectory.get().map_or(0, Vec::len)
    }

    fn yfslam_trajectory_free(trajectory: Handle<'_, Vec<Pose>>) {
        trajectory.free();
    }

    fn yfslam_get_landmarks(slam: Handle<'_, System>, points: OutHandle<'_, Vec<Point>>) -> i32 {
        guarded(|| {
            points.check("points")?;
            let state = slam.required("slam")?.lock()?;
            let landmark = |l: &yfslam::Landmark| Point::new(l.position.coords.cast::<f32>().into(), l.color);
            points.set("points", state.slam.map().landmarks().map(|(_, l)| landmark(l)).collect())
        })
    }

    fn yfslam_get_cloud(slam: Handle<'_, System>, points: OutHandle<'_, Vec<Point>>) -> i32 {
        guarded(|| {
            points.check("points")?;
            let mut state = slam.required("slam")?.lock()?;
            let cloud = state.slam.dense().map_err(Failure::setup)?.cloud();
            points.set("points", cloud.iter().map(|p| Point::new(p.position_m, p.color)).collect())
        })
    }

    fn yfslam_points_data(points: Handle<'_, Vec<Point>>) -> *const Point {
        points.get().map_or(std::ptr::null(), |points| points.as_ptr())
    }

    fn yfslam_points_size(points: Handle<'_, Vec<Point>>) -> usize {
        points.get().map_or(0, Vec::len)
    }

    fn yfslam_points_free(points: Handle<'_, Vec<Point>>) {
        points.free();
    }

    fn yfslam_get_grid(
        slam: Handle<'_, System>,
        low_m: f32,
        high_m: f32,
        info: Out<'_, GridInfo>,
        grid: OutHandle<'_, Vec<u8>>,
    ) -> i32 {
        guarded(|| {
            info.check("info")?;
            grid.check("grid")?;
            if low_m.is_nan() || high_m.is_nan() || low_m >= high_m {
                return Err(Failure::argument(format!("the heights {low_m} and {high_m} m do not ascend")));
            }
            let mut state = slam.required("slam")?.lock()?;
            let ground = state.slam.dense().map_err(Failure::setup)?.ground_grid([low_m, high_m]);
            let side = |cells: usize| u32::try_from(cells).unwrap_or(u32::MAX);
            let (width, height) = (side(ground.width), side(ground.height));
            let (origin_m, resolution_m) = (ground.origin_m, ground.resolution_m);
            info.set("info", &GridInfo { width, height, origin_m, resolution_m, ..GridInfo::default() })?;
            let cell = |cell: &GridCell| match cell {
                GridCell::Unknown => 0,
                GridCell::Free => 1,
                GridCell::Occupied => 2,
            };
            grid.set("grid", ground.cells.iter().map(cell).collect())
        })
    }

    fn yfslam_grid_data(grid: Handle<'_, Vec<u8>>) -> *const u8 {
        grid.get().map_or(std::ptr::null(), |cells| cells.as_ptr())
    }

    fn yfslam_grid_free(grid: Handle<'_, Vec<u8>>) {
        grid.free();
    }
}

impl Point {
    fn new(position_m: [f32; 3], color: [u8; 3]) -> Self {
        Self { position_m, color, reserved: 0 }
    }
}

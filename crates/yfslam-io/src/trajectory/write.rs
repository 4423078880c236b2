//! Writes trajectories.

use std::io::{self, Write};
use std::path::Path;

use super::{StampedPose, TrajectoryFormat};
use crate::atomic_file::write_atomically;
use crate::error::Result;
use crate::time::format_stamp;

/// Writes poses in the format of TUM, with all nine decimals of their stamps.
///
/// # Errors
/// The file cannot be written, or a pose is not finite.
pub fn write_trajectory(path: &Path, poses: &[StampedPose]) -> Result<()> {
    write_trajectory_as(path, poses, TrajectoryFormat::Tum)
}

/// Writes poses in a format; that of KITTI has no stamps.
///
/// # Errors
/// The file cannot be written, or a pose is not finite.
pub fn write_trajectory_as(path: &Path, poses: &[StampedPose], format: TrajectoryFormat) -> Result<()> {
    write_atomically(path, |writer| {
        match format {
            TrajectoryFormat::Tum => writeln!(writer, "# timestamp tx ty tz qx qy qz qw")?,
            TrajectoryFormat::Euroc => {
                writeln!(
                    writer,
                    "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []"
                )?;
            }
            TrajectoryFormat::VslamLab => writeln!(writer, "ts (ns),tx (m),ty (m),tz (m),qx,qy,qz,qw")?,
            TrajectoryFormat::Kitti => {}
        }
        for pose in poses {
            line(&mut *writer, pose, format)?;
        }
        Ok(())
    })
}

fn line(writer: &mut (impl Write + ?Sized), pose: &StampedPose, format: TrajectoryFormat) -> io::Result<()> {
    let StampedPose { timestamp_ns, t_world_cam } = pose;
    let (t, q) = (t_world_cam.translation.vector, t_world_cam.rotation.coords);
    let stamp = format_stamp(*timestamp_ns);
    if !t.iter().chain(q.iter()).all(|value| value.is_finite()) {
        return Err(io::Error::new(io::ErrorKind::InvalidData, format!("the pose at {stamp} is not finite")));
    }
    match format {
        TrajectoryFormat::Tum => {
            writeln!(writer, "{stamp} {:.9} {:.9} {:.9} {:.9} {:.9} {:.9} {:.9}", t.x, t.y, t.z, q.x, q.y, q.z, q.w)
        }
        TrajectoryFormat::Euroc => {
            writeln!(
                writer,
                "{timestamp_ns},{:.9},{:.9},{:.9},{:.9},{:.9},{:.9},{:.9}",
                t.x, t.y, t.z, q.w, q.x, q.y, q.z
            )
        }
        TrajectoryFormat::VslamLab => {
            writeln!(
                writer,
                "{timestamp_ns},{:.9},{:.9},{:.9},{:.9},{:.9},{:.9},{:.9}",
                t.x, t.y, t.z, q.x, q.y, q.z, q.w
            )
        }
        TrajectoryFormat::Kitti => {
            let m = t_world_cam.to_matrix();
            let rows = (0..3).flat_map(|row| (0..4).map(move |column| (row, column)));
            let words: Vec<String> = rows.filter_map(|at| m.get(at)).map(|value| format!("{value:.12e}")).collect();
            writeln!(writer, "{}", words.join(" "))
        }
    }
}

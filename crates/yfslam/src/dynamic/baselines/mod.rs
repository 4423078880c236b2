//! Dynamic filters of published systems, with the constants of their papers, for comparison within the same SLAM system.

mod dms_slam;
mod ds_slam;
mod dyna_slam;

pub(crate) use dms_slam::DmsSlam;
pub(crate) use ds_slam::DsSlam;
pub(crate) use dyna_slam::DynaSlam;

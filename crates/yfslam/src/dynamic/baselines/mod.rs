//! The dynamic filters of published systems on our front end and back end, for comparison, with the constants of the papers.

mod dms_slam;
mod ds_slam;
mod dyna_slam;

pub(crate) use dms_slam::DmsSlam;
pub(crate) use ds_slam::DsSlam;
pub(crate) use dyna_slam::DynaSlam;

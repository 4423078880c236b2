//! The dynamic filters of published systems on our front end and back end, for comparison, with the constants of the papers.

mod dms_slam;
mod ds_slam;
mod dyna_slam;

pub use dms_slam::DmsSlam;
pub use ds_slam::DsSlam;
pub use dyna_slam::DynaSlam;

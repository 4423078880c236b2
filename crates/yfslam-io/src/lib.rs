//! yfslam-io

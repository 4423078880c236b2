//! yfslam-detect

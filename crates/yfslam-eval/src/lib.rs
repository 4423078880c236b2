//! yfslam-eval

//! yfslam-synth

//! The command `yfslam`.
fn main() {}

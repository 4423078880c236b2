#![no_main]
yfslam_fuzz_targets::fuzz!("bag_ros1");

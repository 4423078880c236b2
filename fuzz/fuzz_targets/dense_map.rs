#![no_main]
yfslam_fuzz_targets::fuzz!("dense_map");

#![no_main]
yfslam_fuzz_targets::fuzz!("image_depth");

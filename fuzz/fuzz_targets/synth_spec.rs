#![no_main]
yfslam_fuzz_targets::fuzz!("synth_spec");

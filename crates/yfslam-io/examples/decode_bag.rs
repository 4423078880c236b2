//! Decodes all frames of bags and prints how long it took, for `tools/bag_throughput.py`.
//!
//! In: bags with their own calibration. Out: for each, the number of frames, and the seconds from opening the file to the last image; then
//! the largest memory of the process, where the system tells it.
#![allow(clippy::print_stdout, reason = "an example prints its result")]

use std::hint::black_box;
use std::time::Instant;

use yfslam_io::stream::DEFAULT_LOOK_AHEAD;
use yfslam_io::{Error, FrameStream, Result, Sequence, SequenceOptions};

fn main() -> Result<()> {
    for path in std::env::args_os().skip(1) {
        let started = Instant::now();
        let sequence = Sequence::open(path.as_ref(), &SequenceOptions::default())?;
        let opened = started.elapsed().as_secs_f64();
        let Some(calibration) = &sequence.calibration else {
            return Err(Error::Argument { problem: "no calibration".into(), cure: "record camera_info".into() });
        };
        let frames = FrameStream::open(&sequence, &calibration.camera, DEFAULT_LOOK_AHEAD)?.flatten();
        let frames = frames.map(black_box).count();
        let took = started.elapsed().as_secs_f64();
        println!("{} {frames} frames {took:.3} s (opened in {opened:.3} s)", path.display());
    }
    // What the system counts for a child process would include the memory of the process that started it.
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    if let Some(peak) = status.lines().find_map(|line| line.strip_prefix("VmHWM:")) {
        println!("peak {}", peak.trim());
    }
    Ok(())
}

//! Decodes all frames of a recording and prints how long it took, for `tools/bag_throughput.py`.
//!
//! In: a bag or a folder with its own calibration. Out: frames, seconds from the opening of the file to the last image, and a sum over all pixels.
#![allow(clippy::print_stdout, reason = "an example prints its result")]

use std::time::Instant;

use yfslam_io::stream::DEFAULT_LOOK_AHEAD;
use yfslam_io::{Error, FrameStream, Result, Sequence, SequenceOptions};

fn main() -> Result<()> {
    for path in std::env::args_os().skip(1) {
        let started = Instant::now();
        let sequence = Sequence::open(path.as_ref(), &SequenceOptions::default())?;
        let opened = started.elapsed();
        let Some(calibration) = &sequence.calibration else {
            return Err(Error::Argument { problem: "no calibration".into(), cure: "record camera_info".into() });
        };
        let (mut frames, mut sum) = (0, 0u64);
        for frame in FrameStream::open(&sequence, &calibration.camera, DEFAULT_LOOK_AHEAD)?.flatten() {
            frames += 1;
            sum += frame.color.data().as_flattened().iter().map(|&value| u64::from(value)).sum::<u64>();
            sum += frame.depth.iter().flat_map(|depth| depth.raw.data()).map(|&value| u64::from(value)).sum::<u64>();
        }
        let took = started.elapsed().as_secs_f64();
        println!("{} {frames} frames {took:.3} s (opened in {:.3} s) sum {sum}", path.display(), opened.as_secs_f64());
    }
    Ok(())
}

//! Processor time of the whole process over the frames of a run, and its parts.
//!
//! The total is the processor time of all threads. Parts are measured separately: tracking, mapping, detection and the dense map where
//! they are called, the work of other threads by the names of these threads. What no part covers is `other`.

use std::time::Duration;

use serde::Serialize;

use super::cpu;
use super::threads::ThreadTimes;

/// The parts of the processor time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Reading and decoding images, or rendering them.
    Reading,
    Detector,
    /// Features, dynamic filter and pose of every frame.
    Tracking,
    /// Keyframe insertion, bundle adjustment, loop closing and relocalisation.
    Mapping,
    /// Keyframe patches and dense map.
    Dense,
}

impl Part {
    pub const ALL: [Self; 5] = [Self::Reading, Self::Detector, Self::Tracking, Self::Mapping, Self::Dense];

    pub fn name(self) -> &'static str {
        match self {
            Self::Reading => "reading",
            Self::Detector => "detector",
            Self::Tracking => "tracking",
            Self::Mapping => "mapping and loops",
            Self::Dense => "dense map",
        }
    }
}

/// Processor time by part.
#[derive(Clone, Copy, Debug, Default)]
pub struct Parts([Duration; Part::ALL.len()]);

impl Parts {
    pub fn add(&mut self, part: Part, took: Duration) {
        self.0[part as usize] += took;
    }

    pub fn get(&self, part: Part) -> Duration {
        self.0[part as usize]
    }

    /// Returns the sum of both for each part.
    pub fn and(mut self, other: &Self) -> Self {
        self.0.iter_mut().zip(other.0).for_each(|(sum, took)| *sum += took);
        self
    }

    pub fn total(&self) -> Duration {
        self.0.iter().sum()
    }
}

/// Measures the process from its creation to [`ProcessMeter::finish`].
pub struct ProcessMeter {
    started: Option<Duration>,
    threads: ThreadTimes,
    frames: usize,
}

/// The processor time of all threads over the frames of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct ProcessTime {
    /// `None` where the system does not measure it.
    pub total: Option<Duration>,
    /// Frames in this time.
    pub frames: usize,
    /// Parts that threads of their own took.
    pub threads: Parts,
}

impl ProcessMeter {
    pub fn start() -> Self {
        Self { threads: ThreadTimes::start(), started: cpu::process_time(), frames: 0 }
    }

    /// Counts a frame.
    pub fn frame(&mut self) {
        self.frames += 1;
        self.threads.update();
    }

    pub fn finish(mut self) -> ProcessTime {
        self.threads.update();
        let total = cpu::process_time().zip(self.started).map(|(now, started)| now.saturating_sub(started));
        ProcessTime { total, frames: self.frames, threads: self.threads.parts() }
    }
}

/// The processor time of a frame, ms: the total and what it consists of.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FrameCost {
    #[serde(skip)]
    pub total: f64,
    /// The total over all frames, s.
    #[serde(skip)]
    pub process_s: f64,
    pub reading: f64,
    pub detector: f64,
    pub tracking: f64,
    pub mapping_and_loops: f64,
    pub dense_map: f64,
    /// Parts that belong to other methods of the same run; left out if there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub other_methods: Option<f64>,
    /// The rest of the total. It is 0 if the parts, which are measured separately, exceed the total.
    pub other: f64,
}

impl FrameCost {
    /// Divides the process among the frames; `own` are the parts of one method, `others` those of the other methods.
    pub fn new(process: &ProcessTime, own: &Parts, others: Option<&Parts>) -> Option<Self> {
        let frames = process.frames.max(1) as f64;
        let ms = |time: Duration| (time.as_secs_f64() * 1e6 / frames).round() / 1e3;
        let total = process.total?;
        let own = own.and(&process.threads);
        let known = own.total() + others.map_or(Duration::ZERO, Parts::total);
        Some(Self {
            total: ms(total),
            process_s: total.as_secs_f64(),
            reading: ms(own.get(Part::Reading)),
            detector: ms(own.get(Part::Detector)),
            tracking: ms(own.get(Part::Tracking)),
            mapping_and_loops: ms(own.get(Part::Mapping)),
            dense_map: ms(own.get(Part::Dense)),
            other_methods: others.map(|others| ms(others.total())),
            other: ms(total.saturating_sub(known)),
        })
    }

    /// Returns names and values of what the total consists of.
    pub fn parts(&self) -> Vec<(&'static str, f64)> {
        let values = [self.reading, self.detector, self.tracking, self.mapping_and_loops, self.dense_map];
        let parts = Part::ALL.map(Part::name).into_iter().zip(values);
        let others = self.other_methods.map(|ms| ("other methods", ms));
        parts.chain(others).chain([("other", self.other)]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_of_a_frame_add_up_to_the_total() {
        let mut own = Parts::default();
        own.add(Part::Tracking, Duration::from_millis(30));
        own.add(Part::Mapping, Duration::from_millis(10));
        let mut threads = Parts::default();
        threads.add(Part::Reading, Duration::from_millis(20));
        let process = ProcessTime { total: Some(Duration::from_millis(80)), frames: 10, threads };
        let cost = FrameCost::new(&process, &own, None).unwrap();
        assert_eq!((cost.total, cost.reading, cost.tracking, cost.other), (8.0, 2.0, 3.0, 2.0));
        let sum: f64 = cost.parts().iter().map(|(_, ms)| ms).sum();
        assert!((sum - cost.total).abs() < 1e-9, "{sum}");
        let with_others = FrameCost::new(&process, &own, Some(&own)).unwrap();
        assert_eq!((with_others.other_methods, with_others.other), (Some(4.0), 0.0));
    }

    #[test]
    fn the_meter_counts_all_threads() {
        let mut meter = ProcessMeter::start();
        let work = || (0..30_000_000_u64).fold(0, |a: u64, b| std::hint::black_box(a ^ b.wrapping_mul(a)));
        std::thread::spawn(work).join().unwrap();
        meter.frame();
        let process = meter.finish();
        assert_eq!(process.frames, 1);
        assert!(process.total.is_none_or(|total| total > Duration::from_millis(1)), "{process:?}");
    }
}

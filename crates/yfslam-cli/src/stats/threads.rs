//! Processor time of threads by their names, where the system reports it (Linux).

#[cfg(target_os = "linux")]
use std::{collections::BTreeMap, fs, fs::File, os::unix::fs::FileExt, time::Duration};

use super::process::{Part, Parts};

/// Starts of the names of threads, and the part of the processor time to which their work belongs.
const NAMES: [(&str, Part); 8] = [
    ("yfslam-color", Part::Reading),
    ("yfslam-depth", Part::Reading),
    ("yfslam-right", Part::Reading),
    ("yfslam-render", Part::Reading),
    ("stereo", Part::Tracking),
    ("mapping", Part::Mapping),
    ("global bundle", Part::Mapping),
    ("dense map", Part::Dense),
];

/// Frames between two searches for new threads.
#[cfg(target_os = "linux")]
const SEARCH_EVERY: usize = 16;

/// Follows the threads of this process whose names are known. A thread that ends keeps the time that was read last.
#[derive(Default)]
pub struct ThreadTimes {
    #[cfg(target_os = "linux")]
    threads: BTreeMap<String, Option<Followed>>,
    #[cfg(target_os = "linux")]
    updates: usize,
}

#[cfg(target_os = "linux")]
struct Followed {
    part: Part,
    file: File,
    started: Duration,
    now: Duration,
}

#[cfg(target_os = "linux")]
impl ThreadTimes {
    pub fn start() -> Self {
        let mut times = Self::default();
        times.search();
        for followed in times.threads.values_mut().flatten() {
            followed.update();
            followed.started = followed.now;
        }
        times
    }

    /// Reads the times of all threads.
    pub fn update(&mut self) {
        if self.updates.is_multiple_of(SEARCH_EVERY) {
            self.search();
        }
        self.updates += 1;
        self.threads.values_mut().flatten().for_each(Followed::update);
    }

    /// Returns the times since the start.
    pub fn parts(&self) -> Parts {
        let mut parts = Parts::default();
        for followed in self.threads.values().flatten() {
            parts.add(followed.part, followed.now.saturating_sub(followed.started));
        }
        parts
    }

    fn search(&mut self) {
        for entry in fs::read_dir("/proc/self/task").into_iter().flatten().flatten() {
            let id = entry.file_name().to_string_lossy().into_owned();
            self.threads.entry(id).or_insert_with(|| {
                let name = fs::read_to_string(entry.path().join("comm")).ok()?;
                let (_, part) = NAMES.into_iter().find(|(start, _)| name.starts_with(start))?;
                let file = File::open(entry.path().join("schedstat")).ok()?;
                Some(Followed { part, file, started: Duration::ZERO, now: Duration::ZERO })
            });
        }
    }
}

#[cfg(target_os = "linux")]
impl Followed {
    /// Reads the time; the first number of the file is the time on a processor, ns.
    fn update(&mut self) {
        let mut bytes = [0; 32];
        let text = self.file.read_at(&mut bytes, 0).ok().and_then(|length| str::from_utf8(&bytes[..length]).ok());
        if let Some(ns) = text.and_then(|text| text.split(' ').next()?.parse().ok()) {
            self.now = Duration::from_nanos(ns);
        }
    }
}

#[cfg(not(target_os = "linux"))]
impl ThreadTimes {
    pub fn start() -> Self {
        let _ = NAMES;
        Self::default()
    }

    pub fn update(&mut self) {}

    pub fn parts(&self) -> Parts {
        Parts::default()
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn the_work_of_a_thread_is_counted_by_its_name() {
        let mut times = ThreadTimes::start();
        let (done, go_on) = (std::sync::Barrier::new(2), std::sync::Barrier::new(2));
        std::thread::scope(|scope| {
            let work = || {
                std::hint::black_box((0..50_000_000_u64).fold(1, |a: u64, b| std::hint::black_box(a ^ b)));
                done.wait();
                go_on.wait();
            };
            std::thread::Builder::new().name("dense map".into()).spawn_scoped(scope, work).unwrap();
            done.wait();
            times.update();
            go_on.wait();
        });
        assert!(times.parts().get(Part::Dense) > Duration::from_millis(5), "{:?}", times.parts());
        assert_eq!(times.parts().get(Part::Reading), Duration::ZERO);
    }
}

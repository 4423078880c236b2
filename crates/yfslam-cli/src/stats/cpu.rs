//! Processor time of this thread and of this process, which does not depend on other work on the machine.

use std::time::Duration;

/// Returns the processor time of the calling thread so far; `None` where the system does not measure it.
pub fn thread_time() -> Option<Duration> {
    #[cfg(unix)]
    return clock(rustix::time::ClockId::ThreadCPUTime);
    #[cfg(not(unix))]
    None
}

/// Returns the processor time of all threads of this process so far; `None` where the system does not measure it.
pub fn process_time() -> Option<Duration> {
    #[cfg(unix)]
    return clock(rustix::time::ClockId::ProcessCPUTime);
    #[cfg(not(unix))]
    None
}

#[cfg(unix)]
fn clock(id: rustix::time::ClockId) -> Option<Duration> {
    let time = rustix::time::clock_gettime(id);
    Some(Duration::new(time.tv_sec.try_into().ok()?, time.tv_nsec.try_into().ok()?))
}

/// Returns the result of `work`, and the processor time of this thread that it took.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, Option<Duration>) {
    let before = thread_time();
    let result = work();
    let took = thread_time().zip(before).map(|(after, before)| after.saturating_sub(before));
    (result, took)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sleep_takes_no_processor_time_and_work_does() {
        let ((), slept) = timed(|| std::thread::sleep(Duration::from_millis(50)));
        let (sum, worked) =
            timed(|| (0..20_000_000_u64).fold(0, |a: u64, b| std::hint::black_box(a ^ b.wrapping_mul(a))));
        assert_eq!(sum, 0);
        if let (Some(slept), Some(worked)) = (slept, worked) {
            assert!(slept < Duration::from_millis(25) && worked > Duration::from_millis(1), "{slept:?} {worked:?}");
        }
    }
}

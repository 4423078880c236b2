//! Rates and latencies over the last frames.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Time over which a rate is measured.
const RATE_OVER: Duration = Duration::from_secs(2);

/// Most arrivals that a rate remembers.
const MOST_ARRIVALS: usize = 512;

/// Latencies of which the order statistics are taken.
const LATENCIES: usize = 256;

/// The rate of events over the last two seconds.
#[derive(Clone, Debug, Default)]
pub struct RateMeter(VecDeque<Instant>);

impl RateMeter {
    /// Counts an event.
    pub fn count(&mut self, now: Instant) {
        if self.0.len() == MOST_ARRIVALS {
            self.0.pop_front();
        }
        self.0.push_back(now);
    }

    /// Returns events per second; 0 when none came of late.
    pub fn per_second(&self, now: Instant) -> f64 {
        let recent = self.0.iter().filter(|&&at| now.saturating_duration_since(at) <= RATE_OVER);
        let (count, first) = recent.fold((0_u32, None), |(count, first), &at| (count + 1, first.or(Some(at))));
        match first {
            Some(first) if count > 1 => {
                f64::from(count - 1) / now.saturating_duration_since(first).as_secs_f64().max(1e-3)
            }
            _ => 0.0,
        }
    }
}

/// The latencies of the last frames.
#[derive(Clone, Debug, Default)]
pub struct LatencyMeter(VecDeque<Duration>);

impl LatencyMeter {
    /// Adds the latency of a frame.
    pub fn add(&mut self, latency: Duration) {
        if self.0.len() == LATENCIES {
            self.0.pop_front();
        }
        self.0.push_back(latency);
    }

    /// Returns the latency that this share of the last frames does not exceed (nearest rank).
    pub fn quantile(&self, share: f64) -> Option<Duration> {
        let mut sorted: Vec<_> = self.0.iter().copied().collect();
        sorted.sort_unstable();
        let rank = ((share.clamp(0.0, 1.0) * sorted.len() as f64).ceil() as usize).saturating_sub(1);
        sorted.get(rank).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_is_that_of_the_last_two_seconds() {
        let start = Instant::now();
        let mut rate = RateMeter::default();
        (0..=60).for_each(|i| rate.count(start + Duration::from_millis(50 * i)));
        assert!((rate.per_second(start + Duration::from_secs(3)) - 20.0).abs() < 0.5);
        assert_eq!(rate.per_second(start + Duration::from_secs(9)), 0.0);
    }

    #[test]
    fn quantiles_are_nearest_ranks() {
        let mut meter = LatencyMeter::default();
        assert_eq!(meter.quantile(0.5), None);
        (1..=100).for_each(|ms| meter.add(Duration::from_millis(ms)));
        assert_eq!([0.5, 0.99].map(|share| meter.quantile(share).map(|d| d.as_millis())), [Some(50), Some(99)]);
    }
}

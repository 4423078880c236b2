//! Durations of the stages of all frames.

use std::time::Duration;

use serde::ser::{Serialize, SerializeMap, Serializer};

/// Durations of the stages, in the order in which the stages first ran.
#[derive(Clone, Debug, Default)]
pub struct Stages(Vec<(&'static str, Vec<Duration>)>);

/// Order statistics of one stage (nearest rank), ms.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct StageSummary {
    /// Number of runs.
    pub count: usize,
    pub median_ms: f64,
    pub p95_ms: f64,
    pub p99_ms: f64,
    pub max_ms: f64,
}

impl Stages {
    /// Adds the duration of one run of a stage.
    pub fn push(&mut self, stage: &'static str, took: Duration) {
        match self.0.iter_mut().find(|(name, _)| *name == stage) {
            Some((_, durations)) => durations.push(took),
            None => self.0.push((stage, vec![took])),
        }
    }

    /// Returns these stages, then those of `other`.
    pub fn and(&self, other: &Self) -> Self {
        Self(self.0.iter().chain(&other.0).cloned().collect())
    }

    /// Returns the duration of all runs of a stage together.
    pub fn total(&self, stage: &str) -> Duration {
        self.0.iter().filter(|(name, _)| *name == stage).flat_map(|(_, durations)| durations).sum()
    }

    /// Returns each stage with its statistics.
    pub fn summaries(&self) -> impl Iterator<Item = (&'static str, StageSummary)> {
        self.0.iter().filter_map(|(name, durations)| Some((*name, StageSummary::of(durations)?)))
    }
}

impl StageSummary {
    /// Computes statistics; `None` if the stage never ran.
    pub fn of(durations: &[Duration]) -> Option<Self> {
        let mut sorted = durations.to_vec();
        sorted.sort_unstable();
        let count = sorted.len();
        let rank = |share: f64| ((share * count as f64).ceil() as usize).saturating_sub(1);
        let ms = |index: usize| Some((sorted.get(index)?.as_secs_f64() * 1e6).round() / 1e3);
        Some(Self {
            count,
            median_ms: ms(rank(0.5))?,
            p95_ms: ms(rank(0.95))?,
            p99_ms: ms(rank(0.99))?,
            max_ms: ms(count.checked_sub(1)?)?,
        })
    }
}

impl Serialize for Stages {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        for (name, summary) in self.summaries() {
            map.serialize_entry(&name.replace(' ', "_"), &summary)?;
        }
        map.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_are_nearest_ranks_and_stages_keep_their_order() {
        let mut stages = Stages::default();
        for ms in (1..=100).rev() {
            stages.push("late", Duration::from_millis(ms));
        }
        stages.push("alone", Duration::from_micros(1500));
        let found: Vec<_> = stages.summaries().collect();
        assert_eq!(
            found[0],
            ("late", StageSummary { count: 100, median_ms: 50.0, p95_ms: 95.0, p99_ms: 99.0, max_ms: 100.0 })
        );
        assert_eq!(
            found[1],
            ("alone", StageSummary { count: 1, median_ms: 1.5, p95_ms: 1.5, p99_ms: 1.5, max_ms: 1.5 })
        );
        assert_eq!(StageSummary::of(&[]), None);
    }
}

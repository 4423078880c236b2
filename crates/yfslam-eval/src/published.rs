//! Published errors for the dynamic sequences of the TUM RGB-D benchmark and of the Bonn data set.
//!
//! In: the original folder name of a sequence. Out: the errors that papers report for the whole sequence. The figures are in
//! `published.csv`, each with its source.

/// The error that a figure states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// Absolute trajectory error, m.
    Ate,
    /// Translation of the relative pose error over a second, m.
    RpeTranslation,
    /// Rotation of the relative pose error over a second, degrees.
    RpeRotation,
}

/// One published figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Published {
    /// Folder name of the sequence.
    pub sequence: &'static str,
    /// The error.
    pub measure: Measure,
    /// The system.
    pub system: &'static str,
    /// Root of the mean square, in the unit of the measure.
    pub rmse: f64,
    /// Standard deviation, if the paper states it.
    pub std: Option<f64>,
    /// The publication.
    pub source: &'static str,
}

const FIGURES: &str = include_str!("published.csv");

/// Returns the published figures of a sequence, in the order of the file.
pub fn published(sequence: &str, measure: Measure) -> impl Iterator<Item = Published> {
    all().filter(move |figure| figure.sequence == sequence && figure.measure == measure)
}

/// Returns all figures of the file except malformed lines, which a test excludes.
fn all() -> impl Iterator<Item = Published> {
    FIGURES.lines().skip(1).filter_map(parse)
}

fn parse(line: &'static str) -> Option<Published> {
    let mut fields = line.split(',');
    let (sequence, measure, system) = (fields.next()?, fields.next()?, fields.next()?);
    let measure = match measure {
        "ate" => Measure::Ate,
        "rpe_translation" => Measure::RpeTranslation,
        "rpe_rotation" => Measure::RpeRotation,
        _ => return None,
    };
    let rmse = fields.next()?.parse().ok()?;
    let std = match fields.next()? {
        "" => None,
        text => Some(text.parse().ok()?),
    };
    let source = fields.next().filter(|source| !source.is_empty())?;
    fields.next().is_none().then_some(Published { sequence, measure, system, rmse, std, source })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::improvement_percent;

    #[test]
    fn every_line_is_a_figure_and_no_system_has_two_for_the_same_sequence() {
        assert_eq!(all().count(), FIGURES.lines().count() - 1);
        let mut keys: Vec<String> = all().map(|f| format!("{} {:?} {}", f.sequence, f.measure, f.system)).collect();
        keys.sort();
        let count = keys.len();
        keys.dedup();
        assert_eq!(keys.len(), count);
        assert!(all().all(|f| f.rmse > 0.0 && f.std.is_none_or(|std| std > 0.0 && std <= f.rmse)));
    }

    #[test]
    fn figures_are_those_of_the_papers_and_of_the_requested_sequence_only() {
        let find = |sequence: &str, measure, system: &str| {
            published(sequence, measure).find(|f| f.system == system).map(|f| (f.rmse, f.std))
        };
        let walking = "rgbd_dataset_freiburg3_walking_xyz";
        assert_eq!(find(walking, Measure::Ate, "YF-SLAM"), Some((0.0156, Some(0.0086))));
        assert_eq!(find(walking, Measure::RpeRotation, "ORB-SLAM2"), Some((7.7846, Some(5.8335))));
        assert_eq!(find("rgbd_bonn_crowd", Measure::Ate, "NGD-SLAM"), Some((0.024, None)));
        assert_eq!(
            find("rgbd_dataset_freiburg3_walking_rpy", Measure::Ate, "YF-SLAM"),
            None,
            "the paper has no such row"
        );
        assert_eq!(published("bonn_crowd_dev", Measure::Ate).count(), 0);
        assert_eq!(published("walking_xyz", Measure::Ate).count(), 0);
        // The paper prints 98.27 %.
        let still = "rgbd_dataset_freiburg3_walking_static";
        let [ours, original] = ["YF-SLAM", "ORB-SLAM2"].map(|system| find(still, Measure::Ate, system).unwrap().0);
        assert!((improvement_percent(ours, original).unwrap() - 98.27).abs() < 0.005);
    }
}

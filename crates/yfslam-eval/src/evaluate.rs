//! In: two trajectories and what to measure. Out: every figure of one run, and its table.

use crate::{
    AlignmentKind, Ate, Coverage, DEFAULT_MAX_DIFF_NS, EvalError, Rpe, RpeOptions, StampedPose, Statistics, Table,
    TableStyle, associate, ate, rpe,
};
use serde::{Deserialize, Serialize};

/// The frames that the estimate should have a pose for.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ExpectedFrames {
    /// Not known; there is no tracked fraction.
    #[default]
    Unknown,
    /// Stamps of all frames of the sequence, ns; those without a reference pose do not count.
    StampsNs(Vec<i64>),
    /// Number of the frames that the reference covers.
    Count(usize),
}

/// Options of an evaluation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EvalOptions {
    /// Largest difference between the stamps of a match, ns.
    pub max_diff_ns: u64,
    /// Alignment before the absolute trajectory error. Its scale, if it has one, is also used for the relative errors.
    pub alignment: AlignmentKind,
    /// Relative pose errors to compute.
    pub rpe: Vec<RpeOptions>,
    /// Frames for the tracked fraction.
    pub expected: ExpectedFrames,
}

impl Default for EvalOptions {
    fn default() -> Self {
        Self {
            max_diff_ns: DEFAULT_MAX_DIFF_NS,
            alignment: AlignmentKind::default(),
            rpe: vec![RpeOptions::per_frame(), RpeOptions::per_second()],
            expected: ExpectedFrames::default(),
        }
    }
}

/// All errors of one estimate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Number of poses of the reference.
    pub reference_poses: usize,
    /// Number of poses of the estimate.
    pub estimate_poses: usize,
    /// Number of pairs of poses that were compared.
    pub matches: usize,
    /// Largest allowed difference between the stamps of a match, ns.
    pub max_diff_ns: u64,
    /// Absolute trajectory error.
    pub ate: Ate,
    /// Relative pose errors, in the order of the options.
    pub rpe: Vec<Rpe>,
    /// Tracked fraction, if the expected frames are known.
    pub coverage: Option<Coverage>,
}

/// Associates, aligns and measures; both trajectories are sorted by time.
///
/// # Errors
/// Those of [`associate()`], [`ate`], [`rpe()`] and [`Coverage`].
pub fn evaluate(
    reference: &[StampedPose],
    estimate: &[StampedPose],
    options: &EvalOptions,
) -> Result<Evaluation, EvalError> {
    let matches = associate(reference, estimate, options.max_diff_ns)?;
    let coverage = match &options.expected {
        ExpectedFrames::Unknown => None,
        ExpectedFrames::StampsNs(frames_ns) => {
            Some(Coverage::of_frames(frames_ns, reference, estimate, options.max_diff_ns)?)
        }
        ExpectedFrames::Count(expected) => Some(Coverage::of_count(matches.len(), *expected)?),
    };
    let ate = ate(&matches, options.alignment)?;
    let scaled = ate.alignment.scaled(&matches);
    Ok(Evaluation {
        reference_poses: reference.len(),
        estimate_poses: estimate.len(),
        matches: matches.len(),
        max_diff_ns: options.max_diff_ns,
        ate,
        rpe: options.rpe.iter().map(|o| rpe(&scaled, o)).collect::<Result<_, _>>()?,
        coverage,
    })
}

impl Evaluation {
    /// The figures as a table with a line below that says how the poses were matched and how much was tracked.
    ///
    /// Four decimals: 0.1 mm is the resolution of the usual ground truth.
    pub fn table(&self, style: TableStyle) -> String {
        let mut table = Table::new(["error", "RMSE", "mean", "median", "S.D.", "min", "max", "n"]);
        let mut push = |name: String, s: &Statistics| {
            let figures = [s.rmse, s.mean, s.median, s.std, s.min, s.max].map(|v| format!("{v:.4}"));
            table.push([name].into_iter().chain(figures).chain([s.count.to_string()]));
        };
        push(format!("ATE, {} (m)", self.ate.alignment.kind), &self.ate.translation_m);
        for rpe in &self.rpe {
            let pairs = if rpe.options.all_pairs { "all pairs" } else { "consecutive" };
            push(format!("RPE per {}, {pairs} (m)", rpe.options.delta), &rpe.translation_m);
            push(format!("RPE per {}, {pairs} (deg)", rpe.options.delta), &rpe.rotation_deg);
        }
        let mut text = table.render(style);
        text += &format!(
            "\n{} matches of {} estimated and {} reference poses within {} ms",
            self.matches,
            self.estimate_poses,
            self.reference_poses,
            self.max_diff_ns as f64 / 1e6
        );
        if self.ate.alignment.kind == AlignmentKind::Sim3 {
            text += &format!("; {}", self.ate.alignment);
        }
        if let Some(c) = &self.coverage {
            text += &format!("; tracked {} of {} frames ({:.1} %)", c.tracked, c.expected, 100.0 * c.fraction);
        }
        text + "\n"
    }
}

//! Fits the readout time of a rolling shutter, and the delay of the depth images, to a recording without ground truth.
//!
//! In: a recording and a calibrated camera. Out: the readout time at which the system estimates what it uses, and the delay with which the
//! measured depths agree best with the map. Every value is tried with a whole run of the system, so that nothing of the result depends on
//! values before it.

use anyhow::{Result, bail, ensure};
use nalgebra::{Matrix3, Vector3};
use yfslam::config::ReadoutEstimation;
use yfslam::{Camera, Config, Readout};

use super::map_args::MapArgs;
use super::method_run::MethodRun;
use crate::input::boxes::BoxOrigin;
use crate::input::detector::{DetectorArgs, load_for};
use crate::input::source::{Source, SourceArgs};
use crate::stats::stages::Stages;
use crate::ui::interrupt::Interrupt;
use crate::ui::progress::Progress;
use crate::ui::terminal::Terminal;

/// Most runs in which the readout time is estimated.
const MAX_PASSES: usize = 5;
/// Change of the estimate below which it has converged, ms.
const CONVERGED_MS: f64 = 0.3;
/// Standard deviation up to which an estimate counts as certain, ms, unless the configuration admits a larger one. It is larger than that of a
/// run, whose estimate has to be final after the first seconds.
const MAX_SIGMA_MS: f64 = 2.0;
/// Standard deviations from which a value is different from 0.
const CLEAR_SIGMAS: f64 = 3.0;
/// Delays are tried up to this one, in both directions, ms: more than half of the time between two images of most cameras.
const MAX_DELAY_MS: f64 = 20.0;
/// Difference between two delays that are tried, ms.
const DELAY_STEP_MS: f64 = 5.0;
/// The share of the residual without delay by which that of another delay must be lower.
const MIN_GAIN: f64 = 0.03;

/// Runs the system on a recording with trial values of the shutter.
pub struct Calibrator<'a> {
    pub source: &'a SourceArgs,
    pub detector: &'a DetectorArgs,
    pub config: Config,
    /// Time between two frames, ms: no readout takes longer.
    pub frame_ms: f64,
    pub boxes: BoxOrigin,
    pub interrupt: &'a Interrupt,
    pub terminal: Terminal,
}

/// One run in which the readout time was estimated.
#[derive(Clone, Copy, Debug)]
pub struct ReadoutPass {
    /// The readout time that the camera had; `None` in the first run.
    pub given_ms: Option<f64>,
    pub readout: Readout,
}

/// A readout time with its standard deviation, ms; 0 for a global shutter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedReadout {
    pub readout_ms: f64,
    pub sigma_ms: f64,
}

/// The residuals of depth for all delays that were tried.
#[derive(Clone, Debug)]
pub struct DelayFit {
    /// Delay, ms, and residual; `None` where no depth could be compared. Delays ascend.
    pub trials: Vec<(f64, Option<f64>)>,
    /// The delay with which the depths agree best, ms; 0 unless another one is clearly better.
    pub delay_ms: f64,
    /// Standard deviation of the best delay, ms; `None` if none is clearly best.
    pub sigma_ms: Option<f64>,
    /// Whether the depths agree best beyond the delays that were tried.
    pub is_beyond: bool,
}

impl Calibrator<'_> {
    /// Estimates the readout time, again and again with the last estimate in use, until both agree.
    ///
    /// # Errors
    /// The recording cannot be used, no frame is tracked, or a signal.
    pub fn fit_readout(&self) -> Result<Vec<ReadoutPass>> {
        let mut passes: Vec<ReadoutPass> = Vec::new();
        let mut given_ms = None;
        for number in 1..=MAX_PASSES {
            let readout = self.pass(&format!("readout, pass {number}"), |camera| {
                camera.readout_ms = given_ms;
            })?;
            let converged =
                readout.estimate_ms.zip(given_ms).is_some_and(|(now, used)| (now - used).abs() < CONVERGED_MS);
            passes.push(ReadoutPass { given_ms, readout });
            let Some(next_ms) = readout.estimate_ms.filter(|_| !converged) else { break };
            let next_ms = Some(next_ms.clamp(-self.frame_ms, self.frame_ms));
            // The same value would give the same estimate again.
            if next_ms == given_ms {
                break;
            }
            given_ms = next_ms;
        }
        Ok(passes)
    }

    /// Tries delays of the depth images with this readout time.
    ///
    /// # Errors
    /// As for [`Self::fit_readout`].
    pub fn fit_delay(&self, readout_ms: f64) -> Result<DelayFit> {
        let steps = (MAX_DELAY_MS / DELAY_STEP_MS) as i32;
        let mut trials = Vec::new();
        for step in -steps..=steps {
            let delay_ms = f64::from(step) * DELAY_STEP_MS;
            let readout = self.pass(&format!("delay of {delay_ms} ms"), |camera| {
                (camera.readout_ms, camera.depth_delay_ms) = (Some(readout_ms), Some(delay_ms));
            })?;
            trials.push((delay_ms, readout.depth_residual));
        }
        Ok(DelayFit::new(trials))
    }

    /// Returns what a whole run finds out about the readout time of a camera that `change` has changed.
    fn pass(&self, label: &str, change: impl FnOnce(&mut Camera)) -> Result<Readout> {
        let own_boxes = self.boxes.is_source().then_some(&*self.config.dynamic.movable);
        let mut source = Source::open(self.source, self.config.depth.source, own_boxes)?;
        change(&mut source.camera.camera);
        let mut config = self.config.clone();
        config.depth.source = source.depth_source;
        config.tracking.estimate_readout = ReadoutEstimation::Always;
        config.tracking.readout_max_sigma_ms = config.tracking.readout_max_sigma_ms.max(MAX_SIGMA_MS);
        let detector = match self.boxes {
            BoxOrigin::Detector(_) => Some(load_for(self.detector, &config)?),
            _ => None,
        };
        let mut run = MethodRun::prepare(config.clone(), &source, detector, false, &MapArgs::default())?;
        let mut progress = Progress::new(self.terminal, label, source.stamps_ns.len());
        let mut reading = Stages::default();
        while let Some(frame) = source.frames.next(&mut reading) {
            self.interrupt.check()?;
            run.process(&frame);
            progress.frame(run.pipeline.frames(), run.state);
        }
        progress.finish();
        let readout = run.pipeline.slam().statistics().readout;
        // Fails with the reason if nothing was tracked.
        run.pipeline.finish(&config)?;
        Ok(readout)
    }
}

/// Returns the readout time that the last of these runs has found.
///
/// # Errors
/// It is uncertain; the message says why and what to do.
pub fn fitted(passes: &[ReadoutPass], config: &Config) -> Result<FittedReadout> {
    const CURE: &str = "record more, move the camera more, and turn it";
    let Some(ReadoutPass { given_ms, readout }) = passes.last() else { bail!("uncertain: there was no run; {CURE}") };
    let Some((estimate_ms, sigma_ms)) = readout.estimate_ms.zip(readout.sigma_ms) else {
        bail!("uncertain: the motion of the camera shows no readout time; {CURE}");
    };
    ensure!(
        readout.is_certain,
        "uncertain: the estimate of {estimate_ms:.1} ± {sigma_ms:.1} ms is not certain enough; {CURE}"
    );
    let change_ms = given_ms.map_or(f64::INFINITY, |given_ms| (estimate_ms - given_ms).abs());
    ensure!(
        change_ms < CONVERGED_MS.max(sigma_ms),
        "uncertain: the last of {} estimates still differs from the one before by {change_ms:.1} ms; {CURE}",
        passes.len()
    );
    let is_global = estimate_ms.abs() < config.tracking.readout_min_ms.max(CLEAR_SIGMAS * sigma_ms);
    Ok(FittedReadout { readout_ms: if is_global { 0.0 } else { estimate_ms }, sigma_ms })
}

impl DelayFit {
    fn new(trials: Vec<(f64, Option<f64>)>) -> Self {
        let measured: Vec<(f64, f64)> = trials.iter().filter_map(|&(ms, residual)| Some((ms, residual?))).collect();
        let minimum = Parabola::fit(&measured).and_then(|parabola| parabola.minimum());
        let better =
            minimum.filter(|(delay_ms, sigma_ms, gain)| *gain >= MIN_GAIN && delay_ms.abs() >= CLEAR_SIGMAS * sigma_ms);
        let is_beyond = better.is_some_and(|(delay_ms, ..)| delay_ms.abs() > MAX_DELAY_MS);
        let delay_ms = better.map_or(0.0, |(delay_ms, ..)| if is_beyond { 0.0 } else { delay_ms });
        Self { trials, delay_ms, sigma_ms: minimum.map(|(_, sigma_ms, _)| sigma_ms), is_beyond }
    }
}

/// A parabola through points by least squares, with the covariance of its coefficients. Runs with different delays differ by chance, too; the
/// scatter around the parabola tells by how much.
struct Parabola {
    coefficients: Vector3<f64>,
    covariance: Matrix3<f64>,
}

impl Parabola {
    /// Returns `None` with too few points for their scatter.
    fn fit(points: &[(f64, f64)]) -> Option<Self> {
        let powers = |x: f64| Vector3::new(1.0, x, x * x);
        let normal: Matrix3<f64> = points.iter().map(|(x, _)| powers(*x) * powers(*x).transpose()).sum();
        let inverse = normal.try_inverse()?;
        let coefficients = inverse * points.iter().map(|(x, y)| powers(*x) * *y).sum::<Vector3<f64>>();
        let squared = points.iter().map(|(x, y)| (y - coefficients.dot(&powers(*x))).powi(2)).sum::<f64>();
        let freedom = points.len().checked_sub(3).filter(|freedom| *freedom > 0)?;
        Some(Self { coefficients, covariance: inverse * (squared / freedom as f64) })
    }

    /// Returns the minimum, its standard deviation, and by which share the parabola is lower there than at 0; `None` if it does not clearly
    /// have a minimum.
    fn minimum(&self) -> Option<(f64, f64, f64)> {
        let [at_0, slope, curvature] = self.coefficients.into();
        if curvature <= CLEAR_SIGMAS * self.covariance.m33.sqrt() {
            return None;
        }
        let x = -slope / (2.0 * curvature);
        let gradient = Vector3::new(0.0, -1.0, -2.0 * x) / (2.0 * curvature);
        let sigma = (gradient.transpose() * self.covariance * gradient).x.sqrt();
        Some((x, sigma, -(slope + curvature * x) * x / at_0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pass(given_ms: f64, estimate_ms: f64, sigma_ms: f64, is_certain: bool) -> ReadoutPass {
        let mut readout = Readout::default();
        (readout.estimate_ms, readout.sigma_ms, readout.is_certain) = (Some(estimate_ms), Some(sigma_ms), is_certain);
        ReadoutPass { given_ms: Some(given_ms), readout }
    }

    #[test]
    fn a_readout_is_that_of_the_last_pass_or_0_for_a_global_shutter() {
        let fit = |last: ReadoutPass| fitted(&[pass(0.0, 20.0, 1.0, true), last], &Config::default());
        assert_eq!(fit(pass(25.0, 24.8, 0.4, true)).unwrap(), FittedReadout { readout_ms: 24.8, sigma_ms: 0.4 });
        assert_eq!(fit(pass(-25.0, -24.8, 0.4, true)).unwrap().readout_ms, -24.8);
        for global in [pass(1.0, 1.1, 0.1, true), pass(4.0, 4.1, 1.4, true)] {
            assert_eq!(fit(global).unwrap().readout_ms, 0.0);
        }
    }

    #[test]
    fn a_readout_is_uncertain_with_the_reason() {
        let why = |passes: &[ReadoutPass]| fitted(passes, &Config::default()).unwrap_err().to_string();
        assert!(why(&[]).contains("uncertain"));
        assert!(why(&[ReadoutPass { given_ms: None, readout: Readout::default() }]).contains("shows no readout time"));
        assert!(why(&[pass(25.0, 25.1, 9.0, false)]).contains("25.1 ± 9.0 ms is not certain enough"));
        assert!(why(&[pass(20.0, 25.0, 0.5, true)]).contains("differs from the one before by 5.0 ms"));
    }

    #[test]
    fn a_delay_is_the_minimum_of_a_parabola_if_it_is_clearly_better_than_none() {
        let fit = |residual: fn(f64) -> Option<f64>| {
            DelayFit::new((-4..=4).map(|step| 5.0 * f64::from(step)).map(|ms| (ms, residual(ms))).collect())
        };
        // Runs with different delays differ by chance, too.
        let chance = |ms: f64| if (ms / 5.0) as i32 % 2 == 0 { 0.01 } else { -0.01 };
        let found = fit(|ms| Some(1.0 + 0.01 * (ms - 4.0) * (ms - 4.0)));
        assert!((found.delay_ms - 4.0).abs() < 1e-6 && !found.is_beyond, "{found:?}");
        let noisy = DelayFit::new(found.trials.iter().map(|(ms, r)| (*ms, r.map(|r| r + chance(*ms)))).collect());
        assert!((noisy.delay_ms - 4.0).abs() < 0.5 && noisy.sigma_ms.is_some_and(|s| s > 0.0), "{noisy:?}");
        assert_eq!(fit(|ms| Some(1.0 + 1e-4 * (ms - 4.0) * (ms - 4.0))).delay_ms, 0.0);
        assert_eq!(DelayFit::new(found.trials.iter().map(|(ms, _)| (*ms, Some(chance(*ms)))).collect()).delay_ms, 0.0);
        let beyond = fit(|ms| Some(1.0 + 0.01 * (ms - 30.0) * (ms - 30.0)));
        assert_eq!((beyond.delay_ms, beyond.is_beyond), (0.0, true));
        assert_eq!(fit(|_| None).delay_ms, 0.0);
        assert_eq!(fit(|ms| (ms > 5.0).then_some(ms)).delay_ms, 0.0);
    }
}

//! Statistics of the depth values of a recording, and a check of the depth factor.
//!
//! A wrong factor is a common mistake that no later stage detects: the trajectory is complete but has the wrong scale, and every
//! threshold in metres is wrong.

use std::ops::RangeInclusive;

use yfslam::DepthImage;

use crate::camera::CameraSource;
use yfslam::config::DepthSource;

use crate::error::{Error, Result};
use crate::sequence::Sequence;
use crate::stream::{DEFAULT_LOOK_AHEAD, FrameStream};

/// Plausible median depths of a recording of rooms, desks or corridors, m.
pub const PLAUSIBLE_MEDIAN_M: RangeInclusive<f64> = 0.1..=20.0;

/// Common depth units per metre: millimetres, TUM and Bonn, metres, Replica, 0.1 mm, centimetres.
const COMMON_FACTORS: [f64; 6] = [1000.0, 5000.0, 1.0, 6553.5, 10_000.0, 100.0];

/// A usual median depth of recordings of rooms and desks, m.
const USUAL_MEDIAN_M: f64 = 1.8;

/// A factor is suggested if it gives a median depth in this range, m.
const LIKELY_MEDIAN_M: RangeInclusive<f64> = 0.4..=8.0;

/// Usable frames that [`check_recording`] needs.
const PROBE_FRAMES: usize = 5;

/// Frames that [`check_recording`] tries to decode for this.
const PROBE_ATTEMPTS: usize = 30;

/// Depth of several images, m: exact order statistics (nearest rank) over all measured pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthStatistics {
    /// Share of pixels with a measurement, 0 to 1.
    pub valid_share: f64,
    /// 5th percentile, m.
    pub p5_m: f64,
    /// Median, m.
    pub median_m: f64,
    /// 95th percentile, m.
    pub p95_m: f64,
}

impl DepthStatistics {
    /// Computes the statistics of `images`; `None` if no pixel has a measurement.
    pub fn of<'a>(images: impl IntoIterator<Item = &'a DepthImage>) -> Option<Self> {
        let mut histogram = vec![0u64; 1 << 16];
        let mut unit = None;
        for image in images {
            // Images of floating-point numbers have units of their own, but all of a recording have the same.
            let unit = *unit.get_or_insert(image.metres_per_unit);
            for &raw in image.raw.data().iter().filter(|_| image.metres_per_unit == unit) {
                if let Some(count) = histogram.get_mut(usize::from(raw)) {
                    *count += 1;
                }
            }
        }
        let units_per_metre = units_per_metre(unit?);
        let pixels: u64 = histogram.iter().sum();
        let unmeasured = histogram.first().copied().unwrap_or(0);
        let measured = pixels - unmeasured;
        let quantile_m = |quantile: f64| {
            let rank = unmeasured + ((quantile * measured as f64).ceil() as u64).max(1);
            let mut seen = 0;
            let raw = histogram.iter().position(|count| {
                seen += count;
                seen >= rank
            });
            raw.map(|raw| raw as f64 / units_per_metre)
        };
        let valid_share = measured as f64 / pixels as f64;
        Some(Self { valid_share, p5_m: quantile_m(0.05)?, median_m: quantile_m(0.5)?, p95_m: quantile_m(0.95)? })
    }

    /// Returns a warning if the median depth is unusual and would be usual with another common depth factor than `depth_factor`.
    pub fn warning(&self, depth_factor: f64) -> Option<String> {
        let unusual = |median_m: f64| (median_m / USUAL_MEDIAN_M).ln().abs();
        if LIKELY_MEDIAN_M.contains(&self.median_m) {
            return None;
        }
        let median_of = |factor: f64| self.median_m * depth_factor / factor;
        let is_better = |factor: &f64| {
            let median_m = median_of(*factor);
            LIKELY_MEDIAN_M.contains(&median_m) && unusual(median_m) + 2f64.ln() < unusual(self.median_m)
        };
        let factor = COMMON_FACTORS.into_iter().find(is_better)?;
        Some(format!(
            "with the depth factor {depth_factor} the median depth is {} m, which is unusual; with --depth-factor {factor} it would be {} m. \
             A wrong factor makes every length wrong",
            significant(self.median_m),
            significant(median_of(factor))
        ))
    }
}

/// Computes the statistics of the first depth images of a recording and refuses an implausible `depth_factor`.
///
/// # Errors
/// No image has a measurement, or the median is outside [`PLAUSIBLE_MEDIAN_M`]; the message suggests factors that would fit.
pub fn check_depth_factor<'a>(
    images: impl IntoIterator<Item = &'a DepthImage>,
    depth_factor: f64,
) -> Result<DepthStatistics> {
    let Some(statistics) = DepthStatistics::of(images) else {
        return Err(Error::argument("the first depth images contain no measurement", "check the depth sensor"));
    };
    if PLAUSIBLE_MEDIAN_M.contains(&statistics.median_m) {
        return Ok(statistics);
    }
    let median_m = statistics.median_m;
    let problem = format!("with the depth factor {depth_factor} the median depth is {} m", significant(median_m));
    let median_raw = median_m * depth_factor;
    let fits = COMMON_FACTORS.iter().map(|factor| (factor, median_raw / factor));
    let suggestions: Vec<_> = fits
        .filter(|(_, median_m)| LIKELY_MEDIAN_M.contains(median_m))
        .map(|(factor, median_m)| format!("with --depth-factor {factor} it would be {} m", significant(median_m)))
        .collect();
    let cure = match suggestions.as_slice() {
        [] => format!("the raw median is {median_raw:.0}; give the depth units per metre of this recording"),
        _ => suggestions.join(", "),
    };
    Err(Error::argument(problem, cure))
}

/// Decodes the first usable frames of `sequence` and checks the image size and, with depth images, the depth factor of `camera`.
/// Returns `None` without depth images.
///
/// # Errors
/// None of the first frames can be used, or the depth factor is implausible.
pub fn check_recording(sequence: &Sequence, camera: &CameraSource) -> Result<Option<DepthStatistics>> {
    let first = sequence.entries.iter().take(PROBE_ATTEMPTS).cloned().collect();
    let first = Sequence { entries: first, ..sequence.clone() };
    let (mut depths, mut usable, mut first_error) = (Vec::new(), 0, None);
    for frame in FrameStream::open(&first, camera, DEFAULT_LOOK_AHEAD)? {
        match frame {
            Ok(frame) => {
                usable += 1;
                depths.extend(frame.depth);
            }
            Err(error) => first_error = first_error.or(Some(error)),
        }
        if usable == PROBE_FRAMES {
            break;
        }
    }
    match first_error {
        Some(error) if usable == 0 => {
            let problem = format!("none of the first {} frames can be used", first.entries.len());
            Err(Error::content(&sequence.folder, problem, error.to_string()))
        }
        _ if sequence.depth_source != DepthSource::Image => Ok(None),
        _ => check_depth_factor(depths.iter().map(AsRef::as_ref), camera.depth_factor).map(Some),
    }
}

/// Returns the units per metre of a unit that was rounded to 32 bits, whose seventh digit is therefore uncertain.
fn units_per_metre(metres_per_unit: f32) -> f64 {
    let units = 1.0 / f64::from(metres_per_unit);
    let scale = 10f64.powf(5.0 - units.log10().floor());
    (units * scale).round() / scale
}

/// Formats a value with two significant digits: 0.0014, 1.4, 71000.
fn significant(value: f64) -> String {
    let digits = if value > 0.0 { (1.0 - value.log10().floor()).clamp(0.0, 12.0) as usize } else { 1 };
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(values: &[u16], factor: f64) -> DepthImage {
        DepthImage::from_u16(values, values.len(), 1, values.len(), (1.0 / factor) as f32).unwrap()
    }

    #[test]
    fn quantiles_are_exact_over_measured_pixels_only() {
        let mut values: Vec<u16> = (1..=100).map(|i| i * 10).collect();
        values.extend([0; 100]);
        let (front, back) = values.split_at(70);
        let statistics = DepthStatistics::of([&image(front, 1000.0), &image(back, 1000.0)]).unwrap();
        assert_eq!(
            (statistics.valid_share, statistics.p5_m, statistics.median_m, statistics.p95_m),
            (0.5, 0.05, 0.5, 0.95)
        );
        assert_eq!(DepthStatistics::of([&image(&[0, 0], 1000.0)]), None);
        assert_eq!(DepthStatistics::of([]), None);
        assert_eq!(DepthStatistics::of([&image(&[65535], 1.0)]).unwrap().p5_m, 65535.0);
    }

    #[test]
    fn an_implausible_factor_is_refused_and_plausible_ones_are_suggested() {
        let refusal =
            |raw: u16, factor: f64| check_depth_factor([&image(&[raw], factor)], factor).unwrap_err().to_string();
        let error = refusal(1400, 50_000.0);
        assert_eq!(
            error,
            "with the depth factor 50000 the median depth is 0.028 m; with --depth-factor 1000 it would be 1.4 m"
        );
        assert!(refusal(7000, 1.0).contains("with --depth-factor 5000 it would be 1.4 m"));
        assert!(refusal(20, 1000.0).contains("the raw median is 20; give the depth units"));
        assert!(check_depth_factor([&image(&[0], 1000.0)], 1000.0).unwrap_err().to_string().contains("no measurement"));
        assert_eq!(check_depth_factor([&image(&[1400], 1000.0)], 1000.0).unwrap().median_m, 1.4);
    }

    #[test]
    fn a_factor_that_gives_an_unusual_median_is_a_warning_with_both_figures() {
        let warning = |raw: u16, factor: f64| DepthStatistics::of([&image(&[raw], factor)]).unwrap().warning(factor);
        // TUM depth taken for millimetres, and the other way round.
        let text = warning(16_700, 1000.0).unwrap();
        assert!(text.contains("is 17 m") && text.contains("--depth-factor 5000 it would be 3.3 m"), "{text}");
        let text = warning(1400, 5000.0).unwrap();
        assert!(text.contains("is 0.28 m") && text.contains("--depth-factor 1000 it would be 1.4 m"), "{text}");
        // Usual values, close work, and a hall.
        for (raw, factor) in [(1400, 1000.0), (16_700, 5000.0), (500, 1000.0), (7000, 1000.0), (9000, 6553.5)] {
            assert_eq!(warning(raw, factor), None, "{raw} {factor}");
        }
    }

    #[test]
    fn the_units_per_metre_are_those_that_were_given() {
        for units in [1.0, 100.0, 1000.0, 5000.0, 5208.0, 6553.5, 10_000.0, 0.001, 3999.75] {
            assert!((units_per_metre((1.0 / units) as f32) / units - 1.0).abs() < 1e-15, "{units}");
        }
    }

    #[test]
    fn figures_have_two_significant_digits() {
        assert_eq!(
            [0.00142, 0.1, 1.44, 14.2, 71_000.0, 0.0].map(significant),
            ["0.0014", "0.10", "1.4", "14", "71000", "0.0"]
        );
    }
}

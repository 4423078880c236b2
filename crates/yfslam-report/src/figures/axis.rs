//! In: a range of values. Out: an axis, with the positions of values and the labels.

/// How values are mapped to positions along an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// Linear.
    Linear,
    /// Logarithmic, for positive values.
    Log,
    /// Linear up to a threshold on both sides of zero, logarithmic beyond.
    SymLog(f64),
}

/// An axis of a figure.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Quantity and unit.
    pub name: String,
    /// Scale of the axis.
    pub scale: Scale,
    /// First and last position.
    pub range: [f64; 2],
    /// Positions with their labels, in order.
    pub ticks: Vec<(f64, String)>,
}

impl Scale {
    /// Returns the position of a value.
    pub fn position(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Log => value.max(f64::MIN_POSITIVE).log10(),
            Self::SymLog(threshold) => {
                let size = value.abs() / threshold;
                value.signum() * if size <= 1.0 { size } else { 1.0 + size.log10() }
            }
        }
    }
}

impl Axis {
    /// Returns a linear axis from `from` to `to` with about `count` labels; labels show values times `factor`, to change the unit.
    pub fn linear(name: impl Into<String>, [from, to]: [f64; 2], count: usize, factor: f64) -> Self {
        let step = nice_step((to - from) * factor / count.max(1) as f64);
        let decimals = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
        let first = (from * factor / step).ceil();
        let last = (to * factor / step).floor();
        let label = |k: f64| {
            let text = format!("{:.decimals$}", k * step);
            // A range that starts a little below zero would give "-0".
            (k * step / factor, if k == 0.0 { text.replace('-', "") } else { text.replace('-', "−") })
        };
        let ticks = (0..=(last - first).clamp(0.0, 100.0) as usize).map(|i| label(first + i as f64)).collect();
        Self { name: name.into(), scale: Scale::Linear, range: [from, to], ticks }
    }

    /// Returns a logarithmic axis of lengths in metres; labels are powers of ten, and 2 and 5 times these where there would be few.
    pub fn log_lengths(name: impl Into<String>, [from, to]: [f64; 2]) -> Self {
        let low = from.max(1e-9).log10();
        let high = to.max(1e-9).log10().max(low + 1.0);
        let ticks_of = |factors: &[f64]| -> Vec<(f64, String)> {
            let decades = low.floor() as i32..=high.ceil() as i32;
            let values = decades.flat_map(|exponent| factors.iter().map(move |f| f * 10f64.powi(exponent)));
            let ticks = values.map(|value| (value.log10(), trimmed(&length(value))));
            ticks.filter(|(at, _)| (low..=high).contains(at)).collect()
        };
        let decades = ticks_of(&[1.0]);
        let ticks = if decades.len() < 3 { ticks_of(&[1.0, 2.0, 5.0]) } else { decades };
        Self { name: name.into(), scale: Scale::Log, range: [low, high], ticks }
    }

    /// Returns an axis of angles in degrees on both sides of zero, logarithmic beyond `threshold`, which is a power of ten. Labels are powers of ten,
    /// and 2 and 5 times these where there would be few.
    pub fn symlog_degrees(name: impl Into<String>, limit: f64, threshold: f64) -> Self {
        let scale = Scale::SymLog(threshold);
        let decades = (limit / threshold).log10().ceil().max(1.0) as i32;
        let values_of = |factors: &[f64]| -> Vec<f64> {
            let powers = (0..=decades).map(|k| threshold * 10f64.powi(k));
            let values = powers.flat_map(|power| factors.iter().map(move |factor| factor * power));
            // A power of ten that was computed may be a little less than its digits.
            values.map(|v| (v * 1e9).round() / 1e9).filter(|v| *v <= limit).collect()
        };
        let powers = values_of(&[1.0]);
        let values = if powers.len() < 3 { values_of(&[1.0, 2.0, 5.0]) } else { powers };
        let signed = values.iter().rev().map(|v| -v).chain([0.0]).chain(values.iter().copied());
        let ticks = signed.map(|v| (scale.position(v), format!("{v}").replace('-', "−"))).collect();
        let end = scale.position(limit) + 0.1;
        Self { name: name.into(), scale, range: [-end, end], ticks }
    }

    /// Returns an axis of named groups at a distance of one unit.
    pub fn groups(names: &[&str]) -> Self {
        let ticks = names.iter().enumerate().map(|(i, name)| (i as f64, (*name).to_owned())).collect();
        Self { name: String::new(), scale: Scale::Linear, range: [-0.55, names.len() as f64 - 0.45], ticks }
    }
}

/// Returns the unit for lengths up to `max_m`, and its number in a metre.
pub fn length_unit(max_m: f64) -> (&'static str, f64) {
    match max_m {
        m if m < 0.05 => ("mm", 1e3),
        m if m < 1.0 => ("cm", 1e2),
        _ => ("m", 1.0),
    }
}

/// Formats a length with three digits in a suitable unit.
pub fn length(m: f64) -> String {
    match m {
        m if m < 0.000_999_5 => format!("{} µm", short(m * 1e6)),
        m if m < 0.009_995 => format!("{} mm", short(m * 1e3)),
        m if m < 0.999_5 => format!("{} cm", short(m * 1e2)),
        m => format!("{} m", short(m)),
    }
}

/// Formats a number with three significant digits.
fn short(value: f64) -> String {
    let decimals = match value {
        v if v >= 99.95 => 0,
        v if v >= 9.995 => 1,
        _ => 2,
    };
    format!("{value:.decimals$}")
}

/// Removes trailing zeros of the decimals.
fn trimmed(length: &str) -> String {
    let Some((number, unit)) = length.split_once(' ') else { return length.to_owned() };
    let number = if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number };
    format!("{number} {unit}")
}

/// Returns 1, 2 or 5 times a power of ten near `rough`.
fn nice_step(rough: f64) -> f64 {
    let rough = if rough.is_finite() && rough > 0.0 { rough } else { 1.0 };
    let power = 10f64.powf(rough.log10().floor());
    let factor = [1.0, 2.0, 5.0].into_iter().find(|f| f * power >= rough * 0.7).unwrap_or(10.0);
    factor * power
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis) -> Vec<&str> {
        axis.ticks.iter().map(|(_, label)| label.as_str()).collect()
    }

    #[test]
    fn linear_axes_have_round_labels_inside_the_range() {
        assert_eq!(labels(&Axis::linear("", [-0.3, 1.1], 4, 1.0)), ["0.0", "0.5", "1.0"]);
        assert_eq!(labels(&Axis::linear("", [0.0, 0.0213], 4, 1e3)), ["0", "5", "10", "15", "20"]);
        assert_eq!(labels(&Axis::linear("", [-20.0, 20.0], 4, 1.0)), ["−20", "−10", "0", "10", "20"]);
        assert!(Axis::linear("", [0.0, 0.0], 4, 1.0).ticks.len() < 20);
    }

    #[test]
    fn logarithmic_axes_label_each_length_in_a_suitable_unit() {
        assert_eq!(labels(&Axis::log_lengths("", [0.0009, 1.3])), ["1 mm", "1 cm", "10 cm", "1 m"]);
        assert_eq!(labels(&Axis::log_lengths("", [0.003, 0.06])), ["5 mm", "1 cm", "2 cm", "5 cm"]);
        assert_eq!(length(0.0156), "1.56 cm");
        assert_eq!(length(0.041), "4.10 cm");
        assert_eq!(length(0.999_6), "1.00 m");
        assert_eq!(length(12.0), "12.0 m");
        assert_eq!(length(0.000_12), "120 µm");
    }

    #[test]
    fn angles_keep_their_sign_on_a_logarithmic_axis() {
        let axis = Axis::symlog_degrees("", 170.0, 1.0);
        assert_eq!(labels(&axis), ["−100", "−10", "−1", "0", "1", "10", "100"]);
        let few = Axis::symlog_degrees("", 6.0, 0.1);
        assert_eq!(labels(&few).split_off(6), ["0", "0.1", "0.2", "0.5", "1", "2", "5"]);
        assert_eq!(axis.scale.position(-10.0), -2.0);
        assert_eq!(axis.scale.position(0.5), 0.5);
    }
}

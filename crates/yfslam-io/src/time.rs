//! Time stamps: converts between decimal seconds as text and integer nanoseconds, without floating point.

/// Why a text is not a time stamp.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StampError {
    /// The text is not a decimal number.
    #[error("is not a number of seconds")]
    NotANumber,
    /// The number exceeds 64-bit nanoseconds, ±292 years.
    #[error("is beyond 292 years; stamps are expected in seconds, not in milli-, micro- or nanoseconds")]
    OutOfRange,
}

/// Bound of a mantissa: it has all digits of a printed double, and 10 times its value fits `u128`.
const MANTISSA_LIMIT: u128 = 10u128.pow(36);

/// Parses decimal seconds (`1305031102.175304`, also `1.305031102175304e+09`) into nanoseconds, exactly.
///
/// Digits beyond the ninth decimal are rounded, half away from zero.
///
/// # Errors
/// [`StampError`] when the text is not a finite decimal number or too large.
pub fn parse_stamp_ns(text: &str) -> Result<i64, StampError> {
    parse_stamp_in(text, 9)
}

/// Parses a time in a unit of 10^`power` ns, such as 6 for milliseconds, into nanoseconds, exactly, as [`parse_stamp_ns`].
///
/// # Errors
/// As for [`parse_stamp_ns`].
pub(crate) fn parse_stamp_in(text: &str, power: i64) -> Result<i64, StampError> {
    let (negative, unsigned) = match text.as_bytes() {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        rest => (false, rest),
    };
    let exponent_at = unsigned.iter().position(|c| matches!(c, b'e' | b'E'));
    let (digits, exponent) = match exponent_at {
        Some(at) => (&unsigned[..at], parse_exponent(&unsigned[at + 1..])?),
        None => (unsigned, 0),
    };
    let (mantissa, scale) = parse_digits(digits)?;
    let magnitude = scale_by_power_of_ten(mantissa, scale + exponent + power).ok_or(StampError::OutOfRange)?;
    let magnitude = i64::try_from(magnitude).map_err(|_| StampError::OutOfRange)?;
    Ok(if negative { -magnitude } else { magnitude })
}

/// Parses digits with an optional point into mantissa · 10^scale.
fn parse_digits(digits: &[u8]) -> Result<(u128, i64), StampError> {
    let (mut mantissa, mut scale) = (0u128, 0i64);
    let (mut seen_point, mut seen_digit) = (false, false);
    for &c in digits {
        match c {
            b'.' if !seen_point => seen_point = true,
            b'0'..=b'9' => {
                seen_digit = true;
                let kept = mantissa < MANTISSA_LIMIT;
                if kept {
                    mantissa = mantissa * 10 + u128::from(c - b'0');
                }
                scale += i64::from(!kept) - i64::from(seen_point);
            }
            _ => return Err(StampError::NotANumber),
        }
    }
    if seen_digit { Ok((mantissa, scale)) } else { Err(StampError::NotANumber) }
}

/// Parses the exponent of a number such as `1e+09`, limited to ±10⁶, which is far beyond any stamp.
fn parse_exponent(text: &[u8]) -> Result<i64, StampError> {
    let (sign, digits) = match text {
        [b'-', rest @ ..] => (-1, rest),
        [b'+', rest @ ..] => (1, rest),
        rest => (1, rest),
    };
    if digits.is_empty() || !digits.iter().all(u8::is_ascii_digit) {
        return Err(StampError::NotANumber);
    }
    Ok(sign * digits.iter().fold(0i64, |value, &c| (value * 10 + i64::from(c - b'0')).min(1_000_000)))
}

fn scale_by_power_of_ten(value: u128, power: i64) -> Option<u128> {
    if value == 0 {
        return Some(0);
    }
    let factor = u32::try_from(power.unsigned_abs()).ok().and_then(|p| 10u128.checked_pow(p));
    match (factor, power >= 0) {
        (Some(factor), true) => value.checked_mul(factor),
        (Some(factor), false) => Some(value / factor + u128::from(value % factor >= factor.div_ceil(2))),
        (None, true) => None,
        (None, false) => Some(0),
    }
}

/// Formats nanoseconds as decimal seconds with nine decimals, exactly; the inverse of [`parse_stamp_ns`].
pub fn format_stamp(stamp_ns: i64) -> String {
    let sign = if stamp_ns < 0 { "-" } else { "" };
    let magnitude = stamp_ns.unsigned_abs();
    format!("{sign}{}.{:09}", magnitude / 1_000_000_000, magnitude % 1_000_000_000)
}

/// Converts nanoseconds to seconds, for display and statistics.
pub fn seconds(duration_ns: i64) -> f64 {
    duration_ns as f64 * 1e-9
}

/// Maps time so that a part played backward runs forward: t' = first + last − t.
///
/// The ground truth is mirrored in the same way before a reversed run is evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeMirror {
    /// Stamp of the first colour image of the part, ns.
    pub first_ns: i64,
    /// Stamp of the last colour image of the part, ns.
    pub last_ns: i64,
}

impl TimeMirror {
    /// Returns the mirrored stamp, ns; saturates at the ends of the range.
    pub fn apply(self, stamp_ns: i64) -> i64 {
        let mirrored = i128::from(self.first_ns) + i128::from(self.last_ns) - i128::from(stamp_ns);
        mirrored.clamp(i64::MIN.into(), i64::MAX.into()) as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn stamps_are_exact_where_a_double_would_round() {
        assert_eq!(parse_stamp_ns("1305031102.175304"), Ok(1_305_031_102_175_304_000));
        assert_eq!(parse_stamp_ns("1548339819.87426"), Ok(1_548_339_819_874_260_000));
        assert_eq!(parse_stamp_ns("1305031102.000000001"), Ok(1_305_031_102_000_000_001));
        assert_eq!(parse_stamp_ns("1.305031102000000001e+09"), Ok(1_305_031_102_000_000_001));
        assert_eq!(parse_stamp_ns("-0.5"), Ok(-500_000_000));
        assert_eq!(parse_stamp_ns("7"), Ok(7_000_000_000));
        assert_eq!(parse_stamp_ns(".25"), Ok(250_000_000));
        assert_eq!(parse_stamp_ns("5e-10"), Ok(1));
        assert_eq!(parse_stamp_ns("4e-10"), Ok(0));
        assert_eq!(parse_stamp_ns("0e999999999999"), Ok(0));
    }

    #[test]
    fn malformed_stamps_are_refused() {
        for text in ["", ".", "-", "nan", "inf", "1.2.3", "1,5", "0x10", "1e", "1e+", "e5", "12a", "１"] {
            assert_eq!(parse_stamp_ns(text), Err(StampError::NotANumber), "{text:?}");
        }
        for text in ["1305031102175304000", "1e300", "1e999999999999999999999"] {
            assert_eq!(parse_stamp_ns(text), Err(StampError::OutOfRange), "{text:?}");
        }
    }

    #[test]
    fn a_mirror_swaps_the_ends_and_undoes_itself() {
        let mirror = TimeMirror { first_ns: 100, last_ns: 140 };
        assert_eq!([100, 110, 140, 90].map(|t| mirror.apply(t)), [140, 130, 100, 150]);
        assert_eq!(mirror.apply(mirror.apply(117)), 117);
        assert_eq!(mirror.apply(i64::MIN), i64::MAX);
    }

    proptest! {
        #[test]
        fn formatting_and_parsing_are_inverse(stamp in -i64::MAX..i64::MAX) {
            prop_assert_eq!(parse_stamp_ns(&format_stamp(stamp)), Ok(stamp));
        }

        #[test]
        fn parsing_never_panics(text in "[-+.eE0-9]{0,80}|.{0,40}") {
            let _ = parse_stamp_ns(&text);
        }
    }
}

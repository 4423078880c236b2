//! In: an element of a figure. Out: its colour on a light and on a dark page.
//!
//! Figures are drawn in the light colours, and rules of the style sheet replace them on a dark page. A figure that is copied out of the page
//! keeps its colours.

use std::fmt::Write;

/// Red, green, blue.
pub type Rgb = [u8; 3];

/// What a line or an area of a figure shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ink {
    /// Text on axes.
    Text,
    /// The axes.
    Axis,
    /// Lines behind the data.
    Grid,
    /// The true trajectory.
    Truth,
    /// A method, by its index in [`METHODS`].
    Method(usize),
    /// An error, by its step on a scale from 0 to the largest, the index in [`ERRORS`].
    Error(usize),
}

/// Light and dark colours of errors, from small to large: from blue over yellow to red, with the lightness going one way.
const ERRORS: [[Rgb; 2]; 6] = [
    [[190, 208, 226], [45, 65, 92]],
    [[128, 186, 204], [47, 110, 138]],
    [[120, 178, 96], [96, 166, 84]],
    [[222, 170, 20], [222, 184, 52]],
    [[220, 96, 22], [244, 132, 60]],
    [[150, 12, 40], [255, 92, 110]],
];
/// Number of steps of the scale of errors.
pub const ERROR_STEPS: usize = ERRORS.len();

/// Light and dark colours of methods, distinguishable with every kind of colour vision (the first three by luminance, too).
const METHODS: [[Rgb; 2]; 7] = [
    [[201, 79, 17], [255, 146, 76]],
    [[118, 75, 205], [183, 155, 255]],
    [[0, 133, 124], [45, 212, 191]],
    [[29, 98, 196], [110, 168, 254]],
    [[186, 40, 110], [244, 128, 180]],
    [[110, 110, 20], [205, 205, 90]],
    [[52, 130, 48], [120, 210, 104]],
];

impl Ink {
    /// Returns the colour of a method: fixed for the known methods, else by its index in the report.
    pub fn method(name: &str, index: usize) -> Self {
        Self::Method(match name {
            "none" => 0,
            "boxes" => 1,
            "yf" => 2,
            "full" => 3,
            "ds" => 4,
            "dyna" => 5,
            "dms" => 6,
            _ => 3 + index % (METHODS.len() - 3),
        })
    }

    /// Returns the colour on a light page.
    pub fn light(self) -> Rgb {
        self.colors()[0]
    }

    /// Returns the name of the variable of the style sheet with this colour.
    pub fn variable(self) -> String {
        match self {
            Self::Text => "--ink-text".into(),
            Self::Axis => "--ink-axis".into(),
            Self::Grid => "--ink-grid".into(),
            Self::Truth => "--ink-truth".into(),
            Self::Method(index) => format!("--ink-method-{index}"),
            Self::Error(step) => format!("--ink-error-{step}"),
        }
    }

    fn colors(self) -> [Rgb; 2] {
        match self {
            Self::Text => [[75, 85, 99], [176, 184, 196]],
            Self::Axis => [[156, 163, 175], [90, 99, 112]],
            Self::Grid => [[229, 231, 235], [44, 51, 61]],
            Self::Truth => [[31, 41, 55], [229, 233, 240]],
            Self::Method(index) => METHODS.get(index).copied().unwrap_or(METHODS[0]),
            Self::Error(step) => ERRORS[step.min(ERROR_STEPS - 1)],
        }
    }

    fn all() -> impl Iterator<Item = Self> {
        let fixed = [Self::Text, Self::Axis, Self::Grid, Self::Truth].into_iter();
        fixed.chain((0..METHODS.len()).map(Self::Method)).chain((0..ERROR_STEPS).map(Self::Error))
    }
}

/// Returns the part of the style sheet that defines the colours, and applies them to figures.
pub fn style() -> String {
    let (mut light, mut dark, mut figures) = (String::new(), String::new(), String::new());
    for ink in Ink::all() {
        let (variable, [on_light, on_dark]) = (ink.variable(), ink.colors().map(hex));
        // Writing to a string does not fail.
        let _ = write!(light, "{variable}:{on_light};");
        let _ = write!(dark, "{variable}:{on_dark};");
        let _ = writeln!(figures, "svg [stroke=\"{on_light}\"]{{stroke:var({variable})}}");
        let _ = writeln!(figures, "svg [fill=\"{on_light}\"]{{fill:var({variable})}}");
    }
    format!(":root{{{light}}}\n@media screen and (prefers-color-scheme: dark){{:root{{{dark}}}}}\n{figures}")
}

/// Formats a colour as the drawing backend does, because the rules of the style sheet have to match it.
fn hex([r, g, b]: Rgb) -> String {
    format!("#{r:02X}{g:02X}{b:02X}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_inks_share_a_colour_on_either_page() {
        for page in 0..2 {
            let mut colors: Vec<Rgb> = Ink::all().map(|ink| ink.colors()[page]).collect();
            colors.sort_unstable();
            let count = colors.len();
            colors.dedup();
            assert_eq!(colors.len(), count);
        }
    }

    #[test]
    fn a_method_has_the_same_colour_in_every_comparison() {
        assert_eq!(Ink::method("yf", 0), Ink::method("yf", 2));
        assert_ne!(Ink::method("other", 0), Ink::method("yf", 2));
        assert!(METHODS.len() > 3);
    }
}

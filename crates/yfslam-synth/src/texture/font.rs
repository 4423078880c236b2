//! A capital font of 3 × 5 cells, whose sharp corners suit corner detectors.
//!
//! In: a character. Out: five rows of three bits. Unknown characters are blank.

const LETTERS: [u16; 26] = [
    0o25755, 0o65656, 0o34443, 0o65556, 0o74647, 0o74644, 0o34553, 0o55755, 0o72227, 0o11152, 0o55655, 0o44447,
    0o57755, 0o65555, 0o25552, 0o65644, 0o25563, 0o65655, 0o34216, 0o72222, 0o55557, 0o55552, 0o55775, 0o55255,
    0o55222, 0o71247,
];
const DIGITS: [u16; 10] = [0o75557, 0o26227, 0o71747, 0o71717, 0o55711, 0o74717, 0o74757, 0o71111, 0o75757, 0o75717];

/// Words printed on posters, books and boxes.
pub const WORDS: [&str; 24] = [
    "POSE", "DEPTH", "LOOP", "MAP", "FRAME", "VISION", "ROBOT", "SLAM", "CAMERA", "TRACK", "OPTICS", "GRAPH",
    "STATICS", "MOTION", "LINEAR", "SIGNAL", "FOURIER", "GAUSS", "EULER", "RUST", "KALMAN", "PRISM", "ATLAS", "FIELD",
];

/// Returns whether the cell in column `x` (0 to 2) and row `y` (0 to 4) of `letter` is inked.
pub fn inked(letter: char, x: u32, y: u32) -> bool {
    let bits = match letter {
        'A'..='Z' => LETTERS[letter as usize - 'A' as usize],
        '0'..='9' => DIGITS[letter as usize - '0' as usize],
        '-' => 0o00700,
        _ => 0,
    };
    x < 3 && y < 5 && (bits >> (3 * (4 - y) + (2 - x))) & 1 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_letter_l_has_a_stem_and_a_foot() {
        let rows: Vec<String> =
            (0..5).map(|y| (0..3).map(|x| if inked('L', x, y) { '#' } else { '.' }).collect()).collect();
        assert_eq!(rows, ["#..", "#..", "#..", "#..", "###"]);
    }
}

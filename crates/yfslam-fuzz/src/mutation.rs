//! Seeded mutations of the files of a corpus, for tests without a fuzzing engine.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng;

/// Texts that numbers in text files are replaced by.
const NUMBERS: [&str; 20] = [
    "0",
    "-1",
    "1e308",
    "-1e308",
    "1e-320",
    "nan",
    "inf",
    "-inf",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "4294967295",
    "65536",
    "1e9",
    "0.5",
    "-0",
    "",
    "1.2.3",
    "0x10",
    "99999999999999999999999999999999",
];

/// Numbers that bytes are replaced by, in the sizes that binary formats have.
const INTEGERS: [u64; 14] =
    [0, 1, 2, 127, 128, 255, 256, 32_767, 65_535, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, i64::MAX as u64, u64::MAX];

/// Draws mutations of some files, the same ones for the same seed.
#[derive(Clone, Debug)]
pub struct Mutator {
    random: Pcg64Mcg,
    max_length: usize,
}

impl Mutator {
    /// Makes a mutator; its results have at most `max_length` bytes.
    pub fn new(seed: u64, max_length: usize) -> Self {
        Self { random: Pcg64Mcg::new(u128::from(seed) << 1 | 1), max_length }
    }

    /// Returns a mutation of one of the files: one to six changes in a row.
    pub fn mutate(&mut self, files: &[Vec<u8>]) -> Vec<u8> {
        let Some(file) = files.get(self.below(files.len())) else { return Vec::new() };
        let mut bytes = file.clone();
        for _ in 0..=self.below(6) {
            self.change(&mut bytes, files);
        }
        bytes.truncate(self.max_length);
        bytes
    }

    fn below(&mut self, end: usize) -> usize {
        if end == 0 { 0 } else { (self.random.next_u64() % end as u64) as usize }
    }

    /// Returns a range of at most `longest` bytes.
    fn range(&mut self, length: usize, longest: usize) -> std::ops::Range<usize> {
        let start = self.below(length + 1);
        let most = longest.min(length - start);
        let length = self.below(most + 1);
        start..start + length
    }

    fn change(&mut self, bytes: &mut Vec<u8>, files: &[Vec<u8>]) {
        match self.below(10) {
            0 | 1 => {
                let at = self.below(bytes.len());
                let bit = 1 << self.below(8);
                bytes.get_mut(at).into_iter().for_each(|byte| *byte ^= bit);
            }
            2 => {
                let (at, value) = (self.below(bytes.len()), self.random.next_u64() as u8);
                bytes.get_mut(at).into_iter().for_each(|byte| *byte = value);
            }
            3 => bytes.truncate(self.below(bytes.len())),
            4 => {
                let range = self.range(bytes.len(), 64);
                bytes.drain(range);
            }
            5 => {
                let range = self.range(bytes.len(), 64);
                let (copy, at) = (bytes[range].to_vec(), self.below(bytes.len()));
                bytes.splice(at..at, copy);
            }
            6 => {
                let Some(other) = files.get(self.below(files.len())) else { return };
                let from = self.range(other.len(), 256);
                let to = self.range(bytes.len(), 256);
                bytes.splice(to, other[from].iter().copied());
            }
            7 | 8 => self.replace_integer(bytes),
            _ => self.replace_number(bytes),
        }
    }

    /// Replaces an integer of 1, 2, 4 or 8 bytes in either order of bytes.
    fn replace_integer(&mut self, bytes: &mut [u8]) {
        let size = 1 << self.below(4);
        let value = INTEGERS[self.below(INTEGERS.len())];
        if bytes.len() >= size {
            let at = self.below(bytes.len() - size + 1);
            if self.below(2) == 0 {
                bytes[at..at + size].copy_from_slice(&value.to_le_bytes()[..size]);
            } else {
                bytes[at..at + size].copy_from_slice(&value.to_be_bytes()[8 - size..]);
            }
        }
    }

    /// Replaces a number in text.
    fn replace_number(&mut self, bytes: &mut Vec<u8>) {
        let is_part = |byte: &u8| byte.is_ascii_digit() || b"+-.eE".contains(byte);
        let from = self.below(bytes.len());
        let Some(start) = bytes.iter().skip(from).position(u8::is_ascii_digit).map(|at| at + from) else { return };
        let end = bytes[start..].iter().position(|byte| !is_part(byte)).map_or(bytes.len(), |at| at + start);
        let number = NUMBERS[self.below(NUMBERS.len())];
        bytes.splice(start..end, number.bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_gives_the_same_mutations_which_differ_from_the_files() {
        let files = vec![b"fx = 611.5\n".to_vec(), vec![0; 40]];
        let draw = |seed| {
            let mut mutator = Mutator::new(seed, 100);
            (0..200).map(|_| mutator.mutate(&files)).collect::<Vec<_>>()
        };
        assert_eq!(draw(1), draw(1));
        assert_ne!(draw(1), draw(2));
        assert!(draw(1).iter().filter(|bytes| !files.contains(bytes)).count() > 150);
        assert!(draw(1).iter().all(|bytes| bytes.len() <= 100));
        assert!(Mutator::new(1, 100).mutate(&[]).is_empty());
    }
}

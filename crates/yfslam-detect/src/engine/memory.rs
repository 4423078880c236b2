//! A buffer of floats that starts on a cache line, so that no vector straddles two lines.

use std::ops::{Deref, DerefMut};

/// Bytes of a cache line.
const LINE: usize = 64;

/// A slice of floats, zero at first, aligned to a cache line.
#[derive(Debug)]
pub(crate) struct Memory {
    /// It never grows, so that the start stays valid.
    floats: Vec<f32>,
    start: usize,
    length: usize,
}

impl Memory {
    pub(crate) fn new(length: usize) -> Self {
        let slack = LINE / size_of::<f32>();
        let floats = vec![0.0; length + slack];
        let start = floats.as_ptr().align_offset(LINE).min(slack);
        Self { floats, start, length }
    }
}

impl Deref for Memory {
    type Target = [f32];

    fn deref(&self) -> &[f32] {
        &self.floats[self.start..][..self.length]
    }
}

impl DerefMut for Memory {
    fn deref_mut(&mut self) -> &mut [f32] {
        &mut self.floats[self.start..][..self.length]
    }
}

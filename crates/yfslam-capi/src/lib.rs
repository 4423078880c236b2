//! The C library of yfslam. `include/yfslam.h` is its interface and its documentation.
//!
//! ```text
//! C ──pointers──► ffi (the only unsafe code) ──references──► exports ──► yfslam, yfslam-detect, yfslam-io
//! ```
//!
//! A panic never crosses into C: `ffi` turns it into a status.
#![deny(unsafe_code)]

mod error;
mod exports;
mod ffi;
mod structs;
#[cfg(test)]
mod tests;

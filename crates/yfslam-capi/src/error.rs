//! The status that functions return, and the text of the last error on each thread.

use std::cell::RefCell;
use std::ffi::{CString, c_char};
use std::fmt::Display;

/// The values of `yfslam_status`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
pub enum Status {
    Ok = 0,
    Argument = 1,
    Setup = 2,
    Frame = 3,
    File = 4,
    Internal = 5,
    End = 6,
}

/// Why a function did not do what it was asked for.
#[derive(Debug)]
pub struct Failure {
    pub status: Status,
    pub text: String,
}

impl Failure {
    pub fn argument(text: impl Into<String>) -> Self {
        Self { status: Status::Argument, text: text.into() }
    }

    pub fn setup(error: impl Display) -> Self {
        Self { status: Status::Setup, text: error.to_string() }
    }

    pub fn frame(error: impl Display) -> Self {
        Self { status: Status::Frame, text: error.to_string() }
    }

    pub fn file(error: impl Display) -> Self {
        Self { status: Status::File, text: error.to_string() }
    }

    pub fn internal(error: impl Display) -> Self {
        Self { status: Status::Internal, text: error.to_string() }
    }

    /// No failure: there is nothing left.
    pub fn end() -> Self {
        Self { status: Status::End, text: String::new() }
    }
}

pub type Result<T = ()> = std::result::Result<T, Failure>;

thread_local! {
    static LAST: RefCell<CString> = RefCell::default();
    static REASON: RefCell<CString> = RefCell::default();
}

/// Keeps the text of an error and returns its status.
pub fn keep(Failure { status, text }: Failure) -> Status {
    if status != Status::End {
        LAST.with(|last| *last.borrow_mut() = c_text(&text));
    }
    status
}

/// Returns the text of the last error on this thread.
pub fn last() -> *const c_char {
    LAST.with(|last| last.borrow().as_ptr())
}

/// Keeps a text of this thread that is no error.
pub fn keep_reason(text: &str) -> *const c_char {
    REASON.with(|reason| {
        *reason.borrow_mut() = c_text(text);
        reason.borrow().as_ptr()
    })
}

/// Returns the text for C, up to a zero byte that it may hold.
fn c_text(text: &str) -> CString {
    CString::new(text.split('\0').next().unwrap_or_default()).unwrap_or_default()
}

//! Frames that cannot be used.

/// A frame that cannot be used.
#[derive(Clone, Debug)]
pub struct Skip {
    /// Kind of fault, for counting.
    pub reason: &'static str,
    /// Frame, file, fault and what to do about it.
    pub message: String,
}

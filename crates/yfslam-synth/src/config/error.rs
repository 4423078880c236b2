//! Errors of a world configuration.

/// Why a world cannot be made.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum WorldError {
    /// A value outside its range.
    #[error("the synthetic world's `{name}` is {value}; it must be {range}")]
    OutOfRange {
        /// Name of the field.
        name: &'static str,
        /// The value found.
        value: String,
        /// What is allowed.
        range: &'static str,
    },
    /// A spec that cannot be read.
    #[error("`{spec}` does not name a synthetic world: {reason}")]
    Spec {
        /// The text that was given.
        spec: String,
        /// What is wrong and what would be right.
        reason: String,
    },
}

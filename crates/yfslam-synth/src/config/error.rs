//! Errors of a world configuration.

/// Why a world cannot be built.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum WorldError {
    /// A value outside its range.
    #[error("the synthetic world's `{name}` is {value}; it must be {range}")]
    OutOfRange {
        /// Name of the field.
        name: &'static str,
        /// The value.
        value: String,
        /// The allowed range.
        range: &'static str,
    },
    /// A malformed description of a world.
    #[error("`{spec}` does not name a synthetic world: {reason}")]
    Spec {
        /// The description.
        spec: String,
        /// What is wrong and what to do.
        reason: String,
    },
}

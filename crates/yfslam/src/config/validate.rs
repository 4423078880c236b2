//! Refuses values outside the declared ranges before a run begins.

use super::section::{Check, Section};
use super::{Config, DenseConfig};

/// A value that the configuration does not allow.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{key} = {value} is not allowed in the configuration: it must be {must}")]
pub struct ConfigError {
    /// Section and key.
    pub key: String,
    /// The value found.
    pub value: String,
    /// The values that are allowed.
    pub must: String,
}

impl Config {
    /// Checks that each number is within the range of its key, and that related keys agree.
    ///
    /// # Errors
    /// For the first value that is not allowed.
    pub fn validate(&self) -> Result<(), ConfigError> {
        check_ranges(self, "")?;
        self.dense.check_relations()
    }
}

impl DenseConfig {
    /// Checks that each number is within the range of its key, and that related keys agree.
    ///
    /// # Errors
    /// For the first value that is not allowed.
    pub fn validate(&self) -> Result<(), ConfigError> {
        check_ranges(self, "dense")?;
        self.check_relations()
    }

    fn check_relations(&self) -> Result<(), ConfigError> {
        let refused = |key: &str, value: f32, must: &str| {
            let must = format!("{must} dense.occupied, which is {}", self.occupied);
            Err(ConfigError { key: key.to_owned(), value: value.to_string(), must })
        };
        if self.clamp_min >= self.occupied {
            refused("dense.clamp_min", self.clamp_min, "below")
        } else if self.clamp_max <= self.occupied {
            refused("dense.clamp_max", self.clamp_max, "above")
        } else {
            Ok(())
        }
    }
}

/// Checks the numbers of a section and of those within it; `prefix` is its full name.
fn check_ranges(section: &impl Section, prefix: &str) -> Result<(), ConfigError> {
    let mut result = Ok(());
    section.visit_keys(prefix, &mut |path, key, number| {
        let (Check::Range(range), Some(number), true) = (&key.check, number, result.is_ok()) else { return };
        let [from, to] = range();
        // Comparisons with NaN are false: NaN is in no range.
        if !(from <= number && number <= to) {
            let space = if key.unit.is_empty() { "" } else { " " };
            let must = format!("from {from} to {to}{space}{}", key.unit);
            result = Err(ConfigError { key: path.to_owned(), value: number.to_string(), must });
        }
    });
    result
}

//! Ranges of physical parameters, and the error that says how to get back into them.

/// A parameter that no physical thing can have. Nothing was built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("parameter `{path}` is {value}, allowed is {allowed}: set `{path}` to an allowed value")]
pub struct ParameterError {
    /// Where it stands, from the struct that was checked down: `axes[1].device.mass_kg`.
    pub path: String,
    /// The refused value.
    pub value: f64,
    /// The allowed range, in words.
    pub allowed: String,
}

impl ParameterError {
    /// The same error seen from one level up: `mass_kg` within `device` becomes `device.mass_kg`.
    #[must_use]
    pub fn within(mut self, parent: &str) -> Self {
        self.path = format!("{parent}.{}", self.path);
        self
    }
}

/// Refuses `value` unless `is_allowed`.
pub(super) fn require(path: &str, value: f64, is_allowed: bool, allowed: &str) -> Result<(), ParameterError> {
    if is_allowed {
        return Ok(());
    }
    Err(ParameterError { path: path.to_owned(), value, allowed: allowed.to_owned() })
}

/// Refuses what is not a finite number.
pub(super) fn finite(path: &str, value: f64) -> Result<(), ParameterError> {
    require(path, value, value.is_finite(), "any finite number")
}

/// Refuses what is not finite and above 0.
pub(super) fn positive(path: &str, value: f64) -> Result<(), ParameterError> {
    require(path, value, value.is_finite() && value > 0.0, "> 0 and finite")
}

/// Refuses what is not finite and at least 0.
pub(super) fn not_negative(path: &str, value: f64) -> Result<(), ParameterError> {
    require(path, value, value.is_finite() && value >= 0.0, ">= 0 and finite")
}

/// Refuses what is not above 0; infinity is allowed.
pub(super) fn positive_or_infinite(path: &str, value: f64) -> Result<(), ParameterError> {
    require(path, value, value > 0.0, "> 0, or inf")
}

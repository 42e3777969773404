//! Ranges of physical parameters, and range errors.

/// A parameter out of range. Nothing was built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("parameter `{path}` is {value}, must be {allowed}")]
pub struct ParameterError {
    /// Path relative to the checked struct: `axes[1].device.mass_kg`.
    pub path: String,
    /// Value.
    pub value: f64,
    /// Allowed range as text.
    pub allowed: String,
}

impl ParameterError {
    /// Prefixes the path: `mass_kg` within `device` becomes `device.mass_kg`.
    #[must_use]
    pub fn with_path_prefix(mut self, parent: &str) -> Self {
        self.path = format!("{parent}.{}", self.path);
        self
    }
}

/// Checks `is_allowed`.
pub(super) fn require(path: &str, value: f64, is_allowed: bool, allowed: &str) -> Result<(), ParameterError> {
    if is_allowed {
        return Ok(());
    }
    Err(ParameterError { path: path.to_owned(), value, allowed: allowed.to_owned() })
}

/// Checks that the value is finite.
pub(super) fn finite(path: &str, value: f64) -> Result<(), ParameterError> {
    require(path, value, value.is_finite(), "a finite number")
}

/// Checks that the value is finite and > 0.
pub(super) fn positive(path: &str, value: f64) -> Result<(), ParameterError> {
    require(path, value, value.is_finite() && value > 0.0, "> 0 and finite")
}

/// Checks that the value is finite and >= 0.
pub(super) fn not_negative(path: &str, value: f64) -> Result<(), ParameterError> {
    require(path, value, value.is_finite() && value >= 0.0, ">= 0 and finite")
}

/// Checks that the value is > 0 or infinite.
pub(super) fn positive_or_infinite(path: &str, value: f64) -> Result<(), ParameterError> {
    require(path, value, value > 0.0, "> 0, or inf")
}

/// Describes the valid axes of a device, for messages.
pub(crate) fn valid_axes(count: usize) -> String {
    match count {
        0 => "the device has no axes".to_owned(),
        1 => "the only axis is 0".to_owned(),
        _ => format!("the axes are 0 to {}", count - 1),
    }
}

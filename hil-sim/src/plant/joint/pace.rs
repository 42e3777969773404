//! Rates of a joint, by parameter.

/// Rate of a parameter.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace {
    pub(super) path: &'static str,
    /// Path of the parameter.
    pub(super) value: f64,
    /// Natural frequency or reciprocal time constant.
    pub(super) per_s: f64,
}

impl Pace {
    pub(super) fn of(path: &'static str, value: f64, per_s: f64) -> Self {
        Self { path, value, per_s }
    }
}

//! What a device's sensors can show: what is beyond that was not measured.

/// Limits of all words of one of a device's outputs, in the SI unit of its type.
///
/// A measurement beyond them is [refused](crate::FrameError::Implausible) with its whole frame: an encoder has jumped, a
/// cable is broken. If the scheme moved the device, so is all that comes until a reset, or until it shows again what it
/// could. They are what the device can do with some room, not what it should do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutputLimits {
    /// Smallest value, finite.
    pub min: f32,
    /// Largest value, finite.
    pub max: f32,
    /// Largest change, either way, per second; infinity for any.
    pub rate_per_s: f32,
}

impl OutputLimits {
    /// Any finite value at any rate: as if nothing had been declared.
    pub const NONE: Self = Self { min: f32::MIN, max: f32::MAX, rate_per_s: f32::INFINITY };

    /// Whether a device can keep them.
    pub(crate) fn are_usable(&self, sample_period_s: f32) -> bool {
        let is_range = self.min.is_finite() && self.max.is_finite() && self.min <= self.max;
        is_range && self.rate_per_s * sample_period_s > 0.0
    }
}

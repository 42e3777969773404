//! Limits of a device's measurements.

/// Limits of all words of one device output, in SI units.
///
/// A measurement beyond them is [refused](crate::FrameError::Implausible) together with its whole frame: the
/// encoder has jumped, or a cable is broken. If the scheme was moving the device, this is a fault that
/// latches. Set the limits to what the device is physically capable of, with a margin, not to its operating
/// range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutputLimits {
    /// Minimum, finite.
    pub min: f32,
    /// Maximum, finite.
    pub max: f32,
    /// Maximum change per second in either direction; infinity for no limit.
    pub rate_per_s: f32,
}

impl OutputLimits {
    /// No limits: any finite value, any rate.
    pub const NONE: Self = Self { min: f32::MIN, max: f32::MAX, rate_per_s: f32::INFINITY };

    /// Checks that the limits are valid.
    pub(crate) fn are_usable(&self, sample_period_s: f32) -> bool {
        let is_range = self.min.is_finite() && self.max.is_finite() && self.min <= self.max;
        is_range && self.rate_per_s * sample_period_s > 0.0
    }
}

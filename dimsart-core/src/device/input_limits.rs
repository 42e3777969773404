//! Limits of a device's inputs: range, rate and safe value.

use crate::signal::{DataType, Format, Shape, types};

/// Limits of one word of a device's input, in SI units. The [safety stage](crate::Safety) enforces them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InputLimits {
    /// Minimum, finite.
    pub min: f32,
    /// Maximum, finite.
    pub max: f32,
    /// Maximum change per second in either direction; infinity for no limit. It also applies on the way to
    /// and from the safe value.
    pub rate_per_s: f32,
    /// Value while no scheme commands the device.
    pub safe_value: SafeValue,
}

/// Value of an input word while no scheme commands the device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SafeValue {
    /// Zero.
    Zero,
    /// The last value. Before the first command it is 0, clamped to the range; for
    /// [`DES_POSITION`](types::DES_POSITION) it is the measured [`POSITION`](types::POSITION), if the device
    /// has one.
    Hold,
    /// A force against the motion of the axis, `-coefficient · velocity`; zero in a tick without a velocity.
    ///
    /// The velocity is [`VELOCITY`](types::VELOCITY) if the device measures it, otherwise the difference of
    /// the last two [`POSITION`](types::POSITION) values.
    Damping {
        /// `N·s/m` or `N·m·s/rad`, above 0. Keep it below mass / sample period: the force is constant during
        /// a tick.
        coefficient: f32,
    },
}

/// Reason why limits are invalid.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum LimitsError {
    /// The range is empty or not finite, or does not contain 0, which the safe value needs.
    Range,
    /// The rate is not above 0.
    Rate,
    /// The allowed change per tick is lost in `f32` rounding within the range.
    RateTooSmall {
        /// The rate.
        rate_per_s: f32,
        /// The value of the range with the largest magnitude.
        at: f32,
        /// The minimum rate at that value.
        min_per_s: f32,
    },
    /// The damping coefficient is not finite or not above 0.
    Coefficient,
    /// Damping needs a type of shape vector, and a device that measures velocity or position.
    NoVelocity,
    /// The type is not of format `f32`: range, rate and damping do not apply.
    Format,
}

impl core::fmt::Display for LimitsError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match *self {
            Self::Range => "the range must be finite, and contain 0 unless the safe value is Hold",
            Self::Rate => "the rate must be above 0",
            Self::RateTooSmall { rate_per_s, at, min_per_s } => {
                return write!(
                    f,
                    "rate_per_s = {rate_per_s} is too small: the change per tick is lost in f32 rounding at {at}; set \
                     rate_per_s to {min_per_s} or more, or narrow the range"
                );
            }
            Self::Coefficient => "the damping coefficient must be finite and above 0",
            Self::NoVelocity => "damping needs one word per axis, and a device output VELOCITY or POSITION",
            Self::Format => "range, rate and damping need a word of format f32",
        })
    }
}

impl InputLimits {
    /// No limits: any finite value, any rate, safe value zero.
    pub const NONE: Self =
        Self { min: f32::MIN, max: f32::MAX, rate_per_s: f32::INFINITY, safe_value: SafeValue::Zero };

    /// # Errors
    /// [`LimitsError`] when the limits are invalid for a word of this type.
    pub(crate) fn check(
        &self,
        data_type: &DataType,
        outputs: &[&DataType],
        sample_period_s: f32,
    ) -> Result<(), LimitsError> {
        let require = |is_so: bool, fault| if is_so { Ok(()) } else { Err(fault) };
        if data_type.format != Format::F32 {
            let is_plain = matches!(self.safe_value, SafeValue::Zero | SafeValue::Hold);
            let without = Self { safe_value: self.safe_value, ..Self::NONE };
            return require(is_plain && *self == without, LimitsError::Format);
        }
        let is_range = self.min.is_finite() && self.max.is_finite() && self.min <= self.max;
        let has_zero = self.min <= 0.0 && 0.0 <= self.max;
        require(is_range && (has_zero || self.safe_value == SafeValue::Hold), LimitsError::Range)?;
        require(self.rate_per_s > 0.0, LimitsError::Rate)?;
        // Minimum change per tick: one ulp at the largest magnitude.
        let at = self.min.abs().max(self.max.abs()).max(f32::MIN_POSITIVE);
        let min_per_s = (at - f32::from_bits(at.to_bits() - 1)) / sample_period_s;
        let too_small = LimitsError::RateTooSmall { rate_per_s: self.rate_per_s, at, min_per_s };
        require(self.rate_per_s >= min_per_s, too_small)?;
        let SafeValue::Damping { coefficient } = self.safe_value else { return Ok(()) };
        require(coefficient.is_finite() && coefficient > 0.0, LimitsError::Coefficient)?;
        let has_axes = data_type.shape == Shape::Vector;
        let has_velocity = [types::VELOCITY, types::POSITION].iter().any(|from| outputs.contains(from));
        require(has_axes && has_velocity, LimitsError::NoVelocity)
    }
}

//! What a device allows each word of its inputs: a range, a rate, a safe value.

use crate::signal::{DataType, Format, Shape, types};

/// Limits of one word of a device's input, in the SI unit of its type. The [safety stage](crate::Safety) keeps them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InputLimits {
    /// Smallest value, finite.
    pub min: f32,
    /// Largest value, finite.
    pub max: f32,
    /// Largest change, either way, per second; infinity for any. The way to the safe value and back counts, too.
    pub rate_per_s: f32,
    /// What it gets while no scheme commands the device.
    pub safe_value: SafeValue,
}

/// What a word of a device's input is while no scheme commands the device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SafeValue {
    /// Zero.
    Zero,
    /// What it got last. Before the first command [`DES_POSITION`](types::DES_POSITION) is where the device stands, if it
    /// measures [`POSITION`](types::POSITION), any other type zero; or the nearest value of the range.
    Hold,
    /// A force against the axis' motion, `-coefficient · velocity`; zero in a tick without a velocity.
    ///
    /// The velocity is that of [`VELOCITY`](types::VELOCITY) where the device measures it, otherwise the difference
    /// between two ticks' [`POSITION`](types::POSITION).
    Damping {
        /// `N·s/m` or `N·m·s/rad`, above 0. Keep it below mass / sample period: the force is held for a tick.
        coefficient: f32,
    },
}

/// Why the limits of a word cannot be kept.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum LimitsFault {
    /// The range is empty or not finite; or it has no zero, which the safe value needs.
    Range,
    /// The rate is not above 0.
    Rate,
    /// The change that the rate allows in a tick is lost in rounding within the range.
    RateTooSmall {
        /// The rate.
        rate_per_s: f32,
        /// The value of the range that is farthest from zero.
        at: f32,
        /// The smallest rate that changes it.
        min_per_s: f32,
    },
    /// The coefficient of damping is not a finite number above 0.
    Coefficient,
    /// Damping takes an axis: a type of shape vector, on a device that measures velocities or positions.
    NoVelocity,
    /// The type is not of format `f32`: it has no range, no rate, and no damping.
    Format,
}

impl core::fmt::Display for LimitsFault {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match *self {
            Self::Range => "the range must be finite, and contain 0 unless the safe value is Hold",
            Self::Rate => "the rate must be above 0",
            Self::RateTooSmall { rate_per_s, at, min_per_s } => {
                return write!(
                    f,
                    "rate_per_s = {rate_per_s} is too small: its change in a tick is lost in rounding at {at}; set \
                     rate_per_s to {min_per_s} or more, or narrow the range"
                );
            }
            Self::Coefficient => "the coefficient of damping must be finite and above 0",
            Self::NoVelocity => "damping needs one word per axis, and VELOCITY or POSITION among the outputs",
            Self::Format => "only the format f32 has a range, a rate, or damping",
        })
    }
}

impl InputLimits {
    /// Any finite value at any rate, zero as the safe value: as if nothing had been declared.
    pub const NONE: Self =
        Self { min: f32::MIN, max: f32::MAX, rate_per_s: f32::INFINITY, safe_value: SafeValue::Zero };

    /// # Errors
    /// Why a device cannot keep them for a word of this type.
    pub(crate) fn check(
        &self,
        data_type: &DataType,
        outputs: &[&DataType],
        sample_period_s: f32,
    ) -> Result<(), LimitsFault> {
        let require = |is_so: bool, fault| if is_so { Ok(()) } else { Err(fault) };
        if data_type.format != Format::F32 {
            let is_plain = matches!(self.safe_value, SafeValue::Zero | SafeValue::Hold);
            let without = Self { safe_value: self.safe_value, ..Self::NONE };
            return require(is_plain && *self == without, LimitsFault::Format);
        }
        let is_range = self.min.is_finite() && self.max.is_finite() && self.min <= self.max;
        let has_zero = self.min <= 0.0 && 0.0 <= self.max;
        require(is_range && (has_zero || self.safe_value == SafeValue::Hold), LimitsFault::Range)?;
        require(self.rate_per_s > 0.0, LimitsFault::Rate)?;
        // In a tick by an ulp of the value farthest from zero.
        let at = self.min.abs().max(self.max.abs()).max(f32::MIN_POSITIVE);
        let min_per_s = (at - f32::from_bits(at.to_bits() - 1)) / sample_period_s;
        let too_small = LimitsFault::RateTooSmall { rate_per_s: self.rate_per_s, at, min_per_s };
        require(self.rate_per_s >= min_per_s, too_small)?;
        let SafeValue::Damping { coefficient } = self.safe_value else { return Ok(()) };
        require(coefficient.is_finite() && coefficient > 0.0, LimitsFault::Coefficient)?;
        let has_axes = data_type.shape == Shape::Vector;
        let has_velocity = [types::VELOCITY, types::POSITION].iter().any(|from| outputs.contains(from));
        require(has_axes && has_velocity, LimitsFault::NoVelocity)
    }
}

//! Operations on sets of possible values. Each result covers the operation on the members.

use super::{Values, greatest_divisor};
use crate::instruction::Shift;

impl Values {
    /// `a + b`, wrapping.
    pub(crate) fn add(&self, other: &Self) -> Self {
        if let Some(tried) = self.try_pairs(other, u32::wrapping_add) {
            return tried;
        }
        let step = greatest_divisor(self.step(), other.step());
        let (low, low_wraps) = self.low().overflowing_add(other.low());
        let (high, high_wraps) = self.high().overflowing_add(other.high());
        if low_wraps == high_wraps { Self::stepped(low, high, step) } else { Self::congruent(low, step) }
    }

    /// `a - b`, wrapping.
    pub(crate) fn subtract(&self, other: &Self) -> Self {
        if let Some(tried) = self.try_pairs(other, u32::wrapping_sub) {
            return tried;
        }
        let step = greatest_divisor(self.step(), other.step());
        let (low, low_wraps) = self.low().overflowing_sub(other.high());
        let (high, high_wraps) = self.high().overflowing_sub(other.low());
        if low_wraps == high_wraps { Self::stepped(low, high, step) } else { Self::congruent(low, step) }
    }

    /// Low word of `a b`.
    pub(crate) fn multiply(&self, other: &Self) -> Self {
        if let Some(tried) = self.try_pairs(other, u32::wrapping_mul) {
            return tried;
        }
        let zeros = |values: &Self| (values.low() | values.step()).trailing_zeros();
        let power = zeros(self) + zeros(other);
        let step = match (self.single(), other.single()) {
            (Some(factor), _) => other.step().checked_mul(factor),
            (_, Some(factor)) => self.step().checked_mul(factor),
            _ => 1_u32.checked_shl(power),
        };
        match (self.low().checked_mul(other.low()), self.high().checked_mul(other.high()), step) {
            (Some(low), Some(high), Some(step)) => Self::stepped(low, high, step),
            _ => Self::congruent(0, 1_u32.checked_shl(power).unwrap_or(1 << 31)),
        }
    }

    /// `a / b`, 0 when `b` is 0.
    pub(crate) fn divide(&self, other: &Self) -> Self {
        if let Some(tried) = self.try_pairs(other, |a, b| a.checked_div(b).unwrap_or(0)) {
            return tried;
        }
        let low = if other.low() == 0 { 0 } else { self.low().checked_div(other.high()).unwrap_or(0) };
        Self::between(low, self.high().checked_div(other.low().max(1)).unwrap_or(0))
    }

    /// `a & b`.
    pub(crate) fn and(&self, other: &Self) -> Self {
        if let Some(tried) = self.try_pairs(other, |a, b| a & b) {
            return tried;
        }
        let (many, mask) = match (self.single(), other.single()) {
            (Some(mask), _) => (other, mask),
            (_, Some(mask)) => (self, mask),
            _ => return Self::between(0, self.high().min(other.high())),
        };
        let below = 1_u32.checked_shl(mask.trailing_zeros()).unwrap_or(1 << 31);
        let dropped = !mask;
        if dropped & dropped.wrapping_add(1) == 0 {
            // Clearing low bits keeps the order.
            let step = if many.step() % below == 0 { many.step() } else { below };
            return Self::stepped(many.low() & mask, many.high() & mask, step);
        }
        if mask & mask.wrapping_add(1) == 0 {
            if many.low() & dropped == many.high() & dropped {
                return Self::stepped(many.low() & mask, many.high() & mask, many.step());
            }
            let power = power_of_two(many.step());
            if power <= mask {
                return Self::stepped(many.low() & (power - 1), mask, power);
            }
        }
        Self::stepped(0, many.high().min(mask) & mask_of(below), below)
    }

    /// `a | b`.
    pub(crate) fn or(&self, other: &Self) -> Self {
        if let Some(tried) = self.try_pairs(other, |a, b| a | b) {
            return tried;
        }
        if self.have_no_bit_in_common(other) {
            return self.add(other);
        }
        let low = self.low().max(other.low());
        Self::between(low, bits_below(self.high() | other.high()))
    }

    /// `a ^ b`.
    pub(crate) fn exclusive_or(&self, other: &Self) -> Self {
        if let Some(tried) = self.try_pairs(other, |a, b| a ^ b) {
            return tried;
        }
        if self.have_no_bit_in_common(other) {
            return self.add(other);
        }
        Self::between(0, bits_below(self.high() | other.high()))
    }

    /// `a` shifted by the low byte of `amount`; `None` if the result depends on the carry.
    pub(crate) fn shift(&self, shift: Shift, amount: &Self) -> Option<Self> {
        if shift == Shift::RotateExtended {
            return None;
        }
        if let Some(tried) = self.try_pairs(amount, |a, b| shifted(shift, a, b & 0xFF)) {
            return Some(tried);
        }
        let amount = amount.and(&Self::one(0xFF));
        let (least, greatest) = (amount.low(), amount.high());
        Some(match (shift, amount.single()) {
            (Shift::Left, Some(amount @ 0..32)) => self.multiply(&Self::one(1 << amount)),
            (Shift::Left, _) => {
                let by = |number: u32, bits| number.checked_mul(1_u32.checked_shl(bits)?);
                match by(self.high(), greatest) {
                    Some(high) => Self::between(by(self.low(), least).unwrap_or(0), high),
                    None if least > 31 => Self::one(0),
                    None => Self::ALL,
                }
            }
            (Shift::LogicalRight, Some(bits @ 0..32))
                if (self.low() | self.step()).trailing_zeros() >= bits =>
            {
                Self::stepped(self.low() >> bits, self.high() >> bits, self.step() >> bits)
            }
            (Shift::LogicalRight, _) => {
                let by = |number, bits| shifted(Shift::LogicalRight, number, bits);
                Self::between(by(self.low(), greatest), by(self.high(), least))
            }
            (Shift::ArithmeticRight, Some(bits)) if self.low() >> 31 == self.high() >> 31 => {
                let by = |number| shifted(Shift::ArithmeticRight, number, bits);
                Self::between(by(self.low()), by(self.high()))
            }
            _ => Self::ALL,
        })
    }

    /// All numbers congruent to `number` modulo the largest power of two in `step`: only this part of the
    /// step remains after a wrap.
    fn congruent(number: u32, step: u32) -> Self {
        let power = power_of_two(step);
        Self::stepped(number & (power - 1), u32::MAX, power)
    }

    fn have_no_bit_in_common(&self, other: &Self) -> bool {
        let fits = |below: &Self, above: &Self| {
            let power = 1_u64 << (above.low() | above.step()).trailing_zeros();
            u64::from(below.high()) < power
        };
        fits(self, other) || fits(other, self)
    }

    fn try_pairs(&self, other: &Self, function: impl Fn(u32, u32) -> u32) -> Option<Self> {
        Self::map([*self, *other, Self::one(0)], |[a, b, _]| function(a, b))
    }
}

/// Shifts one number by 0 to 255 bits, without the carry.
pub(crate) fn shifted(shift: Shift, number: u32, bits: u32) -> u32 {
    match shift {
        Shift::Left => number.checked_shl(bits).unwrap_or(0),
        Shift::LogicalRight => number.checked_shr(bits).unwrap_or(0),
        Shift::ArithmeticRight => (number.cast_signed() >> bits.min(31)).cast_unsigned(),
        Shift::RotateRight | Shift::RotateExtended => number.rotate_right(bits % 32),
    }
}

/// The largest power of two that divides a step; 2^31 for 0, which every power divides.
fn power_of_two(step: u32) -> u32 {
    1 << step.trailing_zeros().min(31)
}

/// A mask that clears the bits below a power of two.
fn mask_of(power: u32) -> u32 {
    !(power - 1)
}

/// All bits from the highest set bit of `number` down.
fn bits_below(number: u32) -> u32 {
    u32::MAX.checked_shr(number.leading_zeros()).unwrap_or(0)
}

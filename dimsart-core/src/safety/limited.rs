//! Limits of one input word of the device.

use super::Velocity;
use crate::device::{DeviceDescriptor, LimitedWord, SafeValue};
use crate::signal::types;
use crate::signal::word::{Format, Scalar as _, Word};

/// A limited word: limits per tick and last value.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limited {
    pub(super) place: usize,
    /// Index of the measured position where a held position starts; out of every frame for other words.
    pub(super) stands_at: usize,
    axis: usize,
    has_range: bool,
    min: f32,
    max: f32,
    /// Maximum change per tick.
    step: f32,
    safe_value: SafeValue,
    /// Last value.
    pub(super) given: Word,
}

/// Limits that were applied to a word.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Held {
    pub(super) by_range: bool,
    pub(super) by_rate: bool,
}

impl Limited {
    pub(super) fn new(word: &LimitedWord, device: &DeviceDescriptor) -> Self {
        let limits = word.limits;
        let is_held = limits.safe_value == SafeValue::Hold && word.data_type == types::DES_POSITION;
        let position = if is_held { device.output_place(types::POSITION) } else { None };
        let mut limited = Self {
            place: word.place,
            stands_at: position.map_or(usize::MAX, |position| position + word.axis),
            axis: word.axis,
            has_range: word.data_type.format == Format::F32,
            min: limits.min,
            max: limits.max,
            step: limits.rate_per_s * device.sample_period_s(),
            safe_value: limits.safe_value,
            given: Word(0),
        };
        if limited.has_range {
            limited.begin(0.0);
        }
        limited
    }

    /// Sets the last value, clamped to the range.
    pub(super) fn begin(&mut self, value: f32) {
        self.given = between(value, self.min, self.max).into_word();
    }

    /// Returns the command, limited by range and rate.
    #[inline(always)]
    pub(super) fn give(&mut self, wanted: Word, held: &mut Held) -> Word {
        self.given = if self.has_range {
            let (value, last) = (f32::from_word(wanted), f32::from_word(self.given));
            let [low, high] = [last - self.step, last + self.step];
            let reached = if value < low || value < self.min {
                let is_rate = low > self.min;
                held.by_range |= value < self.min;
                held.by_rate |= is_rate;
                if is_rate { low } else { self.min }
            } else if value > high || value > self.max {
                let is_rate = high < self.max;
                held.by_range |= value > self.max;
                held.by_rate |= is_rate;
                if is_rate { high } else { self.max }
            } else {
                value
            };
            reached.into_word()
        } else {
            wanted
        };
        self.given
    }

    /// Returns the safe value.
    pub(super) fn safe_value(&self, velocity: &Velocity, measured: &[Word], period_s: f32) -> Word {
        match self.safe_value {
            SafeValue::Zero => Word(0),
            SafeValue::Hold => self.given,
            SafeValue::Damping { coefficient } => {
                (-coefficient * velocity.of(self.axis, measured, period_s)).into_word()
            }
        }
    }
}

/// Clamps `x`. `f32::clamp` would panic on invalid bounds.
fn between(x: f32, min: f32, max: f32) -> f32 {
    if x < min {
        min
    } else if x > max {
        max
    } else {
        x
    }
}

//! What a device's sensors can show: what is beyond that was not measured.

use heapless::Vec;

use crate::device::DeviceDescriptor;
use crate::limits::MAX_LIMITED_WORDS;
use crate::word::{Scalar as _, Word};

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

/// Looks at what a device's words with limits show, and keeps it for the next tick.
#[derive(Debug)]
pub(crate) struct Plausibility {
    words: Vec<Watched, MAX_LIMITED_WORDS>,
    sample_period_s: f32,
}

#[derive(Debug)]
struct Watched {
    place: u16,
    limits: &'static OutputLimits,
    /// What it showed last that was plausible; no number before the first time.
    last: f32,
}

impl Plausibility {
    pub(crate) const fn unconnected() -> Self {
        Self { words: Vec::new(), sample_period_s: 0.0 }
    }

    pub(crate) fn new(device: &DeviceDescriptor) -> Self {
        let limited = device.limited_output_words().map(|(place, limits)| Watched {
            place: u16::try_from(place).unwrap_or(u16::MAX),
            limits,
            last: f32::NAN,
        });
        // As many as there is room for: the descriptor has no more.
        Self { words: limited.collect(), sample_period_s: device.sample_period_s() }
    }

    /// The place of the first word that shows what it cannot.
    #[inline]
    pub(crate) fn look_at(&mut self, measured: &[Word]) -> Option<u16> {
        let mut wrong = None;
        for Watched { place, limits, last } in &mut self.words {
            let Some(word) = measured.get(usize::from(*place)) else { continue };
            let now = f32::from_word(*word);
            let is_beyond = now < limits.min || now > limits.max;
            if is_beyond || (now - *last).abs() > limits.rate_per_s * self.sample_period_s {
                wrong = wrong.or(Some(*place));
            } else {
                *last = now;
            }
        }
        wrong
    }

    /// What the words show next is where they are, however far from where they were.
    pub(crate) fn begin_anew(&mut self) {
        for watched in &mut self.words {
            watched.last = f32::NAN;
        }
    }
}

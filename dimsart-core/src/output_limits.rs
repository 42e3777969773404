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
    /// The first words of its frame.
    words: Vec<Watched, MAX_LIMITED_WORDS>,
}

/// In RAM, limits too: reading them from flash takes longer than the rest.
#[derive(Debug)]
struct Watched {
    min: f32,
    max: f32,
    /// Largest change in a tick.
    step: f32,
    /// What it showed last that was plausible; no number before the first time.
    last: f32,
}

impl Plausibility {
    pub(crate) const fn unconnected() -> Self {
        Self { words: Vec::new() }
    }

    pub(crate) fn disconnect(&mut self) {
        self.words.clear();
    }

    pub(crate) fn connect(&mut self, device: &DeviceDescriptor) {
        self.disconnect();
        for OutputLimits { min, max, rate_per_s } in device.limits_of_output_words() {
            let step = rate_per_s * device.sample_period_s();
            // As many as there is room for: the descriptor has no more.
            let _ = self.words.push(Watched { min: *min, max: *max, step, last: f32::NAN });
        }
    }

    /// Whether there is something to look at.
    #[inline(always)]
    pub(crate) fn has_limits(&self) -> bool {
        !self.words.is_empty()
    }

    /// Whether all words show what they can.
    #[inline(never)]
    pub(crate) fn look_at(&mut self, measured: &[Word]) -> bool {
        let mut are_plausible = true;
        for (watched, word) in self.words.iter_mut().zip(measured) {
            let now = f32::from_word(*word);
            if watched.can_show(now) {
                watched.last = now;
            } else {
                are_plausible = false;
            }
        }
        are_plausible
    }

    /// The place of the first word that shows what it cannot.
    #[cold]
    pub(crate) fn implausible(&self, measured: &[Word]) -> Option<u16> {
        let mut words = (0..).zip(self.words.iter().zip(measured));
        let found = words.find(|(_, (watched, word))| !watched.can_show(f32::from_word(**word)));
        found.map(|(place, _)| place)
    }

    /// What the words show next is where they are, however far from where they were.
    pub(crate) fn begin_anew(&mut self) {
        for watched in &mut self.words {
            watched.last = f32::NAN;
        }
    }
}

impl Watched {
    #[inline(always)]
    fn can_show(&self, now: f32) -> bool {
        let is_beyond = now < self.min || now > self.max;
        // Not the other way round: before the first time the difference is no number.
        !(is_beyond || (now - self.last).abs() > self.step)
    }
}

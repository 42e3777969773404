//! Plausibility check of measurements: range and rate of change.

use heapless::Vec;

use crate::device::descriptor::DeviceDescriptor;
use crate::device::output_limits::OutputLimits;
use crate::limits::MAX_LIMITED_WORDS;
use crate::signal::word::{Scalar as _, Word};

/// Checks the measured words that have limits, and keeps their last values.
#[derive(Debug)]
pub(crate) struct Plausibility {
    /// The first words of the frame.
    words: Vec<Watched, MAX_LIMITED_WORDS>,
}

/// The limits are copied to RAM: reading them from flash takes longer than the check.
#[derive(Debug)]
struct Watched {
    min: f32,
    max: f32,
    /// Maximum change per tick.
    step: f32,
    /// Last plausible value; NaN before the first one.
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
            // Does not overflow: the descriptor checks the count.
            let _ = self.words.push(Watched { min: *min, max: *max, step, last: f32::NAN });
        }
    }

    /// Returns whether any word has limits.
    #[inline(always)]
    pub(crate) fn has_limits(&self) -> bool {
        !self.words.is_empty()
    }

    /// Checks all words; returns whether they are plausible.
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

    /// Returns the index of the first implausible word.
    #[cold]
    pub(crate) fn implausible(&self, measured: &[Word]) -> Option<u16> {
        let mut words = (0..).zip(self.words.iter().zip(measured));
        let found = words.find(|(_, (watched, word))| !watched.can_show(f32::from_word(**word)));
        found.map(|(place, _)| place)
    }

    /// Accepts the next values whatever the last ones were.
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
        // Written so that NaN, the last value before the first measurement, passes.
        !(is_beyond || (now - self.last).abs() > self.step)
    }
}

//! Plausibility of measurements: which words of a device's outputs show an impossible value.

use heapless::Vec;

use crate::device::descriptor::DeviceDescriptor;
use crate::device::output_limits::OutputLimits;
use crate::limits::MAX_LIMITED_WORDS;
use crate::signal::word::{Scalar as _, Word};

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

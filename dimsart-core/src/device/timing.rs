//! How well ticks keep their time, as measured by whoever calls them.

use crate::signal::Word;

/// Ticks counted and measured since the start.
///
/// A tick is *late* when it began more than a tenth of a period after it was due, and *overran* when the
/// next one was due before it had ended; that next one is then left out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Timing {
    /// Ticks.
    pub ticks: u32,
    /// Ticks that began late.
    pub late: u32,
    /// Ticks that overran.
    pub overruns: u32,
    /// How long ticks took, if the board can tell.
    pub duration: Option<Duration>,
}

/// Processor cycles from reading the sensors to commanding the actuators.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Duration {
    /// Of the last tick.
    pub last_cycles: u32,
    /// Of the longest tick.
    pub max_cycles: u32,
    /// The mean, times `MEMORY_TICKS`.
    scaled_mean: u64,
}

/// Ticks after which a duration has mostly left the mean.
const MEMORY_TICKS: u64 = 1024;

impl Duration {
    /// Mean of the last thousand ticks or so: older ones count less and less.
    #[must_use]
    pub fn mean_cycles(&self) -> u32 {
        u32::try_from(self.scaled_mean / MEMORY_TICKS).unwrap_or(u32::MAX)
    }
}

impl Timing {
    /// Counts a tick.
    pub fn count(&mut self, is_late: bool, has_overrun: bool) {
        self.ticks = self.ticks.wrapping_add(1);
        self.late = self.late.saturating_add(u32::from(is_late));
        self.overruns = self.overruns.saturating_add(u32::from(has_overrun));
    }

    /// Takes a tick's duration.
    pub fn measure(&mut self, last_cycles: u32) {
        self.duration = Some(match self.duration {
            None => Duration {
                last_cycles,
                max_cycles: last_cycles,
                scaled_mean: MEMORY_TICKS * u64::from(last_cycles),
            },
            Some(Duration { max_cycles, scaled_mean, .. }) => Duration {
                last_cycles,
                max_cycles: max_cycles.max(last_cycles),
                scaled_mean: scaled_mean - scaled_mean / MEMORY_TICKS + u64::from(last_cycles),
            },
        });
    }

    /// The words of [`types::TIMING`](crate::types::TIMING), `period_cycles` from one tick's begin to the next one's; durations
    /// that are not known are 0.
    #[must_use]
    pub fn words(&self, period_cycles: u32) -> [Word; 6] {
        let Self { late, overruns, duration, .. } = *self;
        let cycles =
            duration.map_or([0; 3], |found| [found.last_cycles, found.mean_cycles(), found.max_cycles]);
        let [last, mean, max] = cycles;
        [last, mean, max, late, overruns, period_cycles].map(Word)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_and_the_last_are_told() {
        let mut timing = Timing::default();
        timing.measure(200);
        timing.measure(100);
        let duration = timing.duration.unwrap();
        assert_eq!((duration.last_cycles, duration.max_cycles), (100, 200));
    }

    #[test]
    fn the_mean_follows_the_last_thousand_ticks() {
        let mut timing = Timing::default();
        timing.measure(4000);
        for _ in 0..1024 {
            timing.measure(1000);
        }
        // 1000 + 3000 / e
        assert_eq!(timing.duration.unwrap().mean_cycles(), 2103);
        (0..20_000).for_each(|_| timing.measure(u32::MAX));
        let duration = timing.duration.unwrap();
        assert!(duration.mean_cycles() > u32::MAX - 20, "{}", duration.mean_cycles());
    }

    #[test]
    fn late_ticks_and_overruns_are_counted_apart() {
        let mut timing = Timing::default();
        timing.count(true, false);
        timing.count(false, true);
        timing.count(false, false);
        assert_eq!((timing.ticks, timing.late, timing.overruns), (3, 1, 1));
        assert_eq!(timing.words(7).map(|word| word.0), [0, 0, 0, 1, 1, 7]);
    }
}

//! Tick timing, as the caller of the ticks measures it.

use crate::signal::Word;

/// Tick counts and durations since the start.
///
/// A tick is *late* if it starts more than a tenth of a period after it was due. It *overruns* if the next
/// tick is due before it has ended; that next tick is skipped.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Timing {
    /// Number of ticks.
    pub ticks: u32,
    /// Number of late ticks.
    pub late: u32,
    /// Number of overruns.
    pub overruns: u32,
    /// Duration of the ticks, if the board measures it.
    pub duration: Option<Duration>,
}

/// Processor cycles from reading the sensors to commanding the actuators.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Duration {
    /// Duration of the last tick.
    pub last_cycles: u32,
    /// Duration of the longest tick.
    pub max_cycles: u32,
    /// Mean, times `MEMORY_TICKS`.
    scaled_mean: u64,
}

/// Time constant of the mean, in ticks.
const MEMORY_TICKS: u64 = 1024;

impl Duration {
    /// Returns the exponential mean over about 1000 ticks.
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

    /// Records the duration of a tick.
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

    /// Returns the words of [`types::TIMING`](crate::types::TIMING); `period_cycles` is the time between the
    /// starts of the last two ticks. Unknown durations are 0.
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
    fn the_longest_and_the_last_are_reported() {
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

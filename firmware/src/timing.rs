//! How well the ticks keep their time.

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
    sum_cycles: u64,
    measured: u32,
}

impl Duration {
    /// Of all ticks on average.
    #[must_use]
    pub fn mean_cycles(&self) -> u32 {
        let mean = self.sum_cycles.checked_div(u64::from(self.measured)).unwrap_or_default();
        u32::try_from(mean).unwrap_or(u32::MAX)
    }
}

impl Timing {
    /// Counts a tick.
    pub fn count(&mut self, is_late: bool, has_overrun: bool) {
        self.ticks = self.ticks.wrapping_add(1);
        self.late = self.late.saturating_add(u32::from(is_late));
        self.overruns = self.overruns.saturating_add(u32::from(has_overrun));
    }

    /// Takes a tick's duration from two readings of a counter whose lowest `bits` bits count.
    pub fn measure(&mut self, start: u32, end: u32, bits: u32) {
        let last_cycles = end.wrapping_sub(start) & u32::MAX.checked_shr(32 - bits.min(32)).unwrap_or(0);
        let before =
            self.duration.unwrap_or(Duration { last_cycles, max_cycles: 0, sum_cycles: 0, measured: 0 });
        self.duration = Some(Duration {
            last_cycles,
            max_cycles: before.max_cycles.max(last_cycles),
            sum_cycles: before.sum_cycles.saturating_add(u64::from(last_cycles)),
            measured: before.measured.saturating_add(1),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_right_across_the_counter_s_wrap() {
        let mut timing = Timing::default();
        timing.measure(0xff_fff0, 0x10, 24);
        timing.measure(100, 200, 24);
        let duration = timing.duration.unwrap();
        assert_eq!((duration.last_cycles, duration.max_cycles, duration.mean_cycles()), (100, 100, 66));
        timing.measure(u32::MAX, 3, 32);
        assert_eq!(timing.duration.unwrap().last_cycles, 4);
    }

    #[test]
    fn late_ticks_and_overruns_are_counted_apart() {
        let mut timing = Timing::default();
        timing.count(true, false);
        timing.count(false, true);
        timing.count(false, false);
        assert_eq!((timing.ticks, timing.late, timing.overruns), (3, 1, 1));
        assert_eq!(timing.duration, None);
    }
}

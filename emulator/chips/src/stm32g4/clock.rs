//! Conversion of processor cycles to time. The clock frequency changes while a program starts.

/// Clock frequency of the processor and of all buses, and the time of its last change.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    hz: f64,
    since_cycle: u64,
    since_s: f64,
}

impl Clock {
    pub(super) fn new(hz: f64) -> Self {
        Self { hz, since_cycle: 0, since_s: 0.0 }
    }

    /// Cycles per second.
    #[must_use]
    pub fn hz(&self) -> f64 {
        self.hz
    }

    pub(super) fn change(&mut self, hz: f64, cycle: u64) {
        *self = Self { hz, since_cycle: cycle, since_s: self.seconds_at(cycle) };
    }

    /// Time of a cycle at the present frequency, `s`.
    #[must_use]
    pub fn seconds_at(&self, cycle: u64) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "a run has less than 2^53 cycles")]
        let cycles = cycle.saturating_sub(self.since_cycle) as f64;
        self.since_s + cycles / self.hz
    }

    /// Cycle at a time, at the present frequency.
    #[must_use]
    pub fn cycle_at(&self, time_s: f64) -> u64 {
        self.since_cycle + whole((time_s - self.since_s) * self.hz)
    }

    /// Cycles of a duration, rounded up.
    pub(super) fn cycles(&self, duration_s: f64) -> u64 {
        whole(duration_s * self.hz)
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "casts saturate")]
fn whole(cycles: f64) -> u64 {
    cycles.ceil() as u64
}

//! Real time: waits for the moment of each tick and counts the ticks that come late.
//!
//! Tick `k` is due at `start + k T`, whatever became of the ticks before it: a late tick does not move
//! the ones after it, so nothing drifts.

use std::time::{Duration, Instant};

/// Keeps ticks in step with the clock.
#[derive(Debug)]
pub struct Pace {
    start: Instant,
    period: Duration,
    late_ticks: u64,
    worst_lateness: Duration,
}

impl Pace {
    /// Starts now; a tick is late when it comes more than `period_s` after its moment.
    #[must_use]
    pub fn start(period_s: f64) -> Self {
        let period = Duration::from_secs_f64(period_s);
        Self { start: Instant::now(), period, late_ticks: 0, worst_lateness: Duration::ZERO }
    }

    /// Sleeps until `time_s` after the start; returns at once when that is past.
    pub fn wait_for(&mut self, time_s: f64) {
        let due = Duration::from_secs_f64(time_s);
        if let Some(rest) = due.checked_sub(self.start.elapsed()) {
            std::thread::sleep(rest);
        }
        let lateness = self.start.elapsed().saturating_sub(due);
        self.late_ticks += u64::from(lateness > self.period);
        self.worst_lateness = self.worst_lateness.max(lateness);
    }

    /// Ticks that came more than a period late.
    #[must_use]
    pub fn late_ticks(&self) -> u64 {
        self.late_ticks
    }

    /// How late the latest tick came, `s`.
    #[must_use]
    pub fn worst_lateness_s(&self) -> f64 {
        self.worst_lateness.as_secs_f64()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stall_is_made_up_for_and_counted() {
        let clock = Instant::now();
        let mut pace = Pace::start(1e-3);
        for tick in 0..800_u32 {
            pace.wait_for(f64::from(tick) * 1e-3);
            if tick == 100 {
                std::thread::sleep(Duration::from_millis(400));
            }
        }
        let took_s = clock.elapsed().as_secs_f64();
        assert!(took_s >= 0.799, "ran ahead of the clock: {took_s} s");
        assert!(took_s < 1.1, "the stall of 0.4 s was not made up for: {took_s} s");
        assert!(pace.late_ticks() >= 390, "{} late ticks", pace.late_ticks());
        assert!(pace.worst_lateness_s() >= 0.399, "{} s", pace.worst_lateness_s());
    }
}

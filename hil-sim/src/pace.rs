//! Real time: waits for the moment of each tick and counts the ticks that come late.
//!
//! Tick `k` is due at `start + k T`, whatever became of the ticks before it: a late tick does not move
//! the ones after it, so nothing drifts.

use std::time::{Duration, Instant};

/// What tells and passes the time.
pub trait Clock {
    /// The present moment.
    fn now(&self) -> Instant;
    /// Lets time pass until `moment`; returns at once when that is past.
    fn sleep_until(&mut self, moment: Instant);
}

/// The computer's own clock.
#[derive(Debug, Clone, Copy, Default)]
pub struct SystemClock;

impl Clock for SystemClock {
    fn now(&self) -> Instant {
        Instant::now()
    }

    fn sleep_until(&mut self, moment: Instant) {
        std::thread::sleep(moment.saturating_duration_since(Instant::now()));
    }
}

/// Keeps ticks in step with a clock.
#[derive(Debug)]
pub struct Pace<C = SystemClock> {
    clock: C,
    start: Instant,
    period: Duration,
    late_ticks: u64,
    worst_lateness: Duration,
}

impl<C: Clock> Pace<C> {
    /// Starts at `start`, which may still be to come; a tick is late when it comes more than `period_s` after its
    /// moment.
    #[must_use]
    pub fn new(clock: C, start: Instant, period_s: f64) -> Self {
        let period = Duration::from_secs_f64(period_s);
        Self { clock, start, period, late_ticks: 0, worst_lateness: Duration::ZERO }
    }

    /// Sleeps until `time_s` after the start; does not when that is past.
    pub fn wait_for(&mut self, time_s: f64) {
        let due = self.start + Duration::from_secs_f64(time_s);
        self.clock.sleep_until(due);
        let lateness = self.clock.now().saturating_duration_since(due);
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
    use std::cell::Cell;

    /// A clock whose time passes only when it is told to.
    struct Told<'a>(&'a Cell<Instant>);

    impl Clock for Told<'_> {
        fn now(&self) -> Instant {
            self.0.get()
        }

        fn sleep_until(&mut self, moment: Instant) {
            self.0.set(self.0.get().max(moment));
        }
    }

    #[test]
    fn a_stall_is_made_up_for_and_counted() {
        let start = Instant::now();
        let now = Cell::new(start);
        let mut pace = Pace::new(Told(&now), start, 0.25);
        for tick in 0..100_u32 {
            pace.wait_for(0.25 * f64::from(tick));
            if tick == 10 {
                now.set(now.get() + Duration::from_secs(10));
            }
        }
        // Tick 11 is due a period after tick 10 and comes 10 s after it; those up to tick 48 more than a period late.
        assert!((pace.worst_lateness_s() - 9.75).abs() < 1e-9, "{} s", pace.worst_lateness_s());
        assert_eq!(pace.late_ticks(), 38);
        // Tick 50 is due 10 s after tick 10: from there on every tick comes on time again.
        assert_eq!(now.get() - start, Duration::from_millis(99 * 250));
    }

    #[test]
    fn a_start_that_is_to_come_is_waited_for() {
        let now = Cell::new(Instant::now());
        let start = now.get() + Duration::from_secs(1);
        let mut pace = Pace::new(Told(&now), start, 1e-3);
        pace.wait_for(0.0);
        assert_eq!((now.get(), pace.late_ticks()), (start, 0));
    }

    #[test]
    fn the_computers_clock_never_runs_ahead() {
        let start = Instant::now();
        let mut pace = Pace::new(SystemClock, start, 1e-3);
        pace.wait_for(0.02);
        assert!(start.elapsed() >= Duration::from_millis(20));
    }
}

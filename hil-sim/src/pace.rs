//! Real time: waits for the moment of each tick and counts the ticks that come late.
//!
//! Tick `k` is due at `start + k T`. After a stall, ticks either [catch up](TickPacer::wait_until), as in a process that must stay
//! in step with another one; or the [time is skipped](TickPacer::wait_or_skip), as in a simulation with clients, whose leases and
//! timeouts must not end in a burst of ticks.

use std::time::{Duration, Instant};

use crate::clock;

/// Delay up to which ticks still catch up: shorter than any lease or timeout.
const MAX_DELAY: Duration = Duration::from_millis(20);
/// Time without a skip after which the next one is reported again, `s`.
const EPISODE_S: f64 = 1.0;

/// Keeps ticks in step with a clock.
#[derive(Debug)]
pub struct TickPacer {
    start: Instant,
    period_s: f64,
    late_ticks: u64,
    max_delay: Duration,
    skipped_s: f64,
    last_skip_s: f64,
}

/// Time skipped by a simulation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkippedTime {
    /// Simulation time of the skip, `s`.
    pub at_s: f64,
    /// Length of the skip, `s`.
    pub duration_s: f64,
    /// Total since the start, `s`.
    pub total_s: f64,
}

impl std::fmt::Display for SkippedTime {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { at_s, duration_s, total_s } = self;
        write!(
            f,
            "this computer is too slow: skipped {:.0} ms of real time at {at_s:.3} s, {total_s:.2} s in total",
            duration_s * 1e3
        )
    }
}

impl TickPacer {
    /// Starts at `start`, which may be in the future; a tick is late if it comes more than a period after its moment.
    #[must_use]
    pub fn new(start: Instant, period_s: f64) -> Self {
        let (max_delay, last_skip_s) = (Duration::ZERO, f64::NEG_INFINITY);
        Self { start, period_s, late_ticks: 0, max_delay, skipped_s: 0.0, last_skip_s }
    }

    /// Sleeps until `time_s` after the start; returns at once after it.
    pub fn wait_until(&mut self, time_s: f64) {
        self.wait(time_s);
    }

    /// Like [`wait_until`](Self::wait_until), but skips delays above 20 ms instead of catching up. Returns the first skip
    /// after one second without a skip.
    pub fn wait_or_skip(&mut self, time_s: f64) -> Option<SkippedTime> {
        let delay = self.wait(time_s);
        if delay <= MAX_DELAY {
            return None;
        }
        self.start += delay;
        let duration_s = delay.as_secs_f64();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "ticks of a stall")]
        let ticks = (duration_s / self.period_s).round() as u64;
        self.late_ticks += ticks;
        self.skipped_s += duration_s;
        let is_new = time_s - self.last_skip_s > EPISODE_S;
        self.last_skip_s = time_s;
        is_new.then_some(SkippedTime { at_s: time_s, duration_s, total_s: self.skipped_s })
    }

    fn wait(&mut self, time_s: f64) -> Duration {
        let due = self.start + Duration::from_secs_f64(time_s);
        clock::sleep_until(due);
        let delay = clock::elapsed_since(due);
        self.late_ticks += u64::from(delay.as_secs_f64() > self.period_s);
        self.max_delay = self.max_delay.max(delay);
        delay
    }

    /// Returns the number of ticks that were more than one period late or skipped.
    #[must_use]
    pub fn late_ticks(&self) -> u64 {
        self.late_ticks
    }

    /// Returns the maximum delay, `s`.
    #[must_use]
    pub fn worst_lateness_s(&self) -> f64 {
        self.max_delay.as_secs_f64()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stall_is_made_up_for_and_counted() {
        let _time = clock::freeze_time();
        let start = clock::now();
        let mut pace = TickPacer::new(start, 0.25);
        for tick in 0..100_u32 {
            pace.wait_until(0.25 * f64::from(tick));
            if tick == 10 {
                clock::sleep(Duration::from_secs(10));
            }
        }
        // Tick 11 is due one period after tick 10 and is 10 s late; up to tick 48 the ticks are more than one period
        // late.
        assert!((pace.worst_lateness_s() - 9.75).abs() < 1e-9, "{} s", pace.worst_lateness_s());
        assert_eq!(pace.late_ticks(), 38);
        // Tick 50 is due 10 s after tick 10; from there on all ticks are on time.
        assert_eq!(clock::elapsed_since(start), Duration::from_millis(99 * 250));
    }

    /// Two stalls of 150 ms, 200 ms apart, and one 5 s later.
    #[test]
    fn a_stall_is_skipped_without_a_burst_and_reported_once() {
        let _time = clock::freeze_time();
        let mut pace = TickPacer::new(clock::now(), 1e-3);
        let (mut last, mut reports) = (clock::now(), Vec::new());
        for tick in 0..8000_u32 {
            reports.extend(pace.wait_or_skip(1e-3 * f64::from(tick)));
            let is_early = clock::elapsed_since(last) < Duration::from_micros(999);
            assert!(
                tick == 0 || !is_early,
                "tick {tick} comes {:?} after the one before",
                clock::elapsed_since(last)
            );
            last = clock::now();
            if [1000, 1200, 6200].contains(&tick) {
                clock::sleep(Duration::from_millis(150));
            }
        }
        let found: Vec<_> = reports.iter().map(|report| (report.at_s, report.total_s)).collect();
        assert!((reports[0].duration_s - 0.149).abs() < 1e-9, "{reports:?}");
        assert_eq!(found.len(), 2, "{found:?}");
        assert!((found[1].1 - 3.0 * 0.149).abs() < 1e-9, "{found:?}");
        assert_eq!(pace.late_ticks(), 3 * 150);
    }

    #[test]
    fn a_start_that_is_to_come_is_waited_for() {
        let _time = clock::freeze_time();
        let start = clock::now() + Duration::from_secs(1);
        let mut pace = TickPacer::new(start, 1e-3);
        pace.wait_until(0.0);
        assert_eq!((clock::now(), pace.late_ticks()), (start, 0));
    }

    #[test]
    fn the_computers_clock_never_runs_ahead() {
        let start = Instant::now();
        let mut pace = TickPacer::new(start, 1e-3);
        pace.wait_until(0.02);
        assert!(start.elapsed() >= Duration::from_millis(20));
    }
}

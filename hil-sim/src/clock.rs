//! Clock for waiting: the system's, in slow motion, or controlled by a test.

use std::cell::Cell;
use std::sync::OnceLock;
use std::thread;
use std::time::{Duration, Instant};

/// Start and speed of slow motion.
static SLOW: OnceLock<(Instant, f64)> = OnceLock::new();

thread_local! {
    static SIMULATED: Cell<Option<Instant>> = const { Cell::new(None) };
}

/// While it exists, time advances for its thread only in sleeps.
#[derive(Debug)]
pub struct SimulatedTimeGuard(());

/// Freezes the time of this thread, for a test.
#[must_use]
pub fn freeze_time() -> SimulatedTimeGuard {
    SIMULATED.set(Some(Instant::now()));
    SimulatedTimeGuard(())
}

impl Drop for SimulatedTimeGuard {
    fn drop(&mut self) {
        SIMULATED.set(None);
    }
}

/// Sets the speed of the program's time, such as 0.1 for slow motion. Only the first call has an effect.
pub fn set_speed(speed: f64) {
    SLOW.get_or_init(|| (Instant::now(), speed));
}

/// Returns the present time.
#[must_use]
pub fn now() -> Instant {
    SIMULATED.get().unwrap_or_else(|| match SLOW.get() {
        None => Instant::now(),
        Some((start, speed)) => *start + start.elapsed().mul_f64(*speed),
    })
}

/// Returns the time since `moment`.
#[must_use]
pub fn elapsed_since(moment: Instant) -> Duration {
    now().saturating_duration_since(moment)
}

/// Sleeps until `moment`; returns at once if it has passed.
pub fn sleep_until(moment: Instant) {
    sleep(moment.saturating_duration_since(now()));
}

/// Sleeps.
pub fn sleep(time: Duration) {
    match SIMULATED.get() {
        Some(now) => SIMULATED.set(Some(now + time)),
        None => thread::sleep(SLOW.get().map_or(time, |(_, speed)| time.div_f64(*speed))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn simulated_time_passes_only_while_its_thread_sleeps() {
        let _time = freeze_time();
        let start = now();
        thread::sleep(Duration::from_millis(1));
        assert_eq!(now(), start);
        sleep(Duration::from_secs(3600));
        assert_eq!(elapsed_since(start), Duration::from_secs(3600));
        sleep_until(start);
        assert_eq!(elapsed_since(start), Duration::from_secs(3600), "it is over");
    }
}

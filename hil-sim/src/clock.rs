//! The clock of everything that waits: the computer's, the same in slow motion, or one that a test controls.

use std::cell::Cell;
use std::sync::OnceLock;
use std::thread;
use std::time::{Duration, Instant};

/// When slow motion began, and its speed.
static SLOW: OnceLock<(Instant, f64)> = OnceLock::new();

thread_local! {
    static SIMULATED: Cell<Option<Instant>> = const { Cell::new(None) };
}

/// While it lives, time passes for its thread only while the thread sleeps.
#[derive(Debug)]
pub struct Simulated(());

/// Stops the time of this thread, for a test.
#[must_use]
pub fn simulate() -> Simulated {
    SIMULATED.set(Some(Instant::now()));
    Simulated(())
}

impl Drop for Simulated {
    fn drop(&mut self) {
        SIMULATED.set(None);
    }
}

/// Lets the program's time pass at another speed from now on, such as 0.1 for slow motion. Only the first call counts.
pub fn set_speed(speed: f64) {
    SLOW.get_or_init(|| (Instant::now(), speed));
}

/// The present moment.
#[must_use]
pub fn now() -> Instant {
    SIMULATED.get().unwrap_or_else(|| match SLOW.get() {
        None => Instant::now(),
        Some((start, speed)) => *start + start.elapsed().mul_f64(*speed),
    })
}

/// Time since `moment`.
#[must_use]
pub fn since(moment: Instant) -> Duration {
    now().saturating_duration_since(moment)
}

/// Lets time pass until `moment`; returns at once after it.
pub fn sleep_until(moment: Instant) {
    sleep(moment.saturating_duration_since(now()));
}

/// Lets time pass.
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
        let _time = simulate();
        let start = now();
        thread::sleep(Duration::from_millis(1));
        assert_eq!(now(), start);
        sleep(Duration::from_secs(3600));
        assert_eq!(since(start), Duration::from_secs(3600));
        sleep_until(start);
        assert_eq!(since(start), Duration::from_secs(3600), "it is over");
    }
}

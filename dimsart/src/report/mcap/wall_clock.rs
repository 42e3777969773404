//! Wall-clock time of rows, which aligns recordings of several devices and cameras.

use std::time::{SystemTime, UNIX_EPOCH};

use crate::report::TimeBase;

const NS_PER_S: f64 = 1e9;
/// Maximum relative drift of two clocks: crystals of 50 ppm, with margin.
const DRIFT: f64 = 2e-4;
/// Maximum delay of a line, `s`; a longer delay has another cause, such as a suspended computer.
const MAX_DELAY_S: f64 = 1.0;

/// Estimates the wall-clock time of the first tick.
#[derive(Debug)]
pub(super) struct WallClock {
    base: TimeBase,
    /// Wall-clock time of time 0, `s` since 1970; `None` before the first row in real time.
    zero_s: Option<f64>,
    /// Time of the last row that updated the estimate, `s`.
    told_s: f64,
    /// Last returned time, to stay monotonic.
    last_ns: u64,
}

impl WallClock {
    pub(super) fn new(base: TimeBase) -> Self {
        let zero_s = match base {
            TimeBase::Simulated => Some(now_s()),
            TimeBase::RealTime => None,
        };
        Self { base, zero_s, told_s: 0.0, last_ns: 0 }
    }

    /// Handles the arrival of a row of this time.
    pub(super) fn observe(&mut self, time_s: f64) {
        if self.base == TimeBase::RealTime {
            self.observe_at(time_s, now_s());
        }
    }

    /// Updates the estimate: delays are positive, so the shortest delay counts, within the drift of the clocks.
    fn observe_at(&mut self, time_s: f64, now_s: f64) {
        let found_s = now_s - time_s;
        let latest_s = self.zero_s.map(|zero_s| zero_s + DRIFT * (time_s - self.told_s).max(0.0));
        let is_near = |latest_s: &f64| found_s - latest_s < MAX_DELAY_S;
        self.zero_s = Some(latest_s.filter(is_near).map_or(found_s, |latest_s| latest_s.min(found_s)));
        self.told_s = time_s;
    }

    /// Returns nanoseconds since 1970.
    pub(super) fn log_time(&mut self, time_s: f64) -> u64 {
        // Whole seconds and fraction separately: an f64 is too short for both in nanoseconds.
        let zero_s = self.zero_s.unwrap_or_default();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
        let [zero_ns, time_ns] = [zero_s, time_s].map(|seconds| (seconds * NS_PER_S).round() as u64);
        self.last_ns = self.last_ns.max(zero_ns.saturating_add(time_ns));
        self.last_ns
    }
}

fn now_s() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_s_clock_is_followed_through_delays_and_drift() {
        // A crystal that is 100 ppm slow, blocks of 50 ms that arrive 1 ms to 40 ms late, and a computer suspended for 10 s.
        let mut clock = WallClock::new(TimeBase::RealTime);
        for piece in 1..20_000_u32 {
            let time_s = 0.05 * f64::from(piece);
            let pause_s = if piece >= 15_000 { 10.0 } else { 0.0 };
            let wall_s = 1.7e9 + pause_s + time_s * (1.0 + 1e-4);
            clock.observe_at(time_s, wall_s + 1e-3 * f64::from(1 + piece * 7919 % 40));
            #[expect(clippy::cast_precision_loss, reason = "microseconds matter")]
            let error_s = clock.log_time(time_s) as f64 * 1e-9 - wall_s;
            assert!((0.0..0.05).contains(&error_s), "{error_s} s at {time_s} s");
            // The shortest delay has occurred.
            assert!(!(40..15_000).contains(&piece) || error_s < 3e-3, "{error_s} s at {time_s} s");
        }
    }
}

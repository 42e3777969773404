//! Distinguishes exponential growth of a signal from the signals of a stable loop.
//!
//! Evaluates the fourth difference of a signal from tick to tick: it amplifies oscillation at half the sample rate,
//! where sampled loops become unstable, by 16, and removes the motion of a hand. Its maximum in a window of `W` ticks
//! is compared with the window before. **A signal grows without bound if six consecutive windows are each at least
//! twice as high as the one before, all above a floor.**
//!
//! A mode that grows by `g` per tick raises every window by `g^W`. An impact raises one window and decays in the next
//! ones. Growth with the power `n` of time, such as jumps by lost packets in a motion from rest, raises the `k`-th
//! window by `(1 + 1/k)^n`: for `n = 3`, three windows by 2 or more. In scenarios with various delays, losses, walls,
//! friction and encoders, at most four consecutive windows rose.
//!
//! Windows of 16, 32, ... 4096 ticks are evaluated in parallel: the short windows detect fast growth before the
//! signal leaves its range, the long ones detect slow growth, and growth per round trip of a long delay.

/// Consecutive rising windows that count as growth.
const RISES: u32 = 6;
/// Minimum ratio to the previous window for a rising window.
const RISE: f64 = 2.0;
/// Order of the difference.
const ORDER: usize = 4;
/// Length of the shortest window, ticks; each further length is doubled.
const SHORTEST_TICKS: u32 = 16;
const SHORTEST: usize = SHORTEST_TICKS as usize;
/// Number of window lengths.
const LENGTHS: usize = 9;

/// Observes one signal.
#[derive(Debug, Clone)]
pub struct Growth {
    /// Minimum difference that counts.
    floor: f64,
    /// Values of the shortest window, after the last values of the previous window.
    values: [f64; ORDER + SHORTEST],
    /// Number of values in the shortest window.
    count: usize,
    /// Number of completed shortest windows.
    closed: u32,
    windows: [Window; LENGTHS],
}

/// The windows of one length.
#[derive(Debug, Clone, Copy, Default)]
struct Window {
    /// Height of the present window.
    height: f64,
    /// Height of the previous window.
    previous: f64,
    /// Consecutive rising windows.
    rises: u32,
    /// Height before the first rise.
    from: f64,
}

impl Growth {
    /// Creates an observer that ignores differences below `floor`, in the unit of the signal.
    #[must_use]
    pub fn new(floor: f64) -> Self {
        Self {
            floor,
            values: [0.0; ORDER + SHORTEST],
            count: 0,
            closed: 0,
            windows: [Window::default(); LENGTHS],
        }
    }

    /// Adds the present tick's value. Returns the growth per tick (`1.04`) at the end of a window if growth is
    /// detected.
    #[inline]
    pub fn add(&mut self, value: f64) -> Option<f64> {
        if let Some(free) = self.values.get_mut(ORDER + self.count) {
            *free = value;
        }
        self.count += 1;
        if self.count < SHORTEST { None } else { self.close() }
    }

    /// Completes the shortest window, and possibly longer windows.
    #[inline(never)]
    fn close(&mut self) -> Option<f64> {
        let mut height = self.height();
        self.values.copy_within(SHORTEST.., 0);
        self.count = 0;
        self.closed = self.closed.wrapping_add(1);
        let mut length = 1;
        let mut growth = None;
        for window in &mut self.windows {
            window.height = window.height.max(height);
            if !self.closed.is_multiple_of(length) {
                break;
            }
            height = window.height;
            growth = growth.or(window.close(self.floor, length * SHORTEST_TICKS));
            length *= 2;
        }
        growth
    }

    /// Returns the maximum difference in the completed shortest window.
    fn height(&self) -> f64 {
        let mut differences = self.values;
        for _ in 0..ORDER {
            let lower = differences;
            let [_, rest @ ..] = &mut differences;
            for (difference, before) in rest.iter_mut().zip(&lower) {
                *difference -= before;
            }
        }
        differences.iter().skip(ORDER).fold(0.0, |height, difference| height.max(difference.abs()))
    }
}

impl Window {
    /// Compares the completed window with the previous one.
    fn close(&mut self, floor: f64, ticks: u32) -> Option<f64> {
        let (previous, height) = (self.previous, self.height);
        if previous < floor || height < RISE * previous {
            self.rises = 0;
        } else {
            if self.rises == 0 {
                self.from = previous;
            }
            self.rises += 1;
        }
        (self.previous, self.height) = (height, 0.0);
        let per_tick = || libm::pow(height / self.from, 1.0 / (f64::from(self.rises) * f64::from(ticks)));
        (self.rises >= RISES).then(per_tick)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Growth per tick of a signal, and the tick of its detection.
    fn seen(ticks: u32, signal: impl Fn(f64) -> f64) -> Option<(f64, u32)> {
        let mut growth = Growth::new(1e-6);
        (0..ticks).find_map(|tick| Some((growth.add(signal(f64::from(tick)))?, tick)))
    }

    #[test]
    fn exponential_growth_is_seen_with_its_rate() {
        for rate in [1.0005, 1.002, 1.01, 1.04, 1.1] {
            for period_ticks in [2.0, 3.3, 10.0] {
                let oscillation = |t: f64| libm::cos(std::f64::consts::TAU * t / period_ticks);
                let found = seen(50_000, |t| 1e-5 * libm::pow(rate, t) * oscillation(t));
                let (found, tick) = found.unwrap_or_else(|| panic!("{rate} is not seen"));
                assert!((found - rate).abs() < 0.05 * (rate - 1.0), "{found} instead of {rate}");
                // Each rise takes at most twice the doubling time of the signal, and at least 16 ticks.
                let doubles_ticks = libm::log(2.0) / libm::log(rate);
                assert!(
                    f64::from(tick) < 8.0 * (2.0 * doubles_ticks).max(16.0) + 16.0,
                    "{rate}: {tick} ticks"
                );
            }
        }
    }

    #[test]
    fn growth_from_one_round_trip_to_the_next_is_seen() {
        // A three-tick pulse that repeats after 700 ticks with 1.5 times the height.
        let echo = |t: f64| if t % 700.0 < 3.0 { 1e-3 * libm::pow(1.5, libm::floor(t / 700.0)) } else { 0.0 };
        assert!(seen(50_000, echo).is_some());
    }

    #[test]
    fn nothing_that_stays_bounded_is_taken_for_growth() {
        let sine = |t: f64| libm::sin(0.3 * t);
        let decays = |t: f64, rate: f64| libm::pow(rate, t);
        assert_eq!(seen(50_000, |t| 1e-3 * t * t * t), None, "a power of time");
        assert_eq!(
            seen(50_000, |t| 1e-6 * t * t * sine(t)),
            None,
            "an oscillation that grows with a power of time"
        );
        assert_eq!(seen(50_000, |t| f64::from(u8::from(t > 5000.0))), None, "a step");
        assert_eq!(
            seen(50_000, |t| if t < 5000.0 { 0.0 } else { sine(t) * decays(t - 5000.0, 0.999) }),
            None,
            "ringing"
        );
        assert_eq!(seen(50_000, |t| sine(t) * libm::sin(1e-3 * t)), None, "a beat");
        assert_eq!(
            seen(50_000, |t| 1e-8 * libm::pow(1.01, t.min(500.0)) * sine(t)),
            None,
            "growth below the floor"
        );
        assert_eq!(
            seen(50_000, |t| sine(t) * (1.0 - decays(t, 0.99))),
            None,
            "an oscillation that comes to its height"
        );
    }
}

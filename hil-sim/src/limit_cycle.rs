//! Finds what goes on swinging when nothing moves it: chatter, limit cycles.
//!
//! Looked at is the second half of the time since the last thing happened, in two quarters. **It swings when it turns
//! back six times or more, and its last quarter is at least nine tenths as wide as the one before.** What dies out is
//! narrower by then, what creeps does not turn back, what rests is narrower than the floor.

use serde::Serialize;

/// Turns below which a frequency is a guess.
const LEAST_TURNS: u32 = 6;
/// Width of the last quarter over that of the one before, from which on nothing dies out.
const LASTING: f64 = 0.9;
/// Width, as a share of the largest motion, below which it is the controller's rounding.
const FLOOR: f64 = 1e-6;

/// One that was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LimitCycle {
    /// The device.
    pub device: String,
    /// The axis, from 0.
    pub axis: usize,
    /// How often a second.
    pub hz: f64,
    /// Half of how far it swings, in the unit of the axis.
    pub amplitude: f64,
}

/// Watches the position of one axis.
#[derive(Debug, Clone)]
pub struct Swing {
    /// Where the two quarters begin, and where the last one ends, `s`.
    quarters_s: [f64; 3],
    quarters: [Width; 2],
    whole: Width,
    turns: u32,
    last_position: f64,
    was_forward: Option<bool>,
}

/// How far something went.
#[derive(Debug, Clone, Copy)]
struct Width {
    least: f64,
    most: f64,
}

impl Swing {
    /// From the last thing that happens, `quiet_s`, to the end of the run, `end_s`.
    #[must_use]
    pub fn new(quiet_s: f64, end_s: f64) -> Self {
        let at = |share: f64| quiet_s + share * (end_s - quiet_s);
        Self {
            quarters_s: [at(0.5), at(0.75), end_s],
            quarters: [Width::NONE; 2],
            whole: Width::NONE,
            turns: 0,
            last_position: f64::NAN,
            was_forward: None,
        }
    }

    /// Adds the position at a time.
    pub fn add(&mut self, time_s: f64, position: f64) {
        self.whole.add(position);
        let [first_s, second_s, _] = self.quarters_s;
        if time_s >= first_s {
            let [first, second] = &mut self.quarters;
            if time_s >= second_s { second } else { first }.add(position);
            let change = position - self.last_position;
            if change.abs() > 0.0 {
                let is_forward = change > 0.0;
                self.turns +=
                    u32::from(self.was_forward.is_some_and(|was_forward| was_forward != is_forward));
                self.was_forward = Some(is_forward);
            }
        }
        self.last_position = position;
    }

    /// Frequency, `Hz`, and amplitude of what goes on swinging, and that as a share of the largest motion; none when
    /// nothing does.
    #[must_use]
    pub fn found(&self) -> Option<(f64, f64, f64)> {
        let [first_s, _, end_s] = self.quarters_s;
        let [before, last] = self.quarters.map(|width| width.length());
        let largest = self.whole.length();
        let is_swinging =
            self.turns >= LEAST_TURNS && last >= LASTING * before && last > FLOOR * largest && before > 0.0;
        let hz = f64::from(self.turns) / (2.0 * (end_s - first_s));
        is_swinging.then(|| (hz, 0.5 * last, 0.5 * last / largest))
    }
}

impl Width {
    const NONE: Self = Self { least: f64::INFINITY, most: f64::NEG_INFINITY };

    fn add(&mut self, value: f64) {
        (self.least, self.most) = (self.least.min(value), self.most.max(value));
    }

    fn length(self) -> f64 {
        (self.most - self.least).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(position: impl Fn(f64) -> f64) -> Option<(f64, f64, f64)> {
        let mut swing = Swing::new(0.5, 2.5);
        for tick in 0..2500 {
            let time_s = f64::from(tick) * 1e-3;
            swing.add(time_s, position(time_s));
        }
        swing.found()
    }

    fn step(time_s: f64) -> f64 {
        1.0 - libm::exp(-20.0 * time_s)
    }

    #[test]
    fn what_goes_on_is_found_with_frequency_and_amplitude() {
        for (hz, amplitude) in [(7.0, 0.1), (31.3, 1e-3), (230.0, 1e-4)] {
            let sine = |t: f64| step(t) + amplitude * libm::sin(std::f64::consts::TAU * hz * t);
            let (found_hz, found_amplitude, _) = found(sine).unwrap();
            assert!((found_hz - hz).abs() < 0.6, "{found_hz} for {hz}");
            assert!((found_amplitude / amplitude - 1.0).abs() < 0.05, "{found_amplitude} for {amplitude}");
        }
    }

    #[test]
    fn what_dies_out_creeps_or_rests_is_none() {
        assert_eq!(found(step), None, "comes to rest");
        assert_eq!(found(|t| step(t) + 1e-3 * t), None, "creeps");
        let ringing = |t: f64| step(t) + 0.1 * libm::exp(-1.0 * t) * libm::sin(60.0 * t);
        assert_eq!(found(ringing), None, "rings, and dies out");
        let rounding = |t: f64| step(t) + 1e-8 * libm::sin(300.0 * t);
        assert_eq!(found(rounding), None, "a controller's rounding");
    }
}

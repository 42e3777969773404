//! Detects sustained oscillation at rest: chatter, hunting, limit cycles.
//!
//! Each rest phase is observed in quarters. **An axis oscillates if the last quarter is at least 0.9 times as wide as
//! the one before and its motion recurs:** at this width, its maxima and minima return at regular intervals and to
//! the same positions, over the last two quarters or, for slow oscillations, the last three. Turning points have a
//! hysteresis of a share of the width, which ignores ringing at each stick phase of a hunting joint. A decaying
//! oscillation is narrower in its last quarter, creep has no turning points, noise and lost packets have irregular
//! ones.
//!
//! An oscillation is chatter if it is wider than 1 % of the total motion, or makes and breaks contact. A motion of
//! this width is undecided if its rest phase is shorter than three periods.

use std::collections::BTreeMap;
use std::ops::{ControlFlow, Range};

use dimsart_core::Unit;
use serde::Serialize;

use super::Observer;
use crate::outcome::Outcome;
use crate::rig::{Rig, Station};

/// Minimum number of periods for a frequency.
const MIN_PERIODS: u32 = 3;
/// Minimum number of contact changes for an oscillation in contact.
const MIN_TOUCHES: u32 = 6;
/// Maximum relative standard deviation of the periods; 0.2 for a period of 2.5 ticks.
const EVEN: f64 = 0.35;
/// Maximum standard deviation of the turning points, as a share of the width.
const RECURRING: f64 = 0.2;
/// Maximum hysteresis of a turning point, as a share of the width; the minimum is half of it.
const HYSTERESIS: f64 = 0.3;
/// Number of hysteresis scales, each half of the previous one.
const SCALES: i32 = 21;
/// Minimum width ratio of the last two quarters for sustained oscillation.
const LASTING: f64 = 0.9;
/// Width, as a share of the largest motion, below which oscillation is rounding of the controller.
const FLOOR: f64 = 1e-6;
/// Width, as a share of the largest motion, above which a run is unstable.
const CHATTER: f64 = 0.01;

/// A limit cycle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LimitCycle {
    /// The device.
    pub device: String,
    /// The axis, from 0.
    pub axis: usize,
    /// Frequency, `Hz`.
    pub hz: f64,
    /// Amplitude, in the unit of the axis.
    pub amplitude: f64,
    /// Whether it makes the run unstable.
    #[serde(skip)]
    pub is_chatter: bool,
}

/// Observes every axis of a rig.
#[derive(Debug)]
pub struct LimitCycleObserver {
    axes: Vec<(usize, usize, AxisObserver)>,
}

impl LimitCycleObserver {
    /// Creates an observer; `rests_s` returns the rest phases of a station by its index, `s`.
    #[must_use]
    pub fn new(rig: &Rig, rests_s: impl Fn(usize) -> Vec<Range<f64>>) -> Self {
        let of_axis = |station, axis| {
            rests_s(station).into_iter().map(move |rest_s| (station, axis, AxisObserver::new(rest_s)))
        };
        let of_station = |(station, there): (usize, &Station)| {
            (0..there.plant.dof()).flat_map(move |axis| of_axis(station, axis))
        };
        Self { axes: rig.stations().iter().enumerate().flat_map(of_station).collect() }
    }

    /// Returns the widest sustained oscillation of each axis; adds chatter to `faults` and undecided oscillations to
    /// `undecided`.
    fn found(&self, rig: &Rig, faults: &mut Vec<String>, undecided: &mut Vec<String>) -> Vec<LimitCycle> {
        let mut widest = BTreeMap::new();
        for (station, axis, swing) in &self.axes {
            let found = swing.motion();
            let width = match found {
                Motion::None => continue,
                Motion::Oscillation { amplitude, .. } | Motion::Undecided { amplitude, .. } => amplitude,
            };
            let known = widest.entry((station, axis)).or_insert((width, found, swing.touches));
            if width > known.0 {
                *known = (width, found, swing.touches);
            }
        }
        let mut cycles = Vec::new();
        for ((station, axis), (_, found, touches)) in widest {
            let Some(station) = rig.stations().get(*station) else { continue };
            let kind = station.dimsart.engine().device().axes().get(*axis).copied().unwrap_or_default();
            let (name, unit) = (&station.name, Unit::Position.symbol(kind));
            match found {
                Motion::None => {}
                Motion::Oscillation { hz, amplitude, is_chatter } => {
                    if is_chatter {
                        let touch = if touches > 0 { ", making and breaking contact" } else { "" };
                        faults.push(format!(
                            "axis {axis} of {name} oscillates by ±{amplitude:.3e} {unit} at {hz:.1} Hz at \
                            rest{touch}: a limit cycle"
                        ));
                    }
                    cycles.push(LimitCycle { device: name.clone(), axis: *axis, hz, amplitude, is_chatter });
                }
                Motion::Undecided { amplitude, until_s } => undecided.push(format!(
                    "undecided: axis {axis} of {name} still moves by ±{amplitude:.3e} {unit} at rest, maybe a \
                    limit cycle; set duration_s to {:.0} s or more",
                    libm::ceil(until_s)
                )),
            }
        }
        cycles
    }
}

impl Observer for LimitCycleObserver {
    fn observe(&mut self, rig: &Rig) -> ControlFlow<()> {
        let time_s = rig.time_s();
        for (station, axis, swing) in &mut self.axes {
            let Some(station) = rig.stations().get(*station) else { continue };
            let plant = &station.plant;
            swing.add(time_s, plant.position(*axis), || plant.is_touching(*axis));
        }
        ControlFlow::Continue(())
    }

    fn report(&mut self, rig: &Rig, outcome: &mut Outcome) {
        // An aborted run gives no result.
        if outcome.is_complete {
            outcome.limit_cycles = self.found(rig, &mut outcome.faults, &mut outcome.undecided);
            outcome.stable &= !outcome.limit_cycles.iter().any(|cycle| cycle.is_chatter);
        }
    }
}

/// Observes the position of one axis.
#[derive(Debug, Clone)]
pub struct AxisObserver {
    rest_s: Range<f64>,
    /// The last two quarters.
    quarters: [Width; 2],
    whole: Width,
    /// Over the last two and three quarters, by scale.
    zigzags: [Vec<Zigzag>; 2],
    was_touching: Option<bool>,
    /// Number of contact changes.
    touches: u32,
}

/// Kind of motion at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion {
    /// Decay, creep or noise.
    None,
    /// Sustained oscillation.
    Oscillation {
        /// Frequency, `Hz`.
        hz: f64,
        /// Amplitude.
        amplitude: f64,
        /// Whether it makes the run unstable.
        is_chatter: bool,
    },
    /// The rest phase is too short.
    Undecided {
        /// Amplitude.
        amplitude: f64,
        /// Required end of the rest phase, `s`.
        until_s: f64,
    },
}

/// Turning points at one scale.
#[derive(Debug, Clone)]
struct Zigzag {
    hysteresis: f64,
    /// Extremum since the last turning point, and its time, `s`.
    extreme: f64,
    extreme_s: f64,
    is_forward: Option<bool>,
    /// Minima and maxima.
    turns: [Turns; 2],
}

/// Turning points of one kind.
#[derive(Debug, Clone, Copy, Default)]
struct Turns {
    last_s: Option<f64>,
    periods_s: Spread,
    positions: Spread,
}

/// Mean and deviation.
#[derive(Debug, Clone, Copy, Default)]
struct Spread {
    count: u32,
    mean: f64,
    squares: f64,
}

/// Range of a motion.
#[derive(Debug, Clone, Copy)]
struct Width {
    least: f64,
    most: f64,
}

impl AxisObserver {
    /// Creates an observer for a rest phase, `s`.
    #[must_use]
    pub fn new(rest_s: Range<f64>) -> Self {
        Self {
            rest_s,
            quarters: [Width::NONE; 2],
            whole: Width::NONE,
            zigzags: [Vec::new(), Vec::new()],
            was_touching: None,
            touches: 0,
        }
    }

    /// Adds the position at a time; `is_touching` returns whether the axis is in contact.
    pub fn add(&mut self, time_s: f64, position: f64, is_touching: impl FnOnce() -> bool) {
        self.whole.add(position);
        let quarter = 4.0 * (time_s - self.rest_s.start) / self.length_s();
        let width = self.whole.length();
        for (zigzags, from) in self.zigzags.iter_mut().zip([2.0, 1.0]) {
            if !(from..=4.0).contains(&quarter) {
                continue;
            }
            if zigzags.is_empty() {
                let zigzag = |halvings: i32| Zigzag::new(libm::ldexp(width, -halvings), time_s, position);
                *zigzags = (1..=SCALES).map(zigzag).collect();
            }
            zigzags.iter_mut().for_each(|zigzag| zigzag.add(time_s, position));
        }
        if !(2.0..=4.0).contains(&quarter) {
            return;
        }
        let is_touching = is_touching();
        let was_touching = self.was_touching.replace(is_touching);
        self.touches += u32::from(was_touching.is_some_and(|was_touching| was_touching != is_touching));
        let [first, second] = &mut self.quarters;
        if quarter >= 3.0 { second } else { first }.add(position);
    }

    fn length_s(&self) -> f64 {
        self.rest_s.end - self.rest_s.start
    }

    /// Returns the motion at the end.
    #[must_use]
    pub fn motion(&self) -> Motion {
        let [before, last] = self.quarters.map(|width| width.length());
        let largest = self.whole.length();
        let lasts = last >= LASTING * before && last > FLOOR * largest && before > 0.0;
        if !lasts {
            return Motion::None;
        }
        let at_scale = |zigzag: &&Zigzag| zigzag.hysteresis <= HYSTERESIS * last;
        let [short, long] = self.zigzags.each_ref().map(|zigzags| zigzags.iter().find(at_scale));
        let is_wide = 0.5 * last > CHATTER * largest;
        let amplitude = 0.5 * last;
        if let Some(period_s) = [short, long].into_iter().flatten().find_map(|zigzag| zigzag.period_s(last)) {
            let is_chatter = is_wide || self.touches >= MIN_TOUCHES;
            return Motion::Oscillation { hz: 1.0 / period_s, amplitude, is_chatter };
        }
        let Some(long) = long else { return Motion::None };
        let turns = long.turns.iter().map(|turns| turns.positions.count).sum::<u32>();
        let are_enough = long.turns.iter().any(|turns| turns.periods_s.count >= MIN_PERIODS);
        if !is_wide || turns == 0 || are_enough {
            return Motion::None;
        }
        // Half a period between turning points, in three quarters.
        let period_s = 2.0 * 0.75 * self.length_s() / f64::from(turns);
        let needed_s = f64::from(MIN_PERIODS + 2) * period_s / 0.75;
        Motion::Undecided { amplitude, until_s: self.rest_s.start + needed_s }
    }
}

impl Zigzag {
    fn new(hysteresis: f64, time_s: f64, position: f64) -> Self {
        Self {
            hysteresis,
            extreme: position,
            extreme_s: time_s,
            is_forward: None,
            turns: [Turns::default(); 2],
        }
    }

    fn add(&mut self, time_s: f64, position: f64) {
        let away = position - self.extreme;
        let is_further = match self.is_forward {
            Some(true) => away > 0.0,
            Some(false) => away < 0.0,
            None => false,
        };
        if is_further {
            (self.extreme, self.extreme_s) = (position, time_s);
        } else if away.abs() > self.hysteresis {
            if let Some(was_forward) = self.is_forward {
                let [minima, maxima] = &mut self.turns;
                let turns = if was_forward { maxima } else { minima };
                turns.add(self.extreme_s, self.extreme);
            }
            self.is_forward = Some(away > 0.0);
            (self.extreme, self.extreme_s) = (position, time_s);
        }
    }

    /// Returns the mean period, `s`, of a motion of this width, if it recurs.
    fn period_s(&self, width: f64) -> Option<f64> {
        let recurs = |turns: &Turns| {
            turns.periods_s.count >= MIN_PERIODS
                && turns.periods_s.deviation() <= EVEN * turns.periods_s.mean
                && turns.positions.deviation() <= RECURRING * width
        };
        let [minima, maxima] = &self.turns;
        (recurs(minima) && recurs(maxima)).then_some(0.5 * (minima.periods_s.mean + maxima.periods_s.mean))
    }
}

impl Turns {
    fn add(&mut self, time_s: f64, position: f64) {
        self.positions.add(position);
        if let Some(before_s) = self.last_s.replace(time_s) {
            self.periods_s.add(time_s - before_s);
        }
    }
}

impl Spread {
    fn add(&mut self, value: f64) {
        self.count += 1;
        let away = value - self.mean;
        self.mean += away / f64::from(self.count);
        self.squares += away * (value - self.mean);
    }

    fn deviation(&self) -> f64 {
        libm::sqrt(self.squares / f64::from(self.count.max(1)))
    }
}

impl Width {
    const NONE: Self = Self { least: f64::INFINITY, most: f64::NEG_INFINITY };

    fn add(&mut self, value: f64) {
        if value < self.least {
            self.least = value;
        }
        if value > self.most {
            self.most = value;
        }
    }

    fn length(self) -> f64 {
        (self.most - self.least).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motion(position: impl Fn(f64) -> f64) -> Motion {
        let mut swing = AxisObserver::new(0.5..2.5);
        for tick in 0..2500 {
            let time_s = f64::from(tick) * 1e-3;
            swing.add(time_s, position(time_s), || true);
        }
        swing.motion()
    }

    fn found(position: impl Fn(f64) -> f64) -> Option<(f64, f64, bool)> {
        match motion(position) {
            Motion::Oscillation { hz, amplitude, is_chatter } => Some((hz, amplitude, is_chatter)),
            Motion::None | Motion::Undecided { .. } => None,
        }
    }

    /// A joint that sticks at both ends of each cycle, with ringing.
    fn hunting(time_s: f64, period_s: f64) -> f64 {
        let share = (time_s / period_s).rem_euclid(1.0);
        let stuck = if share < 0.6 { 0.05 } else { -0.05 };
        let since_s = if share < 0.6 { share } else { share - 0.6 } * period_s;
        stuck + 0.004 * libm::exp(-since_s / 0.1) * libm::sin(200.0 * since_s)
    }

    #[test]
    fn ringing_in_each_stick_phase_does_not_hide_that_a_joint_hunts() {
        let (hz, amplitude, is_chatter) = found(|t| step(t) + hunting(t, 0.2)).unwrap();
        assert!(
            (hz - 5.0).abs() < 0.1 && (amplitude / 0.05 - 1.0).abs() < 0.1 && is_chatter,
            "{hz} {amplitude}"
        );
    }

    #[test]
    fn a_rest_too_short_for_three_periods_is_undecided_and_a_longer_one_is_not() {
        let Motion::Undecided { until_s, .. } = motion(|t| step(t) + hunting(t, 0.9)) else {
            panic!("{:?}", motion(|t| step(t) + hunting(t, 0.9)))
        };
        assert!((3.0..20.0).contains(&until_s), "{until_s}");
        let mut swing = AxisObserver::new(0.5..until_s);
        for tick in 0..100_000 {
            let time_s = f64::from(tick) * 1e-3;
            swing.add(time_s, step(time_s) + hunting(time_s, 0.9), || false);
        }
        assert!(
            matches!(swing.motion(), Motion::Oscillation { is_chatter: true, .. }),
            "{:?}",
            swing.motion()
        );
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
        let ringing = |t: f64| step(t) + 0.1 * libm::exp(-t) * libm::sin(60.0 * t);
        assert_eq!(found(ringing), None, "rings, and dies out");
        let mut random = crate::bus::Random::new(3);
        let mut noise: Vec<f64> = (0..2500).map(|_| random.normal()).collect();
        // Slow motion of a hand by lost packets, which resembles an oscillation.
        for tick in 1..noise.len() {
            noise[tick] = 0.98 * noise[tick - 1] + 0.02 * noise[tick];
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a tick")]
        let wander = |t: f64| step(t) + noise[(t * 1e3).round() as usize];
        assert_eq!(found(wander), None, "is pushed around");
        let rounding = |t: f64| step(t) + 1e-8 * libm::sin(300.0 * t);
        assert_eq!(found(rounding), None, "a controller's rounding");
    }
}

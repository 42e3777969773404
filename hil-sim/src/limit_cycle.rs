//! Finds what goes on swinging when nothing moves it: chatter, limit cycles.
//!
//! Looked at is the second half of each stretch in which nothing happens, in two quarters. **It swings when it turns
//! back six times or more, evenly, and its last quarter is at least nine tenths as wide as the one before.** What dies out is
//! narrower by then, what creeps does not turn back, what noise or lost packets push around turns back at any time, what
//! rests is narrower than the floor.
//!
//! It is chatter when it is wider than a hundredth of all the motion there was, or leaves what it touches and comes back.

use std::collections::BTreeMap;
use std::ops::Range;

use dimsart_core::Unit;
use serde::Serialize;

use crate::rig::{Rig, Station};

/// Turns below which a frequency is a guess.
const LEAST_TURNS: u32 = 6;
/// Standard deviation of the times between two turns over their mean, up to which they are even: of a swing of two ticks
/// and a half it is 0.2.
const EVEN: f64 = 0.4;
/// Width of the last quarter over that of the one before, from which on nothing dies out.
const LASTING: f64 = 0.9;
/// Width, as a share of the largest motion, below which it is the controller's rounding.
const FLOOR: f64 = 1e-6;
/// The same, from which on it is no stable run.
const CHATTER: f64 = 0.01;

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
    /// Whether a run with it is not stable.
    #[serde(skip)]
    pub is_chatter: bool,
}

/// Watches every axis of a rig.
#[derive(Debug)]
pub struct Swings {
    axes: Vec<(usize, usize, Swing)>,
}

impl Swings {
    /// In the stretches in which nothing moves a station, `s`, by its place.
    #[must_use]
    pub fn new(rig: &Rig, rests_s: impl Fn(usize) -> Vec<Range<f64>>) -> Self {
        let of_axis = |station, axis| {
            rests_s(station).into_iter().map(move |rest_s| (station, axis, Swing::new(rest_s)))
        };
        let of_station = |(station, there): (usize, &Station)| {
            (0..there.plant.dof()).flat_map(move |axis| of_axis(station, axis))
        };
        Self { axes: rig.stations().iter().enumerate().flat_map(of_station).collect() }
    }

    /// Adds the present tick.
    pub fn add(&mut self, rig: &Rig) {
        let time_s = rig.time_s();
        for (station, axis, swing) in &mut self.axes {
            let Some(station) = rig.stations().get(*station) else { continue };
            let plant = &station.plant;
            swing.add(time_s, plant.position(*axis), || plant.is_touching(*axis));
        }
    }

    /// What goes on swinging, by axis, as in the rest in which it swings widest; says of chatter what it is.
    #[must_use]
    pub fn found(&self, rig: &Rig, faults: &mut Vec<String>) -> Vec<LimitCycle> {
        let mut widest = BTreeMap::new();
        for (station, axis, swing) in &self.axes {
            let Some(this) = swing.found().map(|found| (found, swing)) else { continue };
            let ((_, amplitude, _), _) = this;
            let known = widest.entry((station, axis)).or_insert(this);
            if amplitude > known.0.1 {
                *known = this;
            }
        }
        let mut found = Vec::new();
        for ((station, axis), ((hz, amplitude, is_chatter), swing)) in widest {
            let Some(station) = rig.stations().get(*station) else { continue };
            if is_chatter {
                let kind = station.dimsart.engine().device().axes().get(*axis).copied().unwrap_or_default();
                let (name, unit) = (&station.name, Unit::Position.symbol(kind));
                let touch = if swing.touches > 0 { ", on and off what it touches," } else { "" };
                faults.push(format!(
                    "axis {axis} of the {name} goes on swinging{touch} by ±{amplitude:.3e} {unit} at {hz:.1} Hz when \
                     nothing moves it"
                ));
            }
            found.push(LimitCycle { device: station.name.clone(), axis: *axis, hz, amplitude, is_chatter });
        }
        found
    }
}

/// Watches the position of one axis.
#[derive(Debug, Clone)]
pub struct Swing {
    /// Where the two quarters begin, and where the last one ends, `s`.
    quarters_s: [f64; 3],
    quarters: [Width; 2],
    whole: Width,
    /// Times from turn to turn: how many, their sum and the sum of their squares.
    turns: u32,
    between_s: f64,
    between_squares: f64,
    last_turn_s: Option<f64>,
    last_position: f64,
    was_forward: Option<bool>,
    was_touching: Option<bool>,
    /// How often it touched something, or let it go.
    touches: u32,
}

/// How far something went.
#[derive(Debug, Clone, Copy)]
struct Width {
    least: f64,
    most: f64,
}

impl Swing {
    /// In a stretch in which nothing happens, `s`.
    #[must_use]
    pub fn new(rest_s: Range<f64>) -> Self {
        let at = |share: f64| rest_s.start + share * (rest_s.end - rest_s.start);
        Self {
            quarters_s: [at(0.5), at(0.75), at(1.0)],
            quarters: [Width::NONE; 2],
            whole: Width::NONE,
            turns: 0,
            between_s: 0.0,
            between_squares: 0.0,
            last_turn_s: None,
            last_position: f64::NAN,
            was_forward: None,
            was_touching: None,
            touches: 0,
        }
    }

    /// Adds the position at a time; `is_touching` says whether something is touched then, where that is asked.
    pub fn add(&mut self, time_s: f64, position: f64, is_touching: impl FnOnce() -> bool) {
        let [first_s, second_s, end_s] = self.quarters_s;
        self.whole.add(position);
        if time_s > end_s {
            return;
        }
        if time_s >= first_s {
            let is_touching = is_touching();
            let was_touching = self.was_touching.replace(is_touching);
            self.touches += u32::from(was_touching.is_some_and(|was_touching| was_touching != is_touching));
            let [first, second] = &mut self.quarters;
            if time_s >= second_s { second } else { first }.add(position);
            let change = position - self.last_position;
            if change.abs() > 0.0 {
                let is_forward = change > 0.0;
                if self.was_forward.is_some_and(|was_forward| was_forward != is_forward) {
                    self.turn(time_s);
                }
                self.was_forward = Some(is_forward);
            }
        }
        self.last_position = position;
    }

    fn turn(&mut self, time_s: f64) {
        if let Some(before_s) = self.last_turn_s.replace(time_s) {
            self.turns += 1;
            self.between_s += time_s - before_s;
            self.between_squares += (time_s - before_s) * (time_s - before_s);
        }
    }

    /// Mean of the times between two turns, `s`, if they are even.
    fn half_period_s(&self) -> Option<f64> {
        let turns = f64::from(self.turns);
        let mean_s = self.between_s / turns;
        let variance = self.between_squares / turns - mean_s * mean_s;
        (self.turns >= LEAST_TURNS && variance <= EVEN * EVEN * mean_s * mean_s).then_some(mean_s)
    }

    /// Frequency, `Hz`, and amplitude of what goes on swinging, and whether it is chatter; none when nothing does.
    #[must_use]
    pub fn found(&self) -> Option<(f64, f64, bool)> {
        let [before, last] = self.quarters.map(|width| width.length());
        let largest = self.whole.length();
        let half_period_s = self.half_period_s()?;
        let lasts = last >= LASTING * before && last > FLOOR * largest && before > 0.0;
        let is_chatter = 0.5 * last > CHATTER * largest || self.touches >= LEAST_TURNS;
        lasts.then_some((0.5 / half_period_s, 0.5 * last, is_chatter))
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

    fn found(position: impl Fn(f64) -> f64) -> Option<(f64, f64, bool)> {
        let mut swing = Swing::new(0.5..2.5);
        for tick in 0..2500 {
            let time_s = f64::from(tick) * 1e-3;
            swing.add(time_s, position(time_s), || true);
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
        let ringing = |t: f64| step(t) + 0.1 * libm::exp(-t) * libm::sin(60.0 * t);
        assert_eq!(found(ringing), None, "rings, and dies out");
        let mut random = crate::bus::Random::new(3);
        let mut noise: Vec<f64> = (0..2500).map(|_| random.normal()).collect();
        // Slow enough to look like a swing: what lost packets make of a hand.
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

//! Stability of a loop by the largest magnitude of its poles.
//!
//! The poles are the zeros of `det(1 - A/z) det(1 - P K)`, with the plants' state matrix `A`. The number outside a
//! circle is the winding number of this determinant along the circle (argument principle; Åström and Murray, Feedback
//! Systems, section 10.2).

use std::f64::consts::PI;

use nalgebra::DMatrix;

use super::closed_loop::{At, Loop, ONE, Point};
use super::controller_model::Answer;
use crate::loop_figures::UNDECIDED;

/// Growth per tick below which disturbances decay fast.
const GONE: f64 = 0.9977;
/// The logarithm of this growth over the longest answer; smaller values are below rounding.
const ROUNDING_TICKS: f64 = 5.0;
/// Resolution of a growth.
const GROWTH_WITHIN: f64 = 1e-6;
/// Minimum and maximum distance from 1 of a pole that counts as a constant offset; multiple poles are less accurate.
const MIN_DRIFT: f64 = 5e-6;
const MAX_DRIFT: f64 = 1e-3;
/// Rounding of the controllers, and its maximum share of the characteristic for separable poles.
const ROUNDING: f64 = 1e-6;
const SURE: f64 = 0.3;
/// Number of points on half a circle around 1, minus one.
const STEPS_AROUND: u32 = 24;
/// Maximum growth per tick.
const MAX_GROWTH: f64 = 1e6;
const TURN_HALVINGS: u32 = 40;
/// Newton's method: maximum steps, difference for the slope, and final step.
const NEWTON_STEPS: usize = 30;
const NEWTON_DIFFERENCE: f64 = 1e-6;
const NEWTON_WITHIN: f64 = 1e-10;
/// Maximum rotation between two points, rad, and tolerance of its two halves.
const TURN_RAD: f64 = 0.8;
const TURN_OFF_RAD: f64 = 0.2;

impl Loop {
    /// Function that winds around zero once for every pole outside a circle.
    fn characteristic(&self, z: Point, rounding: f64) -> Point {
        self.at_rounded(z, rounding).characteristic()
    }

    /// Distance from 1 above which poles are distinguishable from those of drifts.
    fn drift(&self) -> f64 {
        let mut drift = MIN_DRIFT;
        while drift < MAX_DRIFT && !around(drift).all(|z| self.is_sure(z)) {
            drift *= 2.0;
        }
        drift
    }

    fn is_sure(&self, z: Point) -> bool {
        let exact = self.characteristic(z, 0.0);
        let off = [ROUNDING, -ROUNDING].map(|rounding| (self.characteristic(z, rounding) - exact).norm());
        off.iter().all(|off| *off <= SURE * exact.norm())
    }

    /// Whether a pole is outside a circle, except those of drifts.
    fn has_pole_beyond(&self, radius: f64, drift: f64, angles: &[f64]) -> bool {
        let circle = self.circle(radius);
        let beyond = -half_turns(&|angle| circle.at(angle).characteristic(), angles);
        let drifting = if radius < 1.0 {
            let around: Vec<f64> =
                (0..=STEPS_AROUND).map(|n| PI * f64::from(n) / f64::from(STEPS_AROUND)).collect();
            half_turns(&|angle| self.characteristic(ONE + Point::from_polar(drift, angle), 0.0), &around)
        } else {
            0.0
        };
        beyond - drifting > 0.5
    }

    /// Returns the largest magnitude of a pole; 1 if undecided, `None` if all disturbances decay fast.
    pub(super) fn growth_per_tick(&self) -> Option<f64> {
        let (angles, drift) = (self.angles(), self.drift());
        let has_pole_beyond = |radius: f64| self.has_pole_beyond(radius, drift, &angles);
        let undecided = UNDECIDED.max(2.0 * drift);
        let (mut from, mut to) = (1.0 + undecided, 1.0 - undecided);
        if has_pole_beyond(from) {
            to = from;
            while to < MAX_GROWTH && has_pole_beyond(to) {
                from = to;
                to = 1.0 + 10.0 * (to - 1.0);
            }
        } else {
            if has_pole_beyond(to) {
                return Some(1.0);
            }
            let answers = self.columns.iter().flat_map(|column| column.answers.iter().flatten());
            let ticks = answers.map(Answer::ticks).max().and_then(|ticks| u32::try_from(ticks).ok());
            from = GONE.max(1.0 - ROUNDING_TICKS / f64::from(ticks.unwrap_or_default().max(1)));
            if !has_pole_beyond(from) {
                return None;
            }
        }
        // A pole of Newton's method is the largest if two circles around it confirm it.
        if let Some(size) = self.pole_near(0.5 * (from + to), &angles).map(|pole| pole.norm())
            && from < size
            && size < to
        {
            let away = 0.4 * GROWTH_WITHIN * size;
            if !has_pole_beyond(size + away) {
                to = size + away;
                if has_pole_beyond(size - away) {
                    from = size - away;
                }
            }
        }
        while to - from > GROWTH_WITHIN * to {
            let middle = 0.5 * (from + to);
            if has_pole_beyond(middle) { from = middle } else { to = middle }
        }
        Some(0.5 * (from + to))
    }
}

impl Loop {
    /// Finds a pole with Newton's method, from the minimum of the characteristic on a circle; `None` without
    /// convergence.
    fn pole_near(&self, radius: f64, angles: &[f64]) -> Option<Point> {
        let value = |z: Point| self.characteristic(z, 0.0);
        let circle = self.circle(radius);
        let sizes = angles.iter().map(|angle| (*angle, circle.at(*angle).characteristic().norm()));
        let (angle, _) = sizes.min_by(|a, b| a.1.total_cmp(&b.1))?;
        let mut pole = self.on_circle(radius, angle);
        for _ in 0..NEWTON_STEPS {
            let slope = (value(pole + NEWTON_DIFFERENCE) - value(pole - NEWTON_DIFFERENCE))
                / (2.0 * NEWTON_DIFFERENCE);
            let step = value(pole) / slope;
            if !step.is_finite() {
                return None;
            }
            pole -= step;
            if step.norm() < NEWTON_WITHIN {
                return Some(pole);
            }
        }
        None
    }
}

impl At {
    fn characteristic(&self) -> Point {
        let open = DMatrix::identity(self.plant.nrows(), self.plant.nrows()) - &self.plant * &self.controller;
        self.determinant * open.determinant()
    }
}

/// Half turns of a value around zero along angles.
fn half_turns(value: &impl Fn(f64) -> Point, angles: &[f64]) -> f64 {
    let points: Vec<(f64, Point)> = angles.iter().map(|angle| (*angle, value(*angle))).collect();
    let turned = |points: &[(f64, Point)]| match *points {
        [from, middle, to] => turned_rad(value, [from, middle, to], TURN_HALVINGS),
        [from, to] => turned_rad(value, [from, between(value, from, to), to], TURN_HALVINGS),
        _ => 0.0,
    };
    // The last of three is the first of the next three.
    (0..points.len())
        .step_by(2)
        .map(|at| turned(points.get(at..points.len().min(at + 3)).unwrap_or_default()))
        .sum::<f64>()
        / PI
}

/// Points on half a circle around 1.
fn around(distance: f64) -> impl Iterator<Item = Point> {
    let angle = |n| PI * f64::from(n) / f64::from(STEPS_AROUND);
    (0..=STEPS_AROUND).map(move |n| ONE + Point::from_polar(distance, angle(n)))
}

/// Rotation around zero along three points, refined until reliable.
fn turned_rad(value: &impl Fn(f64) -> Point, [from, middle, to]: [(f64, Point); 3], halvings: u32) -> f64 {
    let turn = |from: (f64, Point), to: (f64, Point)| (to.1 / from.1).arg();
    let [whole, first, second] = [turn(from, to), turn(from, middle), turn(middle, to)];
    let is_small = first.abs().max(second.abs()) < TURN_RAD && (first + second - whole).abs() < TURN_OFF_RAD;
    if is_small || halvings == 0 {
        return first + second;
    }
    let half = |from, to| turned_rad(value, [from, between(value, from, to), to], halvings - 1);
    half(from, middle) + half(middle, to)
}

fn between(value: &impl Fn(f64) -> Point, from: (f64, Point), to: (f64, Point)) -> (f64, Point) {
    let angle = 0.5 * (from.0 + to.0);
    (angle, value(angle))
}

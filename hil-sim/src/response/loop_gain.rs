//! The figures of a loop: growth, margins, bandwidth.
//!
//! The gain `L` is that of the command of one axis, with the loops of the others closed; where controllers run at different
//! rates, each eigenvalue of the gain over a cycle. Crossings are found by bisection between frequencies that are as
//! close as the gain bends.
//!
//! Margins: Åström and Murray, Feedback Systems, section 10.3. They mean what they say for one loop; of an axis whose
//! neighbours move along, they are those with its neighbours' loops closed.
#![expect(clippy::indexing_slicing, reason = "matrices, whose sizes follow from one another")]

use std::f64::consts::{FRAC_1_SQRT_2, TAU};
use std::ops::Range;

use nalgebra::{DMatrix, DVector, Schur};
use serde::Serialize;

use super::closed_loop::{Loop, ONE, Point, Reference};
use super::poles::UNDECIDED;

/// How often the way from one frequency to the next is halved at most.
const GAIN_HALVINGS: u32 = 12;
const ROOT_HALVINGS: u32 = 48;
/// Angle below which a gain is lost in rounding.
const MIN_ANGLE: f64 = 1e-6;
/// A gain of this size is rounding.
const MIN_GAIN: f64 = 1e-9;
/// Share of a gain that a straight line to it may be off by.
const STRAIGHT: f64 = 0.05;

/// What is known of one loop around an axis.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct LoopFigures {
    /// Growth per tick of the disturbance that dies out slowest: above 1 the loop is unstable, and has no other figures. None
    /// where all of them are gone soon.
    pub growth_per_tick: Option<f64>,
    /// Smallest distance of the phase from -180°, lag or lead, where the gain is 1, degrees; none when it never is.
    pub phase_margin_deg: Option<f64>,
    /// Frequency there, `Hz`.
    pub crossover_hz: Option<f64>,
    /// By what the gain may rise until the loop is unstable; none when by anything.
    pub gain_margin: Option<f64>,
    /// Frequency at which the closed loop from reference to position (of a velocity loop: to velocity) falls below 0.707,
    /// `Hz`; none where no reference is measured, and when it never does.
    pub bandwidth_hz: Option<f64>,
}

impl Loop {
    /// Of every command; none where nothing is fed back to it.
    pub(super) fn figures(&self) -> Vec<Option<LoopFigures>> {
        let growth_per_tick = self.growth_per_tick();
        let figures = LoopFigures { growth_per_tick, ..LoopFigures::default() };
        let of = |command: usize| {
            let is_fed =
                self.columns.iter().any(|column| matches!(column.answers.get(command), Some(Some(_))));
            is_fed.then_some(figures)
        };
        let mut all: Vec<Option<LoopFigures>> = (0..self.commands).map(of).collect();
        if growth_per_tick.is_some_and(|growth| growth >= 1.0 - UNDECIDED) {
            return all;
        }
        let gains = self.gains();
        for (command, figures) in all.iter_mut().enumerate() {
            let Some(figures) = figures else { continue };
            let margin = self.phase_margin(command, &gains);
            (figures.phase_margin_deg, figures.crossover_hz) =
                margin.map(|(margin, angle)| (margin, self.hz(angle))).unzip();
            figures.gain_margin = self.gain_margin(command, &gains);
            figures.bandwidth_hz = self.bandwidth(command).map(|angle| self.hz(angle));
        }
        all
    }

    /// Of an angle of `Z`, from 0 to pi.
    fn hz(&self, angle: f64) -> f64 {
        angle / (TAU * self.period_s * self.cycle())
    }

    /// Gains of a loop: where controllers run at different rates, its commands in a cycle are fed back one by one, and
    /// the eigenvalues of that decide.
    fn gains_of_each(&self) -> usize {
        if self.cycle_ticks == 1 { 1 } else { self.columns.len() }
    }

    /// The gains of all loops at an angle, each with the others closed; in the order of those nearby.
    fn gains_near(&self, angle: f64, nearby: &DVector<Point>) -> DVector<Point> {
        let mut gains = self.gains_at(angle);
        for first in (0..gains.len()).step_by(self.gains_of_each().max(1)) {
            for place in first..first + self.gains_of_each() {
                let away = |at: &usize| (gains[*at] - nearby[place]).norm();
                let best = (place..first + self.gains_of_each()).min_by(|a, b| away(a).total_cmp(&away(b)));
                gains.swap_rows(place, best.unwrap_or(place));
            }
        }
        gains
    }

    /// The same in any order.
    fn gains_at(&self, angle: f64) -> DVector<Point> {
        let at = self.at(self.on_circle(1.0, angle));
        let ticks = self.cycle_ticks;
        let parts: Vec<DMatrix<Point>> = (0..self.commands)
            .map(|command| {
                at.plant.columns(command * ticks, ticks) * at.controller.rows(command * ticks, ticks)
            })
            .collect();
        let each = self.gains_of_each();
        let mut gains = DVector::from_element(self.commands * each, Point::default());
        for (command, part) in parts.iter().enumerate() {
            let mut rest = DMatrix::identity(self.columns.len(), self.columns.len());
            for (_, other) in parts.iter().enumerate().filter(|(other, _)| *other != command) {
                rest -= other;
            }
            let Some(fed_back) = rest.lu().solve(part) else { continue };
            if each == 1 {
                gains[command] = -fed_back.trace();
            } else if let Some(eigenvalues) = Schur::new(fed_back).eigenvalues() {
                gains.rows_mut(command * each, each).copy_from(&-eigenvalues);
            }
        }
        gains
    }

    /// The gains at so many angles that they are nearly straight in between.
    fn gains(&self) -> Vec<(f64, DVector<Point>)> {
        let angles = self.angles().into_iter().filter(|angle| *angle > MIN_ANGLE);
        let mut gains: Vec<(f64, DVector<Point>)> = Vec::new();
        for angle in angles {
            let Some(from) = gains.last().cloned() else {
                gains.push((angle, self.gains_at(angle)));
                continue;
            };
            let next = (angle, self.gains_near(angle, &from.1));
            self.refine(&from, &next, GAIN_HALVINGS, &mut gains);
            // Halves may have told apart what was mixed up.
            let next = gains.last().map_or(next.1, |(_, nearby)| self.gains_near(angle, nearby));
            gains.push((angle, next));
        }
        gains
    }

    fn refine(
        &self,
        from: &(f64, DVector<Point>),
        to: &(f64, DVector<Point>),
        halvings: u32,
        gains: &mut Vec<(f64, DVector<Point>)>,
    ) {
        let angle = 0.5 * (from.0 + to.0);
        let middle = (angle, self.gains_near(angle, &from.1));
        let straight = (&from.1 + &to.1) * Point::from(0.5);
        let is_straight = straight.iter().zip(&middle.1).all(|(straight, gain)| {
            let near = gain.norm().min((gain + ONE).norm().max(STRAIGHT));
            (straight - gain).norm() <= STRAIGHT * near
        });
        if is_straight || halvings == 0 {
            gains.push(middle);
            return;
        }
        self.refine(from, &middle, halvings - 1, gains);
        gains.push(middle.clone());
        let to = (to.0, self.gains_near(to.0, &middle.1));
        self.refine(&middle, &to, halvings - 1, gains);
    }

    /// Angles at which something of the gains of a command changes its sign, with the gain there.
    fn crossings(
        &self,
        command: usize,
        gains: &[(f64, DVector<Point>)],
        of: impl Fn(Point) -> f64,
    ) -> Vec<(f64, Point)> {
        let crossing = |pair: &[(f64, DVector<Point>)], place: usize| {
            let [(from, before), (to, after)] = pair else { return None };
            let is_positive = |gains: &DVector<Point>| of(gains[place]) > 0.0;
            let starts_positive = is_positive(before);
            let (mut from, mut to, mut gains) = (*from, *to, before.clone());
            if starts_positive == is_positive(after) {
                return None;
            }
            for _ in 0..ROOT_HALVINGS {
                let middle = 0.5 * (from + to);
                let there = self.gains_near(middle, &gains);
                if is_positive(&there) == starts_positive {
                    (from, gains) = (middle, there);
                } else {
                    to = middle;
                }
            }
            Some((from, gains[place]))
        };
        let places = self.gains_of(command);
        let of_pair = |pair| places.clone().filter_map(move |place| crossing(pair, place));
        gains.windows(2).flat_map(of_pair).collect()
    }

    fn gains_of(&self, command: usize) -> Range<usize> {
        let each = self.gains_of_each();
        command * each..(command + 1) * each
    }

    /// The smallest one of all crossings, degrees, and its angle.
    fn phase_margin(&self, command: usize, gains: &[(f64, DVector<Point>)]) -> Option<(f64, f64)> {
        let crossings = self.crossings(command, gains, |gain| gain.norm() - 1.0);
        let margins = crossings.into_iter().map(|(angle, gain)| ((-gain).arg().abs().to_degrees(), angle));
        margins.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// The smallest one above 1 of all crossings of -180°; at half the sample rate every gain is real.
    fn gain_margin(&self, command: usize, gains: &[(f64, DVector<Point>)]) -> Option<f64> {
        let crossings = self.crossings(command, gains, |gain| gain.im);
        let last = gains.last().map(|(_, gains)| self.gains_of(command).map(|place| gains[place]));
        let real = crossings.into_iter().map(|(_, gain)| gain).chain(last.into_iter().flatten());
        let is_on_axis =
            |gain: &Point| gain.im.abs() < 1e-3 * gain.norm() && (-1.0..-MIN_GAIN).contains(&gain.re);
        real.filter(is_on_axis).map(|gain| 1.0 / gain.norm()).min_by(f64::total_cmp)
    }

    /// The angle at which what follows a reference falls below it by 3 dB.
    fn bandwidth(&self, command: usize) -> Option<f64> {
        let reference = self.references.get(command)?.as_ref()?;
        let level = |angle: f64| self.followed(reference, angle).norm() - FRAC_1_SQRT_2;
        let angles: Vec<f64> = self.angles().into_iter().filter(|angle| *angle > MIN_ANGLE).collect();
        let levels: Vec<(f64, f64)> = angles.iter().map(|angle| (*angle, level(*angle))).collect();
        let falls = levels.windows(2).find(|pair| matches!(pair, [from, to] if from.1 >= 0.0 && to.1 < 0.0));
        let Some([(from, _), (to, _)]) = falls else {
            return levels.first().filter(|(_, level)| *level < 0.0).map(|_| 0.0);
        };
        let (mut from, mut to) = (*from, *to);
        for _ in 0..ROOT_HALVINGS {
            let middle = 0.5 * (from + to);
            if level(middle) >= 0.0 { from = middle } else { to = middle }
        }
        Some(from)
    }

    /// What comes of a reference of size 1 in what follows it.
    fn followed(&self, reference: &Reference, angle: f64) -> Point {
        let z = self.on_circle(1.0, angle);
        let (at, ticks, columns) = (self.at(z), self.cycle_ticks, self.columns.len());
        let follows = self.lifted(&self.followers, z).phases;
        let mut commanded = DVector::from_element(self.commands * ticks, Point::default());
        for (begun, answers) in reference.answers.iter().enumerate() {
            for (command, answer) in answers.iter().enumerate() {
                let Some(answer) = answer else { continue };
                for phase in 0..ticks {
                    let offset = phase.cast_signed() - begun.cast_signed();
                    commanded[command * ticks + phase] += answer.at(z, ticks, offset) * power(z, begun);
                }
            }
        }
        let closed = DMatrix::identity(columns, columns) - &at.plant * &at.controller;
        let measured = closed.lu().solve(&(&at.plant * &commanded)).unwrap_or_default();
        if measured.len() == columns {
            commanded += &at.controller * measured;
        }
        let mut sum = Point::default();
        for seen in 0..ticks {
            for command in 0..self.commands {
                for phase in 0..ticks {
                    let gain =
                        follows.get(seen + ticks - 1 - phase).map(|gains| gains[(reference.output, command)]);
                    sum += gain.unwrap_or_default() * commanded[command * ticks + phase] / power(z, seen);
                }
            }
        }
        sum / self.cycle()
    }
}

fn power(z: Point, ticks: usize) -> Point {
    z.powu(u32::try_from(ticks).unwrap_or_default())
}

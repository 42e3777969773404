//! Figures of a loop: growth, margins, bandwidth.
//!
//! The gain `L` is that of the command of one axis with the loops of the other axes closed; with different controller
//! rates, each eigenvalue of the gain over a cycle. Crossings are found by bisection between frequencies that are
//! spaced according to the curvature of the gain.
//!
//! Margins: Åström and Murray, Feedback Systems, section 10.3. They apply to one loop; for coupled axes, the loops of
//! the other axes are closed.
#![expect(clippy::indexing_slicing, reason = "matrices, whose sizes follow from one another")]

use std::f64::consts::{FRAC_1_SQRT_2, TAU};
use std::ops::Range;

use nalgebra::{DMatrix, DVector, Schur};

use super::closed_loop::{Circle, Loop, ONE, Point, Spectra};
use crate::loop_figures::{LoopFigures, UNDECIDED};

/// Maximum halvings between two frequencies.
const GAIN_HALVINGS: u32 = 12;
/// Maximum iterations to a zero, and its tolerance.
const ZERO_STEPS: u32 = 48;
const ZERO_WITHIN: f64 = 1e-13;
/// Angle below which a gain is below rounding.
const MIN_ANGLE: f64 = 1e-6;
/// Magnitude of a gain that is rounding.
const MIN_GAIN: f64 = 1e-9;
/// Relative tolerance of linear interpolation of a gain.
const STRAIGHT: f64 = 0.05;

impl Loop {
    /// Figures of every command; `None` without feedback.
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
        let circle = self.circle(1.0);
        let gains = circle.gains();
        for (command, figures) in all.iter_mut().enumerate() {
            let Some(figures) = figures else { continue };
            let margin = circle.phase_margin(command, &gains);
            (figures.phase_margin_deg, figures.crossover_hz) =
                margin.map(|(margin, angle)| (margin, circle.hz(angle))).unzip();
            figures.gain_margin = circle.gain_margin(command, &gains);
            figures.bandwidth_hz = circle.bandwidth(command).map(|angle| circle.hz(angle));
        }
        all
    }
}

impl Circle<'_> {
    /// Gains by angle of `Z`, from 0 to pi.
    fn hz(&self, angle: f64) -> f64 {
        angle / (TAU * self.whole.period_s * self.whole.cycle())
    }

    /// Gains of a loop; with different controller rates, the eigenvalues of its commands in a cycle.
    fn gains_of_each(&self) -> usize {
        if self.whole.cycle_ticks == 1 { 1 } else { self.whole.columns.len() }
    }

    /// Returns the gains of all loops at an angle, each with the others closed, matched to nearby gains.
    fn gains_near(&self, angle: f64, nearby: &DVector<Point>) -> DVector<Point> {
        self.ordered(self.gains_at(angle), nearby)
    }

    /// Matches gains to nearby gains.
    fn ordered(&self, mut gains: DVector<Point>, nearby: &DVector<Point>) -> DVector<Point> {
        for first in (0..gains.len()).step_by(self.gains_of_each().max(1)) {
            for place in first..first + self.gains_of_each() {
                let away = |at: &usize| (gains[*at] - nearby[place]).norm();
                let best = (place..first + self.gains_of_each()).min_by(|a, b| away(a).total_cmp(&away(b)));
                gains.swap_rows(place, best.unwrap_or(place));
            }
        }
        gains
    }

    /// Returns the gains in any order.
    fn gains_at(&self, angle: f64) -> DVector<Point> {
        let at = self.at(angle);
        let ticks = self.whole.cycle_ticks;
        let parts: Vec<DMatrix<Point>> = (0..self.whole.commands)
            .map(|command| {
                at.plant.columns(command * ticks, ticks) * at.controller.rows(command * ticks, ticks)
            })
            .collect();
        let each = self.gains_of_each();
        let mut gains = DVector::from_element(self.whole.commands * each, Point::default());
        for (command, part) in parts.iter().enumerate() {
            let mut rest = DMatrix::identity(self.whole.columns.len(), self.whole.columns.len());
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

    /// Computes gains at enough angles for linear interpolation.
    fn gains(&self) -> Vec<(f64, DVector<Point>)> {
        let angles = self.whole.angles().into_iter().filter(|angle| *angle > MIN_ANGLE);
        let mut gains: Vec<(f64, DVector<Point>)> = Vec::new();
        for angle in angles {
            let Some(from) = gains.last().cloned() else {
                gains.push((angle, self.gains_at(angle)));
                continue;
            };
            let next = (angle, self.gains_near(angle, &from.1));
            self.refine(&from, &next, GAIN_HALVINGS, &mut gains);
            // Halving may have separated mixed gains.
            let nearby = gains.last().map_or(from.1, |(_, nearby)| nearby.clone());
            gains.push((angle, self.ordered(next.1, &nearby)));
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
        let to = (to.0, self.ordered(to.1.clone(), &middle.1));
        self.refine(&middle, &to, halvings - 1, gains);
    }

    /// Intervals of angles with a sign change of a function of the gains of a command.
    fn crossings<'g>(
        &self,
        command: usize,
        gains: &'g [(f64, DVector<Point>)],
        of: impl Fn(Point) -> f64,
    ) -> Vec<Crossing<'g>> {
        let crossing = |pair: &'g [(f64, DVector<Point>)], place: usize| {
            let [from, to] = pair else { return None };
            let [before, after] = [from, to].map(|(_, gains)| of(gains[place]));
            let share = before / (before - after);
            let is_one = (before > 0.0) != (after > 0.0);
            let gain = from.1[place] * Point::from(1.0 - share) + to.1[place] * Point::from(share);
            is_one.then_some(Crossing { place, from, to, gain })
        };
        let places = self.gains_of(command);
        let of_pair = |pair| places.clone().filter_map(move |place| crossing(pair, place));
        gains.windows(2).flat_map(of_pair).collect()
    }

    /// Angle of a crossing, and its gain.
    fn located(&self, crossing: &Crossing<'_>, of: impl Fn(Point) -> f64) -> (f64, Point) {
        let Crossing { place, from, to, .. } = *crossing;
        let mut nearby = from.clone();
        let angle = zero([from, to].map(|(angle, gains)| (*angle, of(gains[place]))), |angle| {
            nearby = (angle, self.gains_near(angle, &nearby.1));
            of(nearby.1[place])
        });
        (angle, self.gains_near(angle, &nearby.1)[place])
    }

    fn gains_of(&self, command: usize) -> Range<usize> {
        let each = self.gains_of_each();
        command * each..(command + 1) * each
    }

    /// Minimum phase margin of all crossings, degrees, and its angle.
    fn phase_margin(&self, command: usize, gains: &[(f64, DVector<Point>)]) -> Option<(f64, f64)> {
        let of = |gain: Point| gain.norm() - 1.0;
        let crossings = self.crossings(command, gains, of);
        let located = crossings.iter().map(|crossing| self.located(crossing, of));
        let margins = located.map(|(angle, gain)| ((-gain).arg().abs().to_degrees(), angle));
        margins.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Minimum gain margin above 1 of all crossings of -180°; at half the sample rate every gain is real.
    fn gain_margin(&self, command: usize, gains: &[(f64, DVector<Point>)]) -> Option<f64> {
        let of = |gain: Point| gain.im;
        let is_on_axis =
            |gain: &Point| gain.im.abs() < 1e-3 * gain.norm() && (-1.0..-MIN_GAIN).contains(&gain.re);
        let last = gains.last().map(|(_, gains)| self.gains_of(command).map(|place| gains[place]));
        let last = last.into_iter().flatten().filter(is_on_axis).map(|gain| gain.norm());
        let mut largest = last.fold(0.0, f64::max);
        let mut crossings = self.crossings(command, gains, of);
        crossings.sort_by(|a, b| b.gain.norm().total_cmp(&a.gain.norm()));
        for crossing in crossings.iter().filter(|crossing| crossing.gain.re < 0.0) {
            // Linear interpolation suffices here; the other margins are smaller.
            if (1.0 + 2.0 * STRAIGHT) * crossing.gain.norm() < largest {
                break;
            }
            let (_, gain) = self.located(crossing, of);
            if is_on_axis(&gain) {
                largest = largest.max(gain.norm());
            }
        }
        (largest > 0.0).then(|| 1.0 / largest)
    }

    /// Angle at which the following output falls 3 dB below its reference.
    fn bandwidth(&self, command: usize) -> Option<f64> {
        let reference = self.whole.references.get(command)?.as_ref()?;
        let answers: Vec<Spectra<'_>> =
            (0..).zip(&reference.answers).map(|(begun, answers)| self.spectra(answers, begun)).collect();
        let level = |angle: f64| self.followed(reference.output, &answers, angle).norm() - FRAC_1_SQRT_2;
        let angles: Vec<f64> = self.whole.angles().into_iter().filter(|angle| *angle > MIN_ANGLE).collect();
        let mut levels = angles.iter().map(|angle| (*angle, level(*angle)));
        let mut from = levels.next()?;
        if from.1 < 0.0 {
            return Some(0.0);
        }
        for to in levels {
            if to.1 < 0.0 {
                return Some(zero([from, to], level));
            }
            from = to;
        }
        None
    }

    /// Response to a unit reference.
    fn followed(&self, output: usize, answers: &[Spectra<'_>], angle: f64) -> Point {
        let (z, back) = self.point(angle);
        let Loop { cycle_ticks: ticks, commands, followers, .. } = self.whole;
        let (at, ticks, commands, columns) = (self.at(angle), *ticks, *commands, self.whole.columns.len());
        let follows = self.whole.lifted(followers, z).phases;
        let mut commanded = DVector::from_element(commands * ticks, Point::default());
        for (begun, answers) in answers.iter().enumerate() {
            for (command, phases) in answers.iter().enumerate() {
                for (phase, answer) in phases.iter().enumerate() {
                    if let Some(answer) = answer {
                        commanded[command * ticks + phase] += answer.at(angle, back) * power(z, begun);
                    }
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
            for command in 0..commands {
                for phase in 0..ticks {
                    let gain = follows.get(seen + ticks - 1 - phase).map(|gains| gains[(output, command)]);
                    sum += gain.unwrap_or_default() * commanded[command * ticks + phase] / power(z, seen);
                }
            }
        }
        sum / self.whole.cycle()
    }
}

/// A change of sign between two angles.
struct Crossing<'g> {
    /// Index among the gains.
    place: usize,
    from: &'g (f64, DVector<Point>),
    to: &'g (f64, DVector<Point>),
    /// Linear interpolation.
    gain: Point,
}

/// Finds a zero between two points with different signs: regula falsi, with the weight of a fixed end halved (Dowell
/// and Jarratt, "A modified regula falsi method", BIT 11, 1971).
fn zero([mut from, mut to]: [(f64, f64); 2], mut value: impl FnMut(f64) -> f64) -> f64 {
    for _ in 0..ZERO_STEPS {
        let at = (from.0 * to.1 - to.0 * from.1) / (to.1 - from.1);
        if !at.is_finite() || (at - to.0).abs() <= ZERO_WITHIN * at {
            break;
        }
        let found = (at, value(at));
        if (found.1 > 0.0) == (to.1 > 0.0) {
            from.1 *= 0.5;
        } else {
            from = to;
        }
        to = found;
    }
    to.0
}

fn power(z: Point, ticks: usize) -> Point {
    z.powu(u32::try_from(ticks).unwrap_or_default())
}

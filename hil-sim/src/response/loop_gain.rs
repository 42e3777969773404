//! The gain of a control loop as it is simulated: its margins, and whether it is stable.
//!
//! The loop is disturbed where a command leaves the controller: `w` for one tick. Around it goes `c = -L (w + c)`, with
//! the loop gain `L`, everything in it that there is: sampling, delay, filter, motor. So `L = -C / (w + C)`, with
//! `C(ω) = sum c[k] exp(-jωkh)` of what the controller does about it. `c` is the difference to the same run without the
//! disturbance. Half of the disturbance must do half of it: else something on the way is not linear, as friction, an
//! encoder's steps or a limit are, and there is no loop gain.
//!
//! Margins: Åström and Murray, Feedback Systems, section 10.3. They mean what they say for one loop; of an axis whose
//! neighbours move along, they are those with its neighbours' loops closed.

use std::f64::consts::{PI, TAU};

use serde::Serialize;

/// Of what the controller does, at most this part may not scale with the disturbance.
const LINEAR: f64 = 0.01;
/// Frequencies at which the gain is known, evenly on a logarithmic scale below half the sample rate.
const FREQUENCIES: u32 = 600;
/// Decades of frequency below half the sample rate.
const DECADES: f64 = 5.0;
/// Growth per tick, up or down, that is not told from none.
pub(super) const UNDECIDED: f64 = 1e-5;
/// Ticks in a quarter of the answers below which its mean square says little.
const SHORT_TICKS: usize = 16;
/// Share of the largest answer below which there is nothing left of it.
const GONE: f64 = 1e-3;

/// What is known of one loop around an axis.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct LoopFigures {
    /// Growth per tick of what is left of a disturbance: above 1 the loop is unstable. None when nothing is left.
    pub growth_per_tick: Option<f64>,
    /// Smallest distance of the phase from -180° where the gain is 1, degrees; none when it never is.
    pub phase_margin_deg: Option<f64>,
    /// Frequency there, `Hz`.
    pub crossover_hz: Option<f64>,
    /// By what the gain may rise until the loop is unstable; none when by anything.
    pub gain_margin: Option<f64>,
    /// Frequency from which on the joint follows by less than 0.707, `Hz`; none when it always follows.
    pub bandwidth_hz: Option<f64>,
}

/// What a controller did about disturbances of `w` and of half of it, tick by tick from the disturbance on.
#[derive(Debug)]
pub(super) struct Answers {
    pub(super) disturbance: f64,
    pub(super) to_whole: Vec<f64>,
    pub(super) to_half: Vec<f64>,
}

impl Answers {
    /// What they say of the loop; none when it is not linear.
    pub(super) fn figures(&self, period_s: f64) -> Option<LoopFigures> {
        if !self.is_linear() {
            return None;
        }
        let growth_per_tick = self.growth_per_tick();
        if growth_per_tick.is_some_and(|growth| growth >= 1.0 - UNDECIDED) {
            return Some(LoopFigures { growth_per_tick, ..LoopFigures::default() });
        }
        let half_rate_hz = 0.5 / period_s;
        let points: Vec<Point> = (0..=FREQUENCIES)
            .map(|n| half_rate_hz * libm::exp10(DECADES * (f64::from(n) / f64::from(FREQUENCIES) - 1.0)))
            .map(|hz| self.point(hz, period_s))
            .collect();
        let (phase_margin_deg, crossover_hz) = phase_margin(&points).unzip();
        let figures = LoopFigures {
            growth_per_tick,
            phase_margin_deg,
            crossover_hz,
            gain_margin: gain_margin(&points),
            bandwidth_hz: bandwidth_hz(&points),
        };
        Some(figures)
    }

    fn is_linear(&self) -> bool {
        let most = largest(&self.to_whole);
        let pairs = self.to_whole.iter().zip(&self.to_half);
        let off = pairs.map(|(whole, half)| (whole - 2.0 * half).abs()).fold(0.0, f64::max);
        most > 0.0 && off <= LINEAR * most
    }

    /// Of the last quarter over the one before, by their mean squares.
    fn growth_per_tick(&self) -> Option<f64> {
        let quarter = self.to_whole.len() / 4;
        if quarter < SHORT_TICKS {
            return self.fast_growth_per_tick();
        }
        let mean_square = |ticks: &[f64]| ticks.iter().map(|value| value * value).sum::<f64>();
        let mut quarters = self.to_whole.rchunks_exact(quarter.max(1));
        let (last, before) = quarters.next().zip(quarters.next())?;
        #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
        let ticks = quarter as f64;
        let growth = libm::pow(mean_square(last) / mean_square(before), 0.5 / ticks);
        (largest(last) > GONE * largest(&self.to_whole)).then_some(growth)
    }

    /// Of what grew too fast for that: from its first answer to its largest one.
    fn fast_growth_per_tick(&self) -> Option<f64> {
        let first = self.to_whole.iter().position(|answer| answer.abs() > 0.0)?;
        let most = largest(&self.to_whole);
        let last =
            self.to_whole.iter().position(|answer| answer.abs() >= most).filter(|last| *last > first)?;
        #[expect(clippy::cast_precision_loss, reason = "a few ticks")]
        let ticks = (last - first) as f64;
        Some(libm::pow(most / self.to_whole.get(first)?.abs(), 1.0 / ticks))
    }

    fn point(&self, hz: f64, period_s: f64) -> Point {
        // By turning on from tick to tick; a sine and a cosine for each would take most of the time.
        let (turn_re, turn_im) = (libm::cos(TAU * hz * period_s), -libm::sin(TAU * hz * period_s));
        let (mut re, mut im) = (1.0, 0.0);
        let (mut sum_re, mut sum_im) = (0.0, 0.0);
        for answer in &self.to_whole {
            sum_re += answer * re;
            sum_im += answer * im;
            (re, im) = (re * turn_re - im * turn_im, re * turn_im + im * turn_re);
        }
        let (closed_re, closed_im) = (-sum_re / self.disturbance, -sum_im / self.disturbance);
        // L = T / (1 - T).
        let (rest_re, rest_im) = (1.0 - closed_re, -closed_im);
        let rest = rest_re * rest_re + rest_im * rest_im;
        let (loop_re, loop_im) = (
            (closed_re * rest_re + closed_im * rest_im) / rest,
            (closed_im * rest_re - closed_re * rest_im) / rest,
        );
        Point {
            hz,
            closed: libm::hypot(closed_re, closed_im),
            gain: libm::hypot(loop_re, loop_im),
            phase_rad: libm::atan2(loop_im, loop_re),
        }
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().map(|value| value.abs()).fold(0.0, f64::max)
}

/// The loop at one frequency.
#[derive(Debug, Clone, Copy)]
struct Point {
    hz: f64,
    /// Gain of the closed loop.
    closed: f64,
    /// Gain and phase of the open one.
    gain: f64,
    phase_rad: f64,
}

/// The smallest one of all crossings, degrees, and its frequency, Hz.
fn phase_margin(points: &[Point]) -> Option<(f64, f64)> {
    let crossing = |pair: &[Point]| {
        let [from, to] = pair else { return None };
        let [a, b] = [from, to].map(|point| libm::log(point.gain));
        if a.signum() * b.signum() > 0.0 {
            return None;
        }
        let share = a / (a - b);
        let phase_rad = from.phase_rad + share * turned_rad(from, to);
        let margin_rad = (phase_rad + PI + PI).rem_euclid(TAU) - PI;
        Some((margin_rad.to_degrees(), from.hz + share * (to.hz - from.hz)))
    };
    points.windows(2).filter_map(crossing).min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))
}

/// The smallest one above 1 of all crossings of -180°.
fn gain_margin(points: &[Point]) -> Option<f64> {
    let crossing = |pair: &[Point]| {
        let [from, to] = pair else { return None };
        // Beyond the negative real axis the phase jumps by a turn.
        let has_crossed = (from.phase_rad - to.phase_rad).abs() > PI;
        let share = (PI - from.phase_rad.abs()) / turned_rad(from, to).abs().max(f64::MIN_POSITIVE);
        let gain = from.gain + share.clamp(0.0, 1.0) * (to.gain - from.gain);
        (has_crossed && gain < 1.0).then_some(1.0 / gain)
    };
    points.windows(2).filter_map(crossing).min_by(f64::total_cmp)
}

/// How far the phase goes from a point to the next one, the short way.
fn turned_rad(from: &Point, to: &Point) -> f64 {
    (to.phase_rad - from.phase_rad + PI).rem_euclid(TAU) - PI
}

fn bandwidth_hz(points: &[Point]) -> Option<f64> {
    let level = std::f64::consts::FRAC_1_SQRT_2;
    let falls = |pair: &&[Point]| matches!(pair, [from, to] if from.closed >= level && to.closed < level);
    let pair = points.windows(2).find(falls)?;
    let [from, to] = pair else { return None };
    Some(from.hz + (from.closed - level) / (from.closed - to.closed) * (to.hz - from.hz))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An integrator `L(z) = g z⁻² / (1 - z⁻¹)`, disturbed: every figure has a closed form.
    fn integrator(gain: f64, disturbance: f64, ticks: usize) -> Vec<f64> {
        let mut inputs = vec![disturbance];
        let (mut sum, mut answers) = (0.0, vec![0.0]);
        for tick in 1..ticks {
            // One tick to the integrator, one out of it.
            let answer = -gain * sum;
            sum += inputs[tick - 1];
            answers.push(answer);
            inputs.push(answer);
        }
        answers
    }

    fn figures(gain: f64) -> LoopFigures {
        let [to_whole, to_half] = [1.0, 0.5].map(|disturbance| integrator(gain, disturbance, 4000));
        Answers { disturbance: 1.0, to_whole, to_half }.figures(1e-3).unwrap()
    }

    #[test]
    fn an_integrator_with_two_ticks_has_the_margins_of_its_formula() {
        let found = figures(0.1);
        // |L| = g / (2 sin(ωh/2)), phase -90° - 1.5 ωh, half a tick of it the integrator's own lead.
        let crossover_rad = 2.0 * libm::asin(0.05);
        assert!((found.crossover_hz.unwrap() - crossover_rad / TAU * 1e3).abs() < 0.05, "{found:?}");
        let margin_deg = 90.0 - 1.5 * crossover_rad.to_degrees();
        assert!((found.phase_margin_deg.unwrap() - margin_deg).abs() < 0.05, "{found:?} {margin_deg}");
        // -180° where 1.5 ωh = 90°: ωh = 60°, |L| = g.
        assert!((found.gain_margin.unwrap() - 10.0).abs() < 0.05, "{found:?}");
    }

    #[test]
    fn beyond_its_gain_margin_it_grows_by_its_largest_eigenvalue() {
        // z² - z + g = 0: both roots on the circle of radius sqrt(g).
        for gain in [1.02, 1.001] {
            let growth = figures(gain).growth_per_tick.unwrap();
            assert!((growth - libm::sqrt(gain)).abs() < UNDECIDED, "{growth} for {gain}");
        }
        // So fast that the listener ends after a few ticks.
        let [to_whole, to_half] = [1.0, 0.5].map(|disturbance| integrator(9.0, disturbance, 30));
        let growth =
            Answers { disturbance: 1.0, to_whole, to_half }.figures(1e-3).unwrap().growth_per_tick.unwrap();
        assert!((growth / 3.0 - 1.0).abs() < 0.1, "{growth}");
    }

    #[test]
    fn what_does_not_scale_has_no_loop_gain() {
        let to_whole = integrator(0.1, 1.0, 4000);
        let to_half = to_whole.clone();
        assert_eq!(Answers { disturbance: 1.0, to_whole, to_half }.figures(1e-3), None);
    }
}

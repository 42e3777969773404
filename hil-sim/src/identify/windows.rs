//! Windows of an experiment: intervals of motion in one direction, not slow. Each gives one equation.

use super::{Experiment, ForceTiming, Quantity};

/// Window lengths in ticks: long windows average more noise, short ones are used if data are few or the motion is
/// fast.
pub(super) const LENGTHS: [usize; 2] = [40, 20];
/// Margin of a window for its force, beyond the delay, ticks.
pub(super) const MARGIN: usize = 12;
/// Share of the maximum speed that counts as slow.
const SLOW: f64 = 0.1;
/// Maximum motion of a held joint in a window, as a share of the joint's travel.
const HELD: f64 = 0.02;
/// Order of the difference that isolates position noise, and the variance of this difference for unit white noise.
const NOISE_ORDER: usize = 6;
const NOISE_GAIN: f64 = 924.0;
/// Coefficients of `(1 - x)⁶`.
const BINOMIAL: [f64; NOISE_ORDER + 1] = [1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0];

/// Equation of one window, without its force.
pub(super) struct Window {
    /// First tick.
    start: usize,
    /// One column per quantity, and one for the inertia shared with each other joint.
    pub(super) columns: Vec<f64>,
}

/// All windows of an experiment.
pub(super) struct Windows<'a> {
    experiment: &'a Experiment<'a>,
    /// Ticks of a window.
    pub(super) ticks: usize,
    pub(super) list: Vec<Window>,
    /// Mean positions of the other joints.
    pub(super) others_at: Vec<f64>,
    /// Variance of each column by position noise.
    pub(super) noise: Vec<f64>,
}

impl<'a> Windows<'a> {
    /// Finds windows of this length that stay `margin` ticks away from both ends of the recording.
    pub(super) fn of(
        experiment: &'a Experiment<'a>,
        quantities: &[Quantity],
        ticks: usize,
        margin: usize,
    ) -> Self {
        let Experiment { period_s, position, others, .. } = *experiment;
        // Over five ticks, so that encoder quantisation does not reverse the direction.
        let changes: Vec<f64> = position.windows(5).map(change).collect();
        let fastest = changes.iter().fold(0.0, |most: f64, change| most.max(change.abs()));
        let mut windows = Self {
            experiment,
            ticks,
            list: Vec::new(),
            others_at: vec![0.0; others.len()],
            noise: Vec::new(),
        };
        let mut start = margin.max(2);
        while let (Some(moved), Some(speeds), Some(_)) = (
            position.get(start..=start + ticks),
            changes.get(start - 2..start + ticks - 1),
            position.get(start + ticks + margin),
        ) {
            let way = speeds.first().copied().unwrap_or_default().signum();
            if let Some(slow) = speeds.iter().rposition(|speed| speed * way <= SLOW * fastest) {
                start += slow + 1;
                continue;
            }
            let window = start..=start + ticks;
            let others: Vec<&[f64]> =
                others.iter().map(|other| other.get(window.clone()).unwrap_or_default()).collect();
            if others.iter().all(|other| travel(other) <= HELD * travel(moved)) {
                let own = quantities.iter().map(|quantity| column(*quantity, moved, way, period_s));
                let coupled = others.iter().map(|other| column(Quantity::Inertia, other, way, period_s));
                windows.list.push(Window { start, columns: own.chain(coupled).collect() });
                for (at, other) in windows.others_at.iter_mut().zip(&others) {
                    *at += middle(other);
                }
            }
            start += ticks;
        }
        for at in &mut windows.others_at {
            *at /= count(windows.list.len().max(1));
        }
        let own = quantities.iter().map(|quantity| (*quantity, position));
        let coupled = others.iter().map(|other| (Quantity::Inertia, *other));
        let noise = |(quantity, position)| gain(quantity, period_s, ticks) * windows.position_noise(position);
        windows.noise = own.chain(coupled).map(noise).collect();
        windows
    }

    /// Returns the mean force of each window for a force recorded `delay_ticks` later than the position.
    pub(super) fn forces(&self, delay_ticks: f64) -> Vec<f64> {
        let tick = 1.0 / count(self.ticks);
        let shift = match self.experiment.force_timing {
            ForceTiming::Measured => delay_ticks,
            ForceTiming::Held { delay_ticks: known } => delay_ticks - known,
        };
        let weight = |x: f64| match self.experiment.force_timing {
            ForceTiming::Measured => bump(x.clamp(0.0, 1.0)) * tick,
            ForceTiming::Held { .. } => area(x + tick) - area(x),
        };
        // From the last tick at or before the window's start to one tick after its end.
        let first = libm::floor(shift) - 1.0;
        let weights: Vec<f64> =
            (0..self.ticks + 3).map(|place| weight((count(place) + first - shift) * tick)).collect();
        let forces = |window: &Window| {
            #[expect(clippy::cast_possible_truncation, reason = "ticks of a recording")]
            let begin = window.start.checked_add_signed(first as isize).unwrap_or_default();
            let forces = self.experiment.force.get(begin..).unwrap_or_default();
            forces.iter().zip(&weights).map(|(force, weight)| force * weight).sum()
        };
        self.list.iter().map(forces).collect()
    }

    /// Returns pairs of consecutive windows without a gap, by index.
    pub(super) fn neighbours(&self) -> impl Iterator<Item = (usize, usize)> {
        let starts = self.list.windows(2).enumerate();
        starts.filter_map(|(place, pair)| match pair {
            [one, other] if one.start + self.ticks == other.start => Some((place, place + 1)),
            _ => None,
        })
    }

    /// Estimates the position noise variance from the sixth difference, which is nearly 0 for smooth motion.
    fn position_noise(&self, position: &[f64]) -> f64 {
        let moved =
            self.list.iter().filter_map(|window| position.get(window.start..=window.start + self.ticks));
        let squares: Vec<f64> =
            moved.flat_map(|moved| moved.windows(NOISE_ORDER + 1).map(difference)).collect();
        squares.iter().sum::<f64>() / NOISE_GAIN / count(squares.len().max(1))
    }
}

/// Square of the sixth difference.
fn difference(positions: &[f64]) -> f64 {
    let difference: f64 = positions.iter().zip(BINOMIAL).map(|(position, factor)| position * factor).sum();
    difference * difference
}

/// Variance of a quantity's column for unit white position noise. That of a weight is small.
fn gain(quantity: Quantity, period_s: f64, ticks: usize) -> f64 {
    let window_s = period_s * count(ticks);
    let squares = |weight: fn(f64) -> f64| -> f64 {
        let terms = (0..=ticks).map(|tick| weight(count(tick) / count(ticks)) / count(ticks));
        terms.map(|weight| weight * weight).sum()
    };
    match quantity {
        Quantity::Inertia => squares(curvature) / libm::pow(window_s, 4.0),
        Quantity::Viscous => squares(slope) / (window_s * window_s),
        Quantity::Coulomb
        | Quantity::WeightSine
        | Quantity::WeightCosine
        | Quantity::Constant
        | Quantity::Lateness => 0.0,
    }
}

fn change(positions: &[f64]) -> f64 {
    positions.last().zip(positions.first()).map_or(0.0, |(last, first)| last - first)
}

/// Between the ends.
fn middle(positions: &[f64]) -> f64 {
    positions.first().zip(positions.last()).map_or(0.0, |(first, last)| 0.5 * (first + last))
}

pub(super) fn travel(values: &[f64]) -> f64 {
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max) - least
}

/// Contribution of a unit quantity to the mean force of a window. Integrals use the trapezoidal rule: all integrands
/// are 0 at both ends with their slopes, where the rule has at least third-order accuracy.
fn column(quantity: Quantity, moved: &[f64], way: f64, period_s: f64) -> f64 {
    let ticks = count(moved.len() - 1);
    let window_s = period_s * ticks;
    let weighted = |weight: fn(f64) -> f64, of: &dyn Fn(f64) -> f64| -> f64 {
        let terms =
            moved.iter().enumerate().map(|(tick, position)| weight(count(tick) / ticks) * of(*position));
        terms.sum::<f64>() / ticks
    };
    // The errors of both ends cancel.
    let middle = middle(moved);
    match quantity {
        Quantity::Inertia => weighted(curvature, &|q| q - middle) / (window_s * window_s),
        Quantity::Viscous => -weighted(slope, &|q| q - middle) / window_s,
        Quantity::Coulomb => way * AREA,
        Quantity::WeightSine => weighted(bump, &libm::sin),
        Quantity::WeightCosine => weighted(bump, &libm::cos),
        Quantity::Constant => AREA,
        // Its column is the derivative of the force.
        Quantity::Lateness => 0.0,
    }
}

/// `x⁶ (1 - x)⁶` and its derivatives.
fn bump(x: f64) -> f64 {
    libm::pow(x * (1.0 - x), 6.0)
}

fn slope(x: f64) -> f64 {
    6.0 * libm::pow(x * (1.0 - x), 5.0) * (1.0 - 2.0 * x)
}

fn curvature(x: f64) -> f64 {
    let (product, inner) = (x * (1.0 - x), 1.0 - 2.0 * x);
    6.0 * libm::pow(product, 4.0) * (5.0 * inner * inner - 2.0 * product)
}

/// Its integral from 0 to `x`, clamped to 0 to 1: binomial expansion.
fn area(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    BINOMIAL
        .into_iter()
        .zip([7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0])
        .map(|(of, power)| of * libm::pow(x, power) / power)
        .sum()
}

/// Its integral from 0 to 1.
const AREA: f64 = 1.0 / 12_012.0;

#[expect(clippy::cast_precision_loss, reason = "ticks of an experiment")]
pub(super) fn count(ticks: usize) -> f64 {
    ticks as f64
}

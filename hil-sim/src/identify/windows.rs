//! The equations of an experiment: one for each window of time in which the joint moves one way, and not slowly.

use super::{Experiment, ForceIs, Quantity};

/// Ticks of a window.
pub(super) const WINDOW: usize = 40;
/// Share of the largest speed that counts as slow.
const SLOW: f64 = 0.1;
/// Share of the joint's travel that another one may move in a window and count as held.
const HELD: f64 = 0.02;

/// One window: a column for each quantity and one for each other joint's inertia, and the force.
pub(super) type Equation = (Vec<f64>, f64);

/// Every window of an experiment.
#[derive(Debug, Default)]
pub(super) struct Windows {
    pub(super) equations: Vec<Equation>,
    /// Where the others were, on average.
    pub(super) others_at: Vec<f64>,
}

impl Windows {
    /// With the force as it was `lateness_ticks` before it was recorded.
    pub(super) fn of(experiment: &Experiment<'_>, quantities: &[Quantity], lateness_ticks: f64) -> Self {
        let Experiment { period_s, position, force, others, .. } = *experiment;
        // Over five ticks, so that an encoder's steps do not turn it around.
        let changes: Vec<f64> = position.windows(5).map(change).collect();
        let fastest = changes.iter().fold(0.0, |most: f64, change| most.max(change.abs()));
        let late_ticks = match experiment.force_is {
            ForceIs::Measured => -lateness_ticks,
            ForceIs::Held { delay_ticks } => delay_ticks - lateness_ticks,
        };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few ticks")]
        let before = libm::ceil(late_ticks.max(0.0)) as usize;
        let weight: fn(f64) -> f64 = match experiment.force_is {
            ForceIs::Measured => |x| bump(x.clamp(0.0, 1.0)) / count(WINDOW),
            ForceIs::Held { .. } => |x| area(x + 1.0 / count(WINDOW)) - area(x),
        };
        // Of the place in the window at which the force begins to be there.
        let driven = |forces: &[f64]| -> f64 {
            let place = |tick| (count(tick) - count(before) + late_ticks) / count(WINDOW);
            forces.iter().enumerate().map(|(tick, force)| force * weight(place(tick))).sum()
        };
        let mut windows = Self { equations: Vec::new(), others_at: vec![0.0; others.len()] };
        let mut start = before.max(2);
        while let (Some(moved), Some(speeds), Some(forces)) = (
            position.get(start..=start + WINDOW),
            changes.get(start - 2..start + WINDOW - 1),
            force.get(start - before..=start + WINDOW),
        ) {
            let way = speeds.first().copied().unwrap_or_default().signum();
            if let Some(slow) = speeds.iter().rposition(|speed| speed * way <= SLOW * fastest) {
                start += slow + 1;
                continue;
            }
            let window = start..=start + WINDOW;
            let others: Vec<&[f64]> =
                others.iter().map(|other| other.get(window.clone()).unwrap_or_default()).collect();
            start += WINDOW;
            if others.iter().any(|other| travel(other) > HELD * travel(moved)) {
                continue;
            }
            let own = quantities.iter().map(|quantity| column(*quantity, moved, way, period_s));
            let coupled = others.iter().map(|other| column(Quantity::Inertia, other, way, period_s));
            let columns = own.chain(coupled).collect();
            windows.equations.push((columns, driven(forces)));
            for (at, other) in windows.others_at.iter_mut().zip(&others) {
                *at += middle(other);
            }
        }
        for at in &mut windows.others_at {
            *at /= count(windows.equations.len().max(1));
        }
        windows
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

/// What a quantity of 1 adds to the mean force of a window. Sums are integrals by the trapezoidal rule: all that is
/// summed is 0 at both ends with its slopes, where that rule is exact to the third order of a tick or better.
fn column(quantity: Quantity, moved: &[f64], way: f64, period_s: f64) -> f64 {
    let window_s = period_s * count(WINDOW);
    let weighted = |weight: fn(f64) -> f64, of: &dyn Fn(f64) -> f64| -> f64 {
        let terms = moved.iter().enumerate().map(|(tick, position)| weight(share(tick)) * of(*position));
        terms.sum::<f64>() / count(WINDOW)
    };
    // What the rule leaves of one end is that of the other.
    let middle = middle(moved);
    match quantity {
        Quantity::Inertia => weighted(curvature, &|q| q - middle) / (window_s * window_s),
        Quantity::Viscous => -weighted(slope, &|q| q - middle) / window_s,
        Quantity::Coulomb => way * AREA,
        Quantity::WeightSine => weighted(bump, &libm::sin),
        Quantity::WeightCosine => weighted(bump, &libm::cos),
        Quantity::Constant => AREA,
        Quantity::Lateness => weighted(jerk, &|q| q - middle) / (window_s * window_s * window_s),
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

fn jerk(x: f64) -> f64 {
    let (product, inner) = (x * (1.0 - x), 1.0 - 2.0 * x);
    60.0 * libm::pow(product, 3.0) * inner * (2.0 * inner * inner - 3.0 * product)
}

/// Its integral from 0 to `x`, held inside 0 to 1: term by term of the binomial.
fn area(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    let binomial = [1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0];
    binomial
        .into_iter()
        .zip([7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0])
        .map(|(of, power)| of * libm::pow(x, power) / power)
        .sum()
}

/// Its integral from 0 to 1.
const AREA: f64 = 1.0 / 12_012.0;

fn share(tick: usize) -> f64 {
    count(tick) / count(WINDOW)
}

#[expect(clippy::cast_precision_loss, reason = "ticks of an experiment")]
pub(super) fn count(ticks: usize) -> f64 {
    ticks as f64
}

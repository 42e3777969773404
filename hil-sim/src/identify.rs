//! Identification of a joint: inertia, friction and weight from what was recorded of it, and its frequency response.
//!
//! ```text
//! J q'' + b q' + F_c sgn(q') + g_s sin q + g_c cos q + F_0 = F
//! ```
//!
//! Each window of time makes one equation of that: it is multiplied by `φ(t) = (t/T)⁶ (1 - t/T)⁶` and integrated, and the
//! derivatives are moved to `φ` (modulating functions; M. Shinbrot, "On the analysis of linear and nonlinear systems", Trans.
//! ASME 79, 1957). So neither speed nor acceleration has to be measured. In a window the joint moves one way, and not slowly:
//! what friction does around rest is not in the model. Least squares, each column scaled to 1; the half widths are of 95 %
//! confidence, from what the windows leave unexplained: noise is in them, what is wrong all along, as half a tick of delay, is not.
//!
//! A parameter that the motion cannot tell from the others gets no number.

mod response;
#[cfg(test)]
mod tests;
mod truth;

pub use response::{FrequencyPoint, ResponseTooShort, frequency_response};
pub use truth::truth;

use nalgebra::{DMatrix, DVector};

/// What was recorded of a joint, tick by tick.
#[derive(Debug, Clone, Copy)]
pub struct Experiment<'a> {
    /// Between two ticks, `s`.
    pub period_s: f64,
    /// `rad` or `m`.
    pub position: &'a [f64],
    /// On the joint, `N m` or `N`.
    pub force: &'a [f64],
    /// What the force was between two ticks.
    pub force_is: ForceIs,
    /// Whether it turns: then its weight changes with its position.
    pub turns: bool,
}

/// What a force is between the ticks in which it is recorded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ForceIs {
    /// Measured: it goes on evenly.
    Measured,
    /// Commanded: held from so many ticks later on, for one.
    Held {
        /// 0 or more.
        delay_ticks: f64,
    },
}

/// What is estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// `J`, `kg m²` or `kg`.
    Inertia,
    /// `b`, `N m s/rad` or `N s/m`.
    Viscous,
    /// `F_c`, `N m` or `N`.
    Coulomb,
    /// `g_s`, `N m`.
    WeightSine,
    /// `g_c`, `N m`.
    WeightCosine,
    /// `F_0`, `N m` or `N`.
    Constant,
}

/// An estimate.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Estimate {
    /// Of what.
    pub quantity: Quantity,
    /// Value and half width of its 95 % confidence interval; none where the motion cannot tell it from the others.
    pub value: Option<(f64, f64)>,
}

/// What an experiment says of a joint.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Identified {
    /// Of each quantity of the model.
    pub estimates: Vec<Estimate>,
    /// Equations they are from.
    pub windows: usize,
    /// Share of the force that the model leaves unexplained, RMS.
    pub unexplained: f64,
}

/// Why an experiment says nothing of a joint.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum IdentifyError {
    /// Something recorded is not a number.
    #[error("position or force of tick {tick} is not finite")]
    NotFinite {
        /// The first one.
        tick: usize,
    },
    /// Its position or force never changes.
    #[error(
        "the joint does not move, or its force never changes: excite it by a chirp or a PRBS on its reference or force"
    )]
    NotExcited,
    /// Too few windows in which it moves one way.
    #[error(
        "{found} stretches of {window_s} s in which the joint moves one way, and it takes {needed}: record for longer, or excite it more slowly"
    )]
    TooShort {
        /// As many as there are.
        found: usize,
        /// As many as are needed.
        needed: usize,
        /// How long each is, s.
        window_s: f64,
    },
    /// The model is not that of this joint.
    #[error("inertia, friction and weight leave {:.0} % of the force unexplained: the joint is pushed by something else, bends, has play, or what was recorded is not its force", 100.0 * unexplained)]
    Unexplained {
        /// RMS over that of the force.
        unexplained: f64,
    },
}

/// Ticks of a window.
const WINDOW: usize = 40;
/// Share of the largest speed that counts as slow.
const SLOW: f64 = 0.1;
/// Windows for each parameter.
const WINDOWS_EACH: usize = 5;
/// Variance inflation beyond which two columns are the same.
const MOST_INFLATION: f64 = 1e3;
/// Share of the force that may stay unexplained.
const MOST_UNEXPLAINED: f64 = 0.1;

/// Estimates what a joint has.
///
/// # Errors
/// [`IdentifyError`] where the experiment cannot say.
pub fn identify(experiment: &Experiment<'_>) -> Result<Identified, IdentifyError> {
    let Experiment { period_s, position, force, turns, .. } = *experiment;
    let finite = |(position, force): (&f64, &f64)| position.is_finite() && force.is_finite();
    if let Some(tick) = position.iter().zip(force).position(|both| !finite(both)) {
        return Err(IdentifyError::NotFinite { tick });
    }
    if range(position) <= 0.0 || range(force) <= 0.0 {
        return Err(IdentifyError::NotExcited);
    }
    let quantities: &[Quantity] = match turns {
        true => &[
            Quantity::Inertia,
            Quantity::Viscous,
            Quantity::Coulomb,
            Quantity::WeightSine,
            Quantity::WeightCosine,
            Quantity::Constant,
        ],
        false => &[Quantity::Inertia, Quantity::Viscous, Quantity::Coulomb, Quantity::Constant],
    };
    let equations = equations(experiment, quantities);
    let needed = WINDOWS_EACH * quantities.len();
    if equations.len() < needed {
        let window_s = period_s * count(WINDOW);
        return Err(IdentifyError::TooShort { found: equations.len(), needed, window_s });
    }
    solve(quantities, &equations)
}

/// One window: the column of each quantity, and the force.
type Equation = (Vec<f64>, f64);

fn equations(experiment: &Experiment<'_>, quantities: &[Quantity]) -> Vec<Equation> {
    let Experiment { period_s, position, force, .. } = *experiment;
    // Over five ticks, so that an encoder's steps do not turn it around.
    let changes: Vec<f64> = position.windows(5).map(window_change).collect();
    let fastest = changes.iter().fold(0.0, |most: f64, change| most.max(change.abs()));
    let delay_ticks = match experiment.force_is {
        ForceIs::Measured => 0.0,
        ForceIs::Held { delay_ticks } => delay_ticks,
    };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few ticks")]
    let before = libm::ceil(delay_ticks) as usize;
    let mut found = Vec::new();
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
        let columns = quantities.iter().map(|quantity| column(*quantity, moved, way, period_s));
        found.push((columns.collect(), driven(experiment.force_is, forces, before)));
        start += WINDOW;
    }
    found
}

fn window_change(positions: &[f64]) -> f64 {
    positions.last().zip(positions.first()).map_or(0.0, |(last, first)| last - first)
}

/// What a quantity of 1 adds to the mean force of a window. Sums are integrals by the trapezoidal rule: all that is
/// summed is 0 at both ends with its slopes, where that rule is exact to the sixth order of a tick.
fn column(quantity: Quantity, moved: &[f64], way: f64, period_s: f64) -> f64 {
    let window_s = period_s * count(WINDOW);
    let weighted = |weight: fn(f64) -> f64, of: &dyn Fn(f64) -> f64| -> f64 {
        let terms = moved.iter().enumerate().map(|(tick, position)| weight(share(tick)) * of(*position));
        terms.sum::<f64>() / count(WINDOW)
    };
    // Between the ends: what the rule leaves there of one is that of the other.
    let middle = moved.first().zip(moved.last()).map_or(0.0, |(first, last)| 0.5 * (first + last));
    match quantity {
        Quantity::Inertia => weighted(curvature, &|q| q - middle) / (window_s * window_s),
        Quantity::Viscous => -weighted(slope, &|q| q - middle) / window_s,
        Quantity::Coulomb => way * AREA,
        Quantity::WeightSine => weighted(bump, &libm::sin),
        Quantity::WeightCosine => weighted(bump, &libm::cos),
        Quantity::Constant => AREA,
    }
}

/// The force of a window, weighted; `before` ticks come before it.
fn driven(force_is: ForceIs, forces: &[f64], before: usize) -> f64 {
    let terms = forces.iter().enumerate().map(|(tick, force)| match force_is {
        ForceIs::Measured => force * bump(share(tick)) / count(WINDOW),
        ForceIs::Held { delay_ticks } => {
            let from = (count(tick) - count(before) + delay_ticks) / count(WINDOW);
            force * (area(from + 1.0 / count(WINDOW)) - area(from))
        }
    });
    terms.sum()
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

fn solve(quantities: &[Quantity], equations: &[Equation]) -> Result<Identified, IdentifyError> {
    let (rows, columns) = (equations.len(), quantities.len());
    let values = equations.iter().flat_map(|(row, _)| row.iter().copied());
    let mut matrix = DMatrix::from_row_iterator(rows, columns, values);
    let forces = DVector::from_iterator(rows, equations.iter().map(|(_, force)| *force));
    // A column that is 0 stays so, and is found below.
    let scales: Vec<f64> = matrix.column_iter().map(|column| column.norm().max(f64::MIN_POSITIVE)).collect();
    for (mut column, scale) in matrix.column_iter_mut().zip(&scales) {
        column /= *scale;
    }
    let decomposed = matrix.clone().svd(true, true);
    let smallest = decomposed.singular_values.max() * 1e-9;
    let (Ok(solution), Ok(inverse)) =
        (decomposed.solve(&forces, smallest), matrix.clone().pseudo_inverse(smallest))
    else {
        return Err(IdentifyError::NotExcited);
    };
    let residual = &forces - &matrix * &solution;
    let unexplained = residual.norm() / forces.norm().max(f64::MIN_POSITIVE);
    if unexplained > MOST_UNEXPLAINED {
        return Err(IdentifyError::Unexplained { unexplained });
    }
    let variance = residual.norm_squared() / count(rows - columns);
    // With columns of length 1, what the others add to the variance of a parameter.
    let inflations: Vec<f64> = inverse.row_iter().map(|row| row.norm_squared()).collect();
    // A direction that is cut off the pseudo-inverse has no variance in it, and is no better known.
    let is_known = |place: usize| match &decomposed.v_t {
        Some(directions) => {
            decomposed.singular_values.iter().zip(directions.row_iter()).all(|(value, direction)| {
                *value > smallest || direction.get(place).is_none_or(|part| part.abs() < 1e-6)
            })
        }
        None => false,
    };
    let estimate = |(place, quantity): (usize, &Quantity)| {
        let (inflation, scale) = (inflations.get(place)?, scales.get(place)?);
        let is_told = *inflation < MOST_INFLATION && is_known(place);
        let half_width = 1.96 * libm::sqrt(variance * inflation) / scale;
        let value = is_told.then_some((solution.get(place)? / scale, half_width));
        Some(Estimate { quantity: *quantity, value })
    };
    let estimates = quantities.iter().enumerate().filter_map(estimate).collect();
    Ok(Identified { estimates, windows: rows, unexplained })
}

impl Identified {
    /// Value and half width of a quantity; none where it is not known.
    #[must_use]
    pub fn of(&self, quantity: Quantity) -> Option<(f64, f64)> {
        self.estimates.iter().find(|estimate| estimate.quantity == quantity)?.value
    }
}

fn range(values: &[f64]) -> f64 {
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max) - least
}

#[expect(clippy::cast_precision_loss, reason = "ticks of an experiment")]
fn count(ticks: usize) -> f64 {
    ticks as f64
}

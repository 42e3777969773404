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
//! confidence, from what the windows leave unexplained: noise is in them, what is wrong all along is not. That the force is
//! recorded later than the position, by half a tick of sampling or an amplifier's lag, would be: it is estimated, too.
//!
//! Of joints that move each other, one is identified while the others are held. How much they give way when it pulls at them
//! is recorded, and explains its part of the force: each of them has the inertia that both share as a column, which gets no
//! estimate.
//!
//! A parameter that the motion cannot tell from the others gets no number.

mod least_squares;
mod response;
#[cfg(test)]
mod tests;
mod truth;
mod windows;

pub use response::{FrequencyPoint, ResponseTooShort, frequency_response};
pub use truth::{arm_truth, truth};

use windows::{WINDOW, Windows, count, travel};

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
    /// Positions of the joints that it moves and is moved by; none of a joint alone. Each as long as `position`.
    pub others: &'a [&'a [f64]],
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
    /// How much later than the position the force is recorded, beyond what was said, `s`: of sensors, of an amplifier.
    Lateness,
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
    /// Where the other joints were held, on average.
    pub others_at: Vec<f64>,
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

/// Windows for each parameter.
const WINDOWS_EACH: usize = 5;
/// How often the force's lateness is found anew, with the force moved by what is known of it.
const PASSES: usize = 3;

/// Estimates what a joint has.
///
/// # Errors
/// [`IdentifyError`] where the experiment cannot say.
pub fn identify(experiment: &Experiment<'_>) -> Result<Identified, IdentifyError> {
    let Experiment { position, force, turns, .. } = *experiment;
    let finite = |(position, force): (&f64, &f64)| position.is_finite() && force.is_finite();
    if let Some(tick) = position.iter().zip(force).position(|both| !finite(both)) {
        return Err(IdentifyError::NotFinite { tick });
    }
    if travel(position) <= 0.0 || travel(force) <= 0.0 {
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
            Quantity::Lateness,
        ],
        false => {
            &[Quantity::Inertia, Quantity::Viscous, Quantity::Coulomb, Quantity::Constant, Quantity::Lateness]
        }
    };
    let mut lateness_s = 0.0;
    let mut identified = pass(experiment, quantities, &mut lateness_s)?;
    for _ in 1..PASSES {
        identified = pass(experiment, quantities, &mut lateness_s)?;
    }
    Ok(identified)
}

/// Identifies with a force that is so late, and finds how much later it is.
fn pass(
    experiment: &Experiment<'_>,
    quantities: &[Quantity],
    lateness_s: &mut f64,
) -> Result<Identified, IdentifyError> {
    let Experiment { period_s, others, .. } = *experiment;
    let Windows { equations, others_at } = Windows::of(experiment, quantities, *lateness_s / period_s);
    let windows = equations.len();
    let needed = WINDOWS_EACH * (quantities.len() + others.len());
    if windows < needed {
        return Err(IdentifyError::TooShort { found: windows, needed, window_s: period_s * count(WINDOW) });
    }
    let (estimates, unexplained) = least_squares::solve(quantities, &equations)?;
    let mut identified = Identified { estimates, others_at, windows, unexplained };
    // What was estimated in the place of lateness is its product with the inertia.
    let inertia = identified.of(Quantity::Inertia).map_or(f64::NAN, |(inertia, _)| inertia);
    for estimate in &mut identified.estimates {
        if let (Quantity::Lateness, Some((value, half_width))) = (estimate.quantity, &mut estimate.value) {
            *lateness_s += *value / inertia;
            (*value, *half_width) = (*lateness_s, *half_width / inertia);
            estimate.value = estimate.value.filter(|(value, _)| value.is_finite());
        }
    }
    Ok(identified)
}

impl Identified {
    /// Value and half width of a quantity; none where it is not known.
    #[must_use]
    pub fn of(&self, quantity: Quantity) -> Option<(f64, f64)> {
        self.estimates.iter().find(|estimate| estimate.quantity == quantity)?.value
    }
}

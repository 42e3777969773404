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
//! confidence, from what the windows leave unexplained. The noise of the recorded positions, such as an encoder's steps, is
//! estimated and taken off. The force may be recorded later than the position, by half a tick of sampling, a filter or a bus:
//! the delay is the one that leaves least of the force unexplained.
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

use least_squares::Columns;
use windows::{LENGTHS, MARGIN, Windows, count, travel};

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

impl std::fmt::Display for Quantity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Inertia => "inertia",
            Self::Viscous => "viscous friction",
            Self::Coulomb => "Coulomb friction",
            Self::WeightSine => "weight with sin q",
            Self::WeightCosine => "weight with cos q",
            Self::Constant => "constant force",
            Self::Lateness => "delay of the force",
        })
    }
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
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
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
    /// The motion is the same for several quantities, or the position is too coarse.
    #[error("this motion cannot separate {}: sweep from slow to fast over a larger range, or record the position more finely", quantities.iter().map(Quantity::to_string).collect::<Vec<_>>().join(", "))]
    NotSeparable {
        /// Those without a value.
        quantities: Vec<Quantity>,
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
/// Longest delay of the force that is looked for, `s`.
const MAX_DELAY_S: f64 = 0.15;
/// Part of a tick that a delay is found to.
const DELAY_SHARE: f64 = 1e-3;

/// Estimates what a joint has.
///
/// # Errors
/// [`IdentifyError`] where the experiment cannot say.
pub fn identify(experiment: &Experiment<'_>) -> Result<Identified, IdentifyError> {
    let Experiment { period_s, position, force, turns, others, .. } = *experiment;
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
    let max_delay_ticks = libm::ceil(MAX_DELAY_S / period_s).min(count(position.len() / 8));
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "an eighth of the ticks at most"
    )]
    let margin = max_delay_ticks as usize + MARGIN;
    let needed = WINDOWS_EACH * (quantities.len() + others.len());
    let windows_of = |ticks| Windows::of(experiment, quantities, ticks, margin);
    let [long, short] = LENGTHS;
    let windows = Some(windows_of(long)).filter(|windows| windows.list.len() >= needed);
    let windows = windows.unwrap_or_else(|| windows_of(short));
    let found = windows.list.len();
    if found < needed {
        return Err(IdentifyError::TooShort { found, needed, window_s: period_s * count(windows.ticks) });
    }
    let columns = Columns::of(&windows)?;
    let unexplained = |delay_ticks: f64| columns.unexplained(&windows.forces(delay_ticks));
    let delay_ticks = minimum(max_delay_ticks, unexplained);
    let [before, at, behind] =
        [-DELAY_SHARE, 0.0, DELAY_SHARE].map(|away| windows.forces(delay_ticks + away));
    // A force that comes later by this is less by its rate.
    let slope: Vec<f64> = before
        .iter()
        .zip(&behind)
        .map(|(before, behind)| (before - behind) / (2.0 * DELAY_SHARE * period_s))
        .collect();
    let delay = (period_s * delay_ticks, &slope[..]);
    let (estimates, unexplained) = least_squares::solve(quantities, &windows, &columns, &at, delay)?;
    let identified = Identified { estimates, others_at: windows.others_at, windows: found, unexplained };
    let unknown = |estimate: &&Estimate| estimate.value.is_none();
    if identified.of(Quantity::Inertia).is_none() {
        let names = identified.estimates.iter().filter(unknown).map(|estimate| estimate.quantity);
        return Err(IdentifyError::NotSeparable { quantities: names.collect() });
    }
    Ok(identified)
}

/// Where `of` is smallest from `-max` to `max`: at a whole number first, then around it by golden sections.
fn minimum(max: f64, of: impl Fn(f64) -> f64) -> f64 {
    let (mut best, mut least, mut at) = (0.0, f64::INFINITY, -max);
    while at <= max {
        let value = of(at);
        if value < least {
            (best, least) = (at, value);
        }
        at += 1.0;
    }
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let (mut low, mut high) = (best - 1.0, best + 1.0);
    while high - low > DELAY_SHARE {
        let (one, other) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        if of(one) < of(other) { high = other } else { low = one }
    }
    0.5 * (low + high)
}

impl Identified {
    /// Value and half width of a quantity; none where it is not known.
    #[must_use]
    pub fn of(&self, quantity: Quantity) -> Option<(f64, f64)> {
        self.estimates.iter().find(|estimate| estimate.quantity == quantity)?.value
    }
}

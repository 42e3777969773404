//! Identification of a joint: inertia, friction, weight and frequency response from recorded data.
//!
//! ```text
//! J q'' + b q' + F_c sgn(q') + g_s sin q + g_c cos q + F_0 = F
//! ```
//!
//! Each time window gives one equation: the model is multiplied by `φ(t) = (t/T)⁶ (1 - t/T)⁶` and integrated, with
//! the derivatives moved to `φ` (modulating functions; M. Shinbrot, "On the analysis of linear and nonlinear
//! systems", Trans. ASME 79, 1957), so that neither speed nor acceleration is measured. Within a window the joint
//! moves in one direction and not slowly, as the model excludes friction near standstill. The estimate is least
//! squares with columns scaled to 1; intervals are 95 % confidence from the residuals. Position noise, such as
//! encoder quantisation, is estimated and compensated. The force can be recorded later than the position, by
//! sampling, filter or bus: the delay with the smallest residual is used.
//!
//! Coupled joints are identified one at a time while the others are held. The recorded motion of the held joints
//! explains its part of the force: each has a column with the shared inertia, without an estimate.
//!
//! A parameter that the motion cannot separate from the others has no estimate.

mod least_squares;
mod margins;
mod response;
#[cfg(test)]
mod tests;
mod truth;
mod windows;

pub use margins::{LoopMargins, loop_margins};
pub use response::{FrequencyPoint, ResponseTooShort, frequency_response};
pub use truth::{true_arm_joint_parameters, true_parameters};

use least_squares::Columns;
use windows::{LENGTHS, MARGIN, Windows, count, travel};

/// Recorded data of a joint, by tick.
#[derive(Debug, Clone, Copy)]
pub struct Experiment<'a> {
    /// Sample period, `s`.
    pub period_s: f64,
    /// `rad` or `m`.
    pub position: &'a [f64],
    /// Force on the joint, `N m` or `N`.
    pub force: &'a [f64],
    /// Force between two ticks.
    pub force_timing: ForceTiming,
    /// Whether it is rotary, with position-dependent weight.
    pub turns: bool,
    /// Positions of coupled joints, each as long as `position`; empty for a single joint.
    pub others: &'a [&'a [f64]],
}

/// Force between the recorded ticks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ForceTiming {
    /// Measured: interpolated linearly.
    Measured,
    /// Commanded: constant for one tick, this number of ticks later.
    Held {
        /// 0 or more.
        delay_ticks: f64,
    },
}

/// Estimated quantity.
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
    /// Additional delay of the recorded force, `s`: sensors, amplifier.
    Lateness,
}

impl Quantity {
    /// Returns the unit of the quantity for a rotary or linear joint.
    #[must_use]
    pub const fn unit(self, is_rotary: bool) -> &'static str {
        match (self, is_rotary) {
            (Self::Inertia, true) => "kg·m²",
            (Self::Inertia, false) => "kg",
            (Self::Viscous, true) => "N·m·s/rad",
            (Self::Viscous, false) => "N·s/m",
            (Self::Coulomb | Self::WeightSine | Self::WeightCosine | Self::Constant, true) => "N·m",
            (Self::Coulomb | Self::WeightSine | Self::WeightCosine | Self::Constant, false) => "N",
            (Self::Lateness, _) => "s",
        }
    }
}

impl std::fmt::Display for Quantity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Inertia => "inertia",
            Self::Viscous => "viscous friction",
            Self::Coulomb => "Coulomb friction",
            Self::WeightSine => "weight (sin q)",
            Self::WeightCosine => "weight (cos q)",
            Self::Constant => "constant force",
            Self::Lateness => "delay of the force",
        })
    }
}

/// An estimate.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Estimate {
    /// Quantity.
    pub quantity: Quantity,
    /// Value and half width of its 95 % confidence interval; `None` if not separable.
    pub value: Option<(f64, f64)>,
}

/// Identified joint.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct IdentifiedJoint {
    /// Estimates of all quantities.
    pub estimates: Vec<Estimate>,
    /// Mean positions of the held joints.
    pub others_at: Vec<f64>,
    /// Number of equations.
    pub windows: usize,
    /// RMS share of the force that the model does not explain.
    pub unexplained: f64,
}

/// Identification error.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum IdentifyError {
    /// NaN or infinite data.
    #[error("position or force at tick {tick} is NaN or infinite: correct the recording")]
    NotFinite {
        /// First invalid tick.
        tick: usize,
    },
    /// Constant position or force.
    #[error(
        "the joint's position or force does not change: excite it with a chirp or PRBS on its reference or force"
    )]
    NotExcited,
    /// Too few windows with motion in one direction.
    #[error(
        "only {found} intervals of {window_s} s with motion in one direction, {needed} required: record longer \
        or excite more slowly"
    )]
    TooShort {
        /// Available windows.
        found: usize,
        /// Required windows.
        needed: usize,
        /// Length of a window, `s`.
        window_s: f64,
    },
    /// Quantities not separable, or position too coarse.
    #[error("the recorded motion cannot separate the effects of {}: sweep over a wider frequency and position \
    range, or use a finer encoder", quantities.iter().map(Quantity::to_string).collect::<Vec<_>>().join(", "))]
    NotSeparable {
        /// Quantities without estimate.
        quantities: Vec<Quantity>,
    },
    /// The model does not fit the joint.
    #[error("inertia, friction and weight leave {:.0} % of the force unexplained: check for external forces, \
    flexibility, backlash, or a wrong force signal", 100.0 * unexplained)]
    Unexplained {
        /// RMS residual divided by RMS force.
        unexplained: f64,
    },
}

/// Minimum windows per parameter.
const WINDOWS_EACH: usize = 5;
/// Maximum delay of the force, `s`.
const MAX_DELAY_S: f64 = 0.15;
/// Resolution of the delay, ticks.
const DELAY_SHARE: f64 = 1e-3;

/// Estimates the parameters of a joint.
///
/// # Errors
/// [`IdentifyError`] if the data are insufficient.
pub fn identify(experiment: &Experiment<'_>) -> Result<IdentifiedJoint, IdentifyError> {
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
    // A delayed force is smaller by delay times its rate.
    let slope: Vec<f64> = before
        .iter()
        .zip(&behind)
        .map(|(before, behind)| (before - behind) / (2.0 * DELAY_SHARE * period_s))
        .collect();
    let delay = (period_s * delay_ticks, &slope[..]);
    let (estimates, unexplained) = least_squares::solve(quantities, &windows, &columns, &at, delay)?;
    let identified = IdentifiedJoint { estimates, others_at: windows.others_at, windows: found, unexplained };
    let unknown = |estimate: &&Estimate| estimate.value.is_none();
    if identified.of(Quantity::Inertia).is_none() {
        let names = identified.estimates.iter().filter(unknown).map(|estimate| estimate.quantity);
        return Err(IdentifyError::NotSeparable { quantities: names.collect() });
    }
    Ok(identified)
}

/// Minimum of `of` from `-max` to `max`: integers first, then golden-section search.
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

impl IdentifiedJoint {
    /// Returns value and half width of a quantity; `None` if unknown.
    #[must_use]
    pub fn of(&self, quantity: Quantity) -> Option<(f64, f64)> {
        self.estimates.iter().find(|estimate| estimate.quantity == quantity)?.value
    }
}

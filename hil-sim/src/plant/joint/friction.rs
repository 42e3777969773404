//! Friction at the output: Coulomb with Stribeck effect and viscous, without or with presliding (`LuGre`).
//!
//! `g(v) = Fc + (Fs - Fc) exp(-(v/vs)²)`. Dry: `F = sgn(v) g(v) + σ2 v`, and up to `Fs` at rest.
//! `LuGre`: `z' = v - σ0 |v| z / g(v)`, `F = σ0 z + σ1 z' + σ2 v` (Canudas de Wit, Olsson, Åström, Lischinsky, "A new
//! model for control of systems with friction", IEEE Trans. Automatic Control 40(3), 1995).

use crate::plant::parameter::{ParameterError, not_negative, positive, require};
use serde::{Deserialize, Serialize};

/// Multiple of the Stribeck velocity above which the Stribeck effect is negligible: `e^(-6.5²)`.
const PAST_DIP: f64 = 6.5;

/// Friction at the output. Units of a rotary output; of a linear output in parentheses.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct FrictionParameters {
    /// `Fc`, `N m` (`N`), >= 0.
    pub coulomb: f64,
    /// `Fs`, `N m` (`N`), >= `coulomb`; 0: equal to `coulomb`.
    pub breakaway: f64,
    /// `vs`, Stribeck velocity, `rad/s` (`m/s`), > 0.
    pub stribeck_velocity: f64,
    /// `σ2`, `N m s/rad` (`N s/m`), >= 0.
    pub viscous: f64,
    /// `σ0`, `N m/rad` (`N/m`), >= 0; > 0: `LuGre` friction, 0: Coulomb friction.
    pub presliding_stiffness: f64,
    /// `σ1`, `N m s/rad` (`N s/m`), >= 0; only with `presliding_stiffness`.
    pub presliding_damping: f64,
}

impl Default for FrictionParameters {
    /// No friction; a Stribeck velocity of 0.01.
    fn default() -> Self {
        Self {
            coulomb: 0.0,
            breakaway: 0.0,
            stribeck_velocity: 0.01,
            viscous: 0.0,
            presliding_stiffness: 0.0,
            presliding_damping: 0.0,
        }
    }
}

impl FrictionParameters {
    pub(super) fn check(&self) -> Result<(), ParameterError> {
        not_negative("coulomb", self.coulomb)?;
        not_negative("breakaway", self.breakaway)?;
        let is_ordered = self.breakaway <= 0.0 || self.breakaway >= self.coulomb;
        require("breakaway", self.breakaway, is_ordered, ">= `coulomb`, or 0")?;
        positive("stribeck_velocity", self.stribeck_velocity)?;
        not_negative("viscous", self.viscous)?;
        not_negative("presliding_stiffness", self.presliding_stiffness)?;
        not_negative("presliding_damping", self.presliding_damping)?;
        if self.has_presliding() {
            return require("coulomb", self.coulomb, self.coulomb > 0.0, "> 0 with `presliding_stiffness`");
        }
        let allowed = "0 without `presliding_stiffness`";
        require("presliding_damping", self.presliding_damping, self.presliding_damping <= 0.0, allowed)
    }

    pub(super) fn has_presliding(&self) -> bool {
        self.presliding_stiffness > 0.0
    }

    /// Whether it can hold the output at rest.
    pub(super) fn is_dry(&self) -> bool {
        !self.has_presliding() && self.level(0.0) > 0.0
    }

    /// `g(v)`, `N m` or `N`.
    pub(super) fn level(&self, velocity: f64) -> f64 {
        let share = velocity / self.stribeck_velocity;
        if self.breakaway <= self.coulomb || share.abs() > PAST_DIP {
            return self.coulomb;
        }
        if share.abs() <= 0.0 {
            return self.breakaway;
        }
        self.coulomb + (self.breakaway - self.coulomb) * libm::exp(-share * share)
    }

    /// Maximum negative slope of the Stribeck curve, `N m s/rad` or `N s/m`; that of `exp(-(v/vs)²)` is
    /// `sqrt(2/e)/vs`.
    pub(super) fn steepest(&self) -> f64 {
        let dip = (self.breakaway - self.coulomb).max(0.0) / self.stribeck_velocity;
        (2.0 / core::f64::consts::E).sqrt() * dip
    }

    /// Friction force against the motion, and rate of the bristle deflection. `direction` is the sliding direction,
    /// -1, 0 or 1.
    ///
    /// The settling rate of the bristles is limited to `fastest_per_s`, as it increases with the speed and an
    /// explicit step can follow only up to a limit. Their steady state is unchanged.
    pub(super) fn resist(
        &self,
        direction: f64,
        velocity: f64,
        deflection: f64,
        fastest_per_s: f64,
    ) -> (f64, f64) {
        let viscous = self.viscous * velocity;
        if !self.has_presliding() {
            return (direction * self.level(velocity) + viscous, 0.0);
        }
        let level = self.level(velocity);
        let settling_per_s = self.presliding_stiffness * velocity.abs() / level;
        let slow_down = (fastest_per_s / settling_per_s).min(1.0);
        let rate = slow_down * (velocity - settling_per_s * deflection);
        let resistance = self.presliding_stiffness * deflection + self.presliding_damping * rate + viscous;
        (resistance, rate)
    }
}

//! Friction of a joint: viscous, dry with Stribeck's dip, or `LuGre`.
//!
//! Dry: `F = sgn(v) (Fc + (Fs - Fc) exp(-(v/vs)²))`, and up to `Fs` at rest. `LuGre` (Canudas de Wit, Olsson, Åström and
//! Lischinsky, IEEE TAC 40(3), 1995): bristles bend by `z' = v - σ0 |v| z / g(v)`, with the dry curve as `g`, and
//! `F = σ0 z + σ1 z'`; the viscous part is a key of its own.

use serde::{Deserialize, Serialize};

use crate::plant::parameter::{ParameterError, not_negative, positive, require};

/// At the load. Units are of an output that turns, then of one that slides.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct FrictionParameters {
    /// `N m s/rad` or `N s/m`, >= 0.
    pub viscous: f64,
    /// `Fc`: while it slides, `N m` or `N`, >= 0.
    pub coulomb: f64,
    /// `Fs`: at rest, `N m` or `N`; left out, or less than `coulomb`, it is `coulomb`.
    pub breakaway: f64,
    /// `vs`: how fast the dip is over, `rad/s` or `m/s`; needed where `breakaway` is more.
    pub stribeck_velocity: f64,
    /// Bristles instead of dry friction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lugre: Option<LuGreParameters>,
}

/// Bristles between two surfaces.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LuGreParameters {
    /// `σ0`, `N m/rad` or `N/m`, > 0.
    pub stiffness: f64,
    /// `σ1`, `N m s/rad` or `N s/m`, >= 0.
    #[serde(default)]
    pub damping: f64,
}

impl FrictionParameters {
    pub(super) fn check(&self) -> Result<(), ParameterError> {
        not_negative("viscous", self.viscous)?;
        not_negative("coulomb", self.coulomb)?;
        not_negative("breakaway", self.breakaway)?;
        not_negative("stribeck_velocity", self.stribeck_velocity)?;
        let has_speed = self.breakaway <= self.coulomb || self.stribeck_velocity > 0.0;
        require(
            "stribeck_velocity",
            self.stribeck_velocity,
            has_speed,
            "> 0, where breakaway is above coulomb",
        )?;
        if let Some(lugre) = &self.lugre {
            positive("lugre.stiffness", lugre.stiffness)?;
            not_negative("lugre.damping", lugre.damping)?;
            positive("coulomb", self.coulomb)?;
        }
        Ok(())
    }

    /// Dry friction at a speed, >= 0; the most that it holds, at 0.
    pub(super) fn dry(&self, speed: f64) -> f64 {
        let dip = self.breakaway - self.coulomb;
        if dip <= 0.0 {
            return self.coulomb;
        }
        let share = speed / self.stribeck_velocity;
        self.coulomb + dip * libm::exp(-share * share)
    }
}

impl LuGreParameters {
    /// Against the motion, over a time in which the velocity hardly changes; bends the bristles, stably for any time.
    pub(super) fn force(
        &self,
        bristle: &mut f64,
        velocity: f64,
        time_s: f64,
        dry: &FrictionParameters,
    ) -> f64 {
        let rate = self.stiffness * velocity.abs() / dry.dry(velocity.abs());
        let bent = (*bristle + time_s * velocity) / (1.0 + time_s * rate);
        let bends = (bent - *bristle) / time_s;
        *bristle = bent;
        self.stiffness * bent + self.damping * bends
    }
}

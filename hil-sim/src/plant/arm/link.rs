//! One link of an arm: its joint, its body, its actuator.

use crate::plant::coupled::Actuator;
use crate::plant::joint::StopsParameters;
use crate::plant::parameter::{ParameterError, finite, not_negative, positive_or_infinite, require};
use serde::{Deserialize, Serialize};

/// Share of the largest that rounding may take a moment of inertia below what it must be.
const ROUNDING: f64 = 1e-9;

/// How a joint moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LinkKind {
    /// Turns about its z.
    Revolute,
    /// Slides along its z.
    Prismatic,
}

/// A link and the joint that it sits on. Units of a joint that turns; of one that slides in parentheses.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LinkParameters {
    /// How the joint moves.
    pub kind: LinkKind,
    /// From the z of the link before to the z of this one, along the x of the link before, `m`.
    #[serde(default)]
    pub a_m: f64,
    /// From the z of the link before to the z of this one, about the x of the link before, `rad`.
    #[serde(default)]
    pub alpha_rad: f64,
    /// Along this z, `m`; the position of a joint that slides is added.
    #[serde(default)]
    pub d_m: f64,
    /// About this z, `rad`; the position of a joint that turns is added.
    #[serde(default)]
    pub theta_rad: f64,
    /// `kg`, >= 0.
    pub mass_kg: f64,
    /// In the frame of this link, `m`.
    #[serde(default)]
    pub centre_of_mass_m: [f64; 3],
    /// About the centre of mass, along the axes of this link's frame: `[xx, yy, zz, xy, xz, yz]`, `kg m²`. The last
    /// three are the off-diagonal entries of the matrix as they stand there: `xy = -∫ x y dm`.
    #[serde(default)]
    pub inertia_kg_m2: [f64; 6],
    /// Of motor and gear, seen from the joint, `kg m²` (`kg`), >= 0.
    #[serde(default)]
    pub motor_inertia: f64,
    /// Viscous friction of the joint, `N m s/rad` (`N s/m`), >= 0.
    #[serde(default)]
    pub viscous: f64,
    /// Dry friction of the joint, sliding and at rest, `N m` (`N`), >= 0.
    #[serde(default)]
    pub coulomb: f64,
    /// At the start, at rest, `rad` (`m`).
    #[serde(default)]
    pub start_position: f64,
    /// Most that the actuator applies, `N m` (`N`), > 0; without it, no limit.
    #[serde(default = "unlimited")]
    pub effort_limit: f64,
    /// Ends of the travel; without them, none.
    #[serde(default)]
    pub stops: Option<StopsParameters>,
}

fn unlimited() -> f64 {
    f64::INFINITY
}

impl LinkParameters {
    /// A link of this mass and centre of mass whose joint is where that of the link before is.
    #[must_use]
    pub fn new(kind: LinkKind, mass_kg: f64, centre_of_mass_m: [f64; 3]) -> Self {
        Self {
            kind,
            a_m: 0.0,
            alpha_rad: 0.0,
            d_m: 0.0,
            theta_rad: 0.0,
            mass_kg,
            centre_of_mass_m,
            inertia_kg_m2: [0.0; 6],
            motor_inertia: 0.0,
            viscous: 0.0,
            coulomb: 0.0,
            start_position: 0.0,
            effort_limit: unlimited(),
            stops: None,
        }
    }

    pub(super) fn linear(&self) -> Self {
        Self { coulomb: 0.0, stops: None, ..self.clone() }
    }

    pub(super) fn check(&self) -> Result<(), ParameterError> {
        finite("a_m", self.a_m)?;
        finite("alpha_rad", self.alpha_rad)?;
        finite("d_m", self.d_m)?;
        finite("theta_rad", self.theta_rad)?;
        not_negative("mass_kg", self.mass_kg)?;
        for (index, value) in self.centre_of_mass_m.iter().enumerate() {
            finite(&format!("centre_of_mass_m[{index}]"), *value)?;
        }
        self.check_inertia()?;
        not_negative("motor_inertia", self.motor_inertia)?;
        not_negative("viscous", self.viscous)?;
        not_negative("coulomb", self.coulomb)?;
        finite("start_position", self.start_position)?;
        positive_or_infinite("effort_limit", self.effort_limit)?;
        if let Some(stops) = &self.stops {
            stops.check().map_err(|error| error.within("stops"))?;
        }
        // Then no motion of the arm is without kinetic energy: the first joint that moves moves its own link.
        let moved = self.motor_inertia + self.own_inertia();
        let allowed = "> 0, unless the link itself has inertia along its joint";
        require("motor_inertia", self.motor_inertia, moved > 0.0, allowed)
    }

    /// Whether masses can be spread so: the second moments `∫ x²`, `∫ x y`, … form a matrix that is not negative.
    fn check_inertia(&self) -> Result<(), ParameterError> {
        let [xx, yy, zz, xy, xz, yz] = self.inertia_kg_m2;
        for (index, value) in self.inertia_kg_m2.iter().enumerate() {
            finite(&format!("inertia_kg_m2[{index}]"), *value)?;
        }
        let half = 0.5 * (xx + yy + zz);
        let (x, y, z) = (half - xx, half - yy, half - zz);
        let determinant = x * (y * z - yz * yz) + xy * (-xy * z - yz * xz) - xz * (xy * yz + y * xz);
        let rounding = ROUNDING * half;
        let moments = [
            (x, rounding, "moments that no two of them are less than the third"),
            (y, rounding, "moments that no two of them are less than the third"),
            (z, rounding, "moments that no two of them are less than the third"),
            (x * y - xy * xy, rounding * half, "an xy that its moments allow"),
            (x * z - xz * xz, rounding * half, "an xz that its moments allow"),
            (y * z - yz * yz, rounding * half, "a yz that its moments allow"),
            (determinant, rounding * half * half, "what a body of masses can have"),
        ];
        for (index, (moment, rounding, allowed)) in moments.into_iter().enumerate() {
            let index = index.min(5);
            let value = self.inertia_kg_m2.get(index).copied().unwrap_or_default();
            require(&format!("inertia_kg_m2[{index}]"), value, moment >= -rounding, allowed)?;
        }
        Ok(())
    }

    /// Inertia of the link alone against its own joint.
    fn own_inertia(&self) -> f64 {
        let ([x, y, _], [_, _, zz, ..]) = (self.centre_of_mass_m, self.inertia_kg_m2);
        match self.kind {
            LinkKind::Revolute => zz + self.mass_kg * (x * x + y * y),
            LinkKind::Prismatic => self.mass_kg,
        }
    }

    pub(super) fn actuator(&self, path: &str) -> Actuator {
        Actuator {
            viscous_path: format!("{path}.viscous"),
            inertia: self.motor_inertia,
            viscous: self.viscous,
            coulomb: self.coulomb,
            effort_limit: self.effort_limit,
            start_position: self.start_position,
        }
    }
}

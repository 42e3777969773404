//! One link of an arm: its joint, its body, its actuator.

use crate::plant::coupled::Actuator;
use crate::plant::joint::StopsParameters;
use crate::plant::parameter::{ParameterError, finite, not_negative, positive_or_infinite, require};
use serde::{Deserialize, Serialize};

/// Relative tolerance of moments of inertia for rounding.
const ROUNDING: f64 = 1e-9;

/// Joint type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LinkKind {
    /// Rotates about its z.
    Revolute,
    /// Translates along its z.
    Prismatic,
}

/// A link and its joint. Units of a revolute joint; those of a prismatic joint in parentheses.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LinkParameters {
    /// Joint type.
    pub kind: LinkKind,
    /// Distance between the z axes of the previous link and this link, along the previous x, `m`.
    #[serde(default)]
    pub a_m: f64,
    /// Angle between the z axes of the previous link and this link, about the previous x, `rad`.
    #[serde(default)]
    pub alpha_rad: f64,
    /// Offset along this z, `m`; a prismatic joint adds its position.
    #[serde(default)]
    pub d_m: f64,
    /// Angle about this z, `rad`; a revolute joint adds its position.
    #[serde(default)]
    pub theta_rad: f64,
    /// Mass, `kg`, >= 0.
    pub mass_kg: f64,
    /// Centre of mass in the frame of this link, `m`.
    #[serde(default)]
    pub centre_of_mass_m: [f64; 3],
    /// Inertia about the centre of mass in the axes of this link's frame: `[xx, yy, zz, xy, xz, yz]`, `kg m²`. The
    /// last three are the off-diagonal matrix entries: `xy = -∫ x y dm`.
    #[serde(default)]
    pub inertia_kg_m2: [f64; 6],
    /// Inertia of motor and gear at the joint, `kg m²` (`kg`), >= 0.
    #[serde(default)]
    pub motor_inertia: f64,
    /// Viscous friction of the joint, `N m s/rad` (`N s/m`), >= 0.
    #[serde(default)]
    pub viscous: f64,
    /// Coulomb friction of the joint, `N m` (`N`), >= 0.
    #[serde(default)]
    pub coulomb: f64,
    /// Start position, `rad` (`m`).
    #[serde(default)]
    pub start_position: f64,
    /// Maximum torque (force) of the actuator, `N m` (`N`), > 0; default: unlimited.
    #[serde(default = "unlimited")]
    pub effort_limit: f64,
    /// End stops; default: none.
    #[serde(default)]
    pub stops: Option<StopsParameters>,
}

fn unlimited() -> f64 {
    f64::INFINITY
}

impl LinkParameters {
    /// Creates a link with this mass and centre of mass, with its joint at that of the previous link.
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
            stops.check().map_err(|error| error.with_path_prefix("stops"))?;
        }
        // Every motion then has kinetic energy: the first moving joint moves its own link.
        let moved = self.motor_inertia + self.own_inertia();
        let allowed = "> 0 unless the link has inertia along its joint";
        require("motor_inertia", self.motor_inertia, moved > 0.0, allowed)
    }

    /// Checks that the inertia is physically possible: the matrix of second moments `∫ x²`, `∫ x y`, … is positive
    /// semidefinite.
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
            (x, rounding, "such that the sum of any two moments is at least the third"),
            (y, rounding, "such that the sum of any two moments is at least the third"),
            (z, rounding, "such that the sum of any two moments is at least the third"),
            (x * y - xy * xy, rounding * half, "within the range that the moments allow for xy"),
            (x * z - xz * xz, rounding * half, "within the range that the moments allow for xz"),
            (y * z - yz * yz, rounding * half, "within the range that the moments allow for yz"),
            (determinant, rounding * half * half, "such that the inertia matrix is physically possible"),
        ];
        for (index, (moment, rounding, allowed)) in moments.into_iter().enumerate() {
            let index = index.min(5);
            let value = self.inertia_kg_m2.get(index).copied().unwrap_or_default();
            require(&format!("inertia_kg_m2[{index}]"), value, moment >= -rounding, allowed)?;
        }
        Ok(())
    }

    /// Inertia of the link about its own joint.
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

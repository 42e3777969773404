//! Parameters of the plants, as a scenario names them.

use serde::{Deserialize, Serialize};

/// One axis of a device, seen at its tip.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct DeviceParameters {
    /// Moving mass, `kg`, > 0.
    pub mass_kg: f64,
    /// Viscous damping to ground, `N s/m`, >= 0.
    pub damping_ns_per_m: f64,
    /// Coulomb friction, `N`, >= 0.
    pub coulomb_friction_n: f64,
    /// Length of one encoder count, `m`, >= 0; 0 is an ideal sensor.
    pub encoder_step_m: f64,
    /// Where the axis stands at the start, `m`, at rest.
    pub start_position_m: f64,
}

/// A DC motor with its current loop.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct MotorParameters {
    /// `R`, > 0.
    pub resistance_ohm: f64,
    /// `L`, `H`, > 0.
    pub inductance_h: f64,
    /// `Kt = Ke`, `N m/A`, > 0.
    pub torque_constant_nm_per_a: f64,
    /// `J`, `kg m²`, >= 0.
    pub rotor_inertia_kg_m2: f64,
    /// Rotor angle per tip motion, `rad/m`, > 0.
    pub transmission_rad_per_m: f64,
    /// Bandwidth of the current loop, `rad/s`, > 0.
    pub current_bandwidth_rad_per_s: f64,
    /// Largest voltage either way, `V`, > 0; `inf` for none.
    pub voltage_limit_v: f64,
}

/// What a hand does from `start_s` to `end_s`, `s`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(tag = "action", rename_all = "snake_case", deny_unknown_fields)]
pub enum HandPhase {
    /// Moves the target of its spring from `from_m` to `to_m` with the least jerk.
    #[expect(missing_docs, reason = "the fields say it in their names, and in the line above")]
    Move { start_s: f64, end_s: f64, from_m: f64, to_m: f64 },
    /// Keeps the target at `target_m`.
    #[expect(missing_docs, reason = "the fields say it in their names, and in the line above")]
    Hold { start_s: f64, end_s: f64, target_m: f64 },
    /// Pushes with `force_n`, the spring off.
    #[expect(missing_docs, reason = "the fields say it in their names, and in the line above")]
    Push { start_s: f64, end_s: f64, force_n: f64 },
    /// Lets go: neither spring nor push.
    #[expect(missing_docs, reason = "the fields say it in their names, and in the line above")]
    Release { start_s: f64, end_s: f64 },
}

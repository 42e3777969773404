//! A DC motor with a current loop, between a commanded force and the applied one.
//!
//! `L di/dt = V - R i - Ke w`, `F = Kt N i`, `w = N v`, `Ke = Kt` (SI), `N` the transmission in `rad/m`.
//! The current controller is a PI by pole cancellation (`Kp = wc L`, `Ki = wc R`) with the back-EMF fed forward.
//! Its integrator state is `R i` and stays so, also through saturation (ideal anti-windup), hence
//! `V = R i + wc L (i_ref - i) + Ke w`, limited to `±voltage_limit_v`; unlimited, `i/i_ref = wc/(s + wc)` exactly.

use super::parameter::{ParameterError, not_negative, positive, positive_or_infinite};
use serde::{Deserialize, Serialize};

/// One motor, its amplifier and its transmission.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct MotorParameters {
    /// `R`, > 0.
    pub resistance_ohm: f64,
    /// `L`, `H`, > 0.
    pub inductance_h: f64,
    /// `Kt = Ke`, `N m/A` = `V s/rad`, > 0.
    pub torque_constant_nm_per_a: f64,
    /// Rotor inertia, `kg m²`, >= 0; the axis feels it as `J N²`.
    pub rotor_inertia_kg_m2: f64,
    /// `N`: rotor angle per tip motion, `rad/m`, > 0. For a rotary axis in `rad` and `N m`, the gear ratio.
    pub transmission_rad_per_m: f64,
    /// `wc`, bandwidth of the current loop, `rad/s`, > 0.
    pub current_bandwidth_rad_per_s: f64,
    /// Largest voltage either way, `V`, > 0; `inf` for none.
    pub voltage_limit_v: f64,
}

impl Default for MotorParameters {
    /// A `PHANToM` Premium 1.5 axis. Torque constant, rotor inertia and gear ratio (11.2 over a 0.215 m link) from
    /// public models of the device; resistance and inductance those of a Maxon RE25, unverified; 24 V and a 1 kHz
    /// current loop are placeholders.
    fn default() -> Self {
        Self {
            resistance_ohm: 2.32,
            inductance_h: 2.38e-4,
            torque_constant_nm_per_a: 0.0234,
            rotor_inertia_kg_m2: 1.08e-6,
            transmission_rad_per_m: 11.2 / 0.215,
            current_bandwidth_rad_per_s: core::f64::consts::TAU * 1000.0,
            voltage_limit_v: 24.0,
        }
    }
}

impl MotorParameters {
    /// Says whether a motor like this can exist.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn check(&self) -> Result<(), ParameterError> {
        positive("resistance_ohm", self.resistance_ohm)?;
        positive("inductance_h", self.inductance_h)?;
        positive("torque_constant_nm_per_a", self.torque_constant_nm_per_a)?;
        not_negative("rotor_inertia_kg_m2", self.rotor_inertia_kg_m2)?;
        positive("transmission_rad_per_m", self.transmission_rad_per_m)?;
        positive("current_bandwidth_rad_per_s", self.current_bandwidth_rad_per_s)?;
        positive_or_infinite("voltage_limit_v", self.voltage_limit_v)
    }
}

/// The electrical side of a motor, as it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorTruth {
    /// Winding current, `A`.
    pub current_a: f64,
    /// Terminal voltage, `V`.
    pub voltage_v: f64,
}

/// Whether the amplifier can give the voltage that its current loop asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Supply {
    /// It can.
    #[default]
    Follows,
    /// It gives its largest positive voltage.
    Upper,
    /// It gives its largest negative voltage.
    Lower,
}

/// A motor, reduced to what its axis integrates: `F' = ... - decay F - counter v`.
#[derive(Debug, Clone)]
pub(super) struct Motor {
    parameters: MotorParameters,
    /// `Kt N`, `N/A`.
    force_per_current: f64,
    /// `Kt N / L`: how fast a volt builds up force, `N/(V s)`.
    force_rate_per_volt: f64,
}

impl Motor {
    pub(super) fn new(parameters: &MotorParameters) -> Result<Self, ParameterError> {
        parameters.check()?;
        let force_per_current = parameters.torque_constant_nm_per_a * parameters.transmission_rad_per_m;
        let force_rate_per_volt = force_per_current / parameters.inductance_h;
        Ok(Self { parameters: parameters.clone(), force_per_current, force_rate_per_volt })
    }

    /// Rotor inertia as the axis feels it, `kg`.
    pub(super) fn referred_mass_kg(&self) -> f64 {
        let transmission = self.parameters.transmission_rad_per_m;
        self.parameters.rotor_inertia_kg_m2 * transmission * transmission
    }

    /// What happens to the force (`N`) now: the supply's state and the force's rate of change, `N/s`.
    #[inline]
    pub(super) fn drive(&self, command_n: f64, force_n: f64, velocity_m_per_s: f64) -> (Supply, f64) {
        let wanted_rate = self.parameters.current_bandwidth_rad_per_s * (command_n - force_n);
        let lost_v = self.lost_v(force_n, velocity_m_per_s);
        let wanted_v = wanted_rate / self.force_rate_per_volt + lost_v;
        let limit_v = self.parameters.voltage_limit_v;
        if wanted_v > limit_v {
            (Supply::Upper, self.force_rate_per_volt * (limit_v - lost_v))
        } else if wanted_v < -limit_v {
            (Supply::Lower, self.force_rate_per_volt * (-limit_v - lost_v))
        } else {
            (Supply::Follows, wanted_rate)
        }
    }

    /// `(decay_per_s, counter_n_per_m)` of the regime that `supply` stands for.
    pub(super) fn feedback(&self, supply: Supply) -> (f64, f64) {
        match supply {
            Supply::Follows => (self.parameters.current_bandwidth_rad_per_s, 0.0),
            Supply::Upper | Supply::Lower => (
                self.parameters.resistance_ohm / self.parameters.inductance_h,
                self.force_rate_per_volt * self.force_per_current,
            ),
        }
    }

    /// The electrical side at applied force `force_n` (`N`).
    pub(super) fn truth(&self, command_n: f64, force_n: f64, velocity_m_per_s: f64) -> MotorTruth {
        let (_, rate) = self.drive(command_n, force_n, velocity_m_per_s);
        MotorTruth {
            current_a: force_n / self.force_per_current,
            voltage_v: rate / self.force_rate_per_volt + self.lost_v(force_n, velocity_m_per_s),
        }
    }

    /// Resistive drop and back-EMF, `V`: `R i + Ke w`, and `Ke N = Kt N`.
    #[inline]
    fn lost_v(&self, force_n: f64, velocity_m_per_s: f64) -> f64 {
        self.parameters.resistance_ohm * (force_n / self.force_per_current)
            + self.force_per_current * velocity_m_per_s
    }
}

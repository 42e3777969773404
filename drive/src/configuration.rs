//! Configuration of a drive: motor, encoder, joint, limits and inverter.

use core::f32::consts::{FRAC_PI_4, PI};
use core::fmt;

use crate::encoder::{As5047p, As5600, Mt6701};
use crate::vector::Dq;

/// Poles of the observer of angle and speed, `rad/s`.
pub(crate) const TRACKING_RAD_PER_S: f32 = 2_000.0;
/// Delay from a sample to the middle of the period in which its voltage is applied, the next one.
pub(crate) const PERIODS_TO_VOLTAGE: f32 = 1.5;
/// Maximum of observer bandwidth times period, `rad`; unstable above 0.8.
const MAX_TRACKING_SHARE: f32 = 0.301;

/// A permanent-magnet motor with three phases.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Motor {
    /// Phase resistance `R`, `ohm`, > 0: half of the value measured between two leads.
    pub resistance_ohm: f32,
    /// d-axis inductance `L_d`, `H`, > 0.
    pub direct_inductance_h: f32,
    /// q-axis inductance `L_q`, `H`, > 0.
    pub quadrature_inductance_h: f32,
    /// Flux linkage `ψ`, peak per phase, `V s` per electrical radian, > 0. Its relative error is that of the torque.
    pub flux_linkage_vs: f32,
    /// Number of pole pairs `p`, > 0.
    pub pole_pairs: u8,
    /// Whether the encoder counts against the direction of the phases; it is then inverted.
    pub is_encoder_reversed: bool,
    /// Mechanical encoder angle, after inversion, at which the magnets align with phase U, `rad`, -π to π.
    pub encoder_offset_rad: f32,
}

/// Limits of motor and inverter; exceeding most of them turns the bridge off.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Limits {
    /// Maximum commanded current, peak of a phase, `A`, > 0.
    pub current_a: f32,
    /// Phase current that trips the drive, `A`, above `current_a`.
    pub trip_current_a: f32,
    /// Minimum supply voltage, `V`, > 0.
    pub min_bus_v: f32,
    /// Maximum supply voltage, `V`, above the minimum; braking raises it.
    pub max_bus_v: f32,
    /// Temperature above which the current limit is reduced, `°C`.
    pub derating_c: f32,
    /// Temperature at which the drive trips, `°C`, above `derating_c`.
    pub trip_c: f32,
    /// Maximum rotor speed, `rad/s`, > 0. A larger change of the encoder angle is rejected.
    pub speed_rad_per_s: f32,
    /// Maximum time at standstill with full `current_a`, `s`, > 0; longer at less current, unlimited at half. Infinity
    /// disables the check.
    pub stall_s: f32,
}

/// Encoder of the rotor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)
)]
pub enum Encoder {
    /// Quadrature encoder, channels A and B; its angle is relative to power-up.
    Incremental {
        /// Counts per turn, all four edges, 2 to 65 536.
        counts_per_turn: u32,
    },
    /// See [`As5047p`].
    As5047p,
    /// See [`Mt6701`].
    Mt6701,
    /// See [`As5600`].
    As5600,
}

/// Joint driven by the rotor.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Joint {
    /// Rotor turns per joint turn, 0.001 to 10 000; negative for opposite directions.
    pub gear_ratio: f32,
    /// Joint angle at the encoder's zero, `rad`, -100 to 100; for an incremental encoder, the angle at power-up.
    pub zero_rad: f32,
}

/// Half bridges of a board, independent of the motor.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Inverter {
    /// PWM period and period of the control loop, `s`, > 0, up to 150 µs.
    pub period_s: f32,
    /// Dead time per edge as a share of the period, 0 to 0.2.
    pub dead_time_share: f32,
    /// Current below which the dead-time effect is proportional to the current, `A`, > 0.
    pub dead_time_current_a: f32,
    /// Maximum duty cycle, 0.6 to 1: low-side current sensing needs the rest.
    pub max_duty: f32,
}

/// Configuration of a drive.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Configuration {
    /// Bandwidth of the current loops `wc`, `rad/s`, > 0, up to a third of `1/period_s`.
    pub bandwidth_rad_per_s: f32,
    /// Current that turns the rotor during alignment, `A`, > 0, up to `limits.current_a`.
    pub aligning_current_a: f32,
    /// Motor.
    pub motor: Motor,
    /// Encoder.
    pub encoder: Encoder,
    /// Joint.
    pub joint: Joint,
    /// Limits of motor and inverter.
    pub limits: Limits,
    /// Inverter.
    pub inverter: Inverter,
}

/// A configuration value out of range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConfigurationError {
    /// Name of the value.
    pub name: &'static str,
    /// The value.
    pub value: f32,
    /// Valid range.
    pub range: &'static str,
}

impl fmt::Display for ConfigurationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} is {}: must be {}", self.name, self.value, self.range)
    }
}

impl core::error::Error for ConfigurationError {}

impl Motor {
    /// Returns the torque constant `3/2 p ψ`, `N m/A`: torque per q-axis current.
    #[must_use]
    pub const fn torque_constant_nm_per_a(&self) -> f32 {
        1.5 * self.pole_pairs as f32 * self.flux_linkage_vs
    }

    /// Returns the torque for currents in `A`, `N m`: `3/2 p (ψ i_q + (L_d - L_q) i_d i_q)`.
    #[must_use]
    pub fn torque_nm(&self, Dq { d, q }: Dq) -> f32 {
        let saliency_h = self.direct_inductance_h - self.quadrature_inductance_h;
        1.5 * f32::from(self.pole_pairs) * (self.flux_linkage_vs + saliency_h * d) * q
    }
}

impl Encoder {
    /// Returns the counts per turn of the rotor.
    #[must_use]
    pub const fn counts_per_turn(&self) -> u32 {
        match self {
            Self::Incremental { counts_per_turn } => *counts_per_turn,
            Self::As5047p => As5047p::COUNTS_PER_TURN,
            Self::Mt6701 => Mt6701::COUNTS_PER_TURN,
            Self::As5600 => As5600::COUNTS_PER_TURN,
        }
    }

    /// Checks whether the encoder is absolute.
    #[must_use]
    pub const fn is_absolute(&self) -> bool {
        !matches!(self, Self::Incremental { .. })
    }
}

/// A validated configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ValidConfiguration(Configuration);

impl ValidConfiguration {
    /// Returns the configuration.
    #[must_use]
    pub const fn get(&self) -> &Configuration {
        &self.0
    }
}

/// Returns the error of an invalid value.
macro_rules! require {
    ($place:ident $(. $part:ident)*, $is_right:expr, $range:literal) => {
        let is_right: bool = $is_right;
        if !is_right {
            let name = require!(@name $place $(. $part)*);
            return Err(ConfigurationError { name, value: $place $(. $part)* as f32, range: $range });
        }
    };
    (@name $place:ident . $one:ident) => { stringify!($one) };
    (@name $place:ident . $one:ident . $two:ident) => { concat!(stringify!($one), ".", stringify!($two)) };
}

const fn is_above(value: f32, least: f32) -> bool {
    value > least && value.is_finite()
}

const fn is_positive(value: f32) -> bool {
    value > 0.0 && value.is_normal()
}

impl Configuration {
    /// Validates the configuration.
    ///
    /// # Errors
    /// Returns the first value out of range.
    pub const fn check(&self) -> Result<(), ConfigurationError> {
        match self.checked() {
            Ok(_) => Ok(()),
            Err(error) => Err(error),
        }
    }

    /// Validates the configuration and returns a [`ValidConfiguration`], from which drives are created without another check. A
    /// constant is validated at compile time.
    ///
    /// # Errors
    /// Returns the first value out of range.
    pub const fn checked(&self) -> Result<ValidConfiguration, ConfigurationError> {
        let Self { motor, joint, limits, inverter, .. } = self;
        require!(self.motor.resistance_ohm, is_positive(motor.resistance_ohm), "above 0");
        require!(self.motor.direct_inductance_h, is_positive(motor.direct_inductance_h), "above 0");
        require!(self.motor.quadrature_inductance_h, is_positive(motor.quadrature_inductance_h), "above 0");
        require!(self.motor.flux_linkage_vs, is_positive(motor.flux_linkage_vs), "above 0");
        require!(self.motor.pole_pairs, motor.pole_pairs > 0, "above 0");
        require!(self.motor.encoder_offset_rad, motor.encoder_offset_rad.abs() <= PI, "-pi to pi");
        require!(self.limits.current_a, is_positive(limits.current_a), "above 0");
        require!(
            self.limits.trip_current_a,
            is_above(limits.trip_current_a, limits.current_a),
            "above limits.current_a"
        );
        require!(self.limits.min_bus_v, is_positive(limits.min_bus_v), "above 0");
        require!(
            self.limits.max_bus_v,
            is_above(limits.max_bus_v, limits.min_bus_v),
            "above limits.min_bus_v"
        );
        require!(self.limits.derating_c, limits.derating_c.is_finite(), "finite");
        require!(self.limits.trip_c, is_above(limits.trip_c, limits.derating_c), "above limits.derating_c");
        require!(self.limits.speed_rad_per_s, is_positive(limits.speed_rad_per_s), "above 0");
        let ahead_rad =
            PERIODS_TO_VOLTAGE * inverter.period_s * motor.pole_pairs as f32 * limits.speed_rad_per_s;
        require!(
            self.limits.speed_rad_per_s,
            ahead_rad <= FRAC_PI_4,
            "at most one eighth of an electrical turn in 1.5 inverter periods"
        );
        require!(self.limits.stall_s, limits.stall_s > 0.0, "above 0, or infinity");
        require!(self.inverter.period_s, is_positive(inverter.period_s), "above 0");
        let is_followed = inverter.period_s * TRACKING_RAD_PER_S <= MAX_TRACKING_SHARE;
        require!(self.inverter.period_s, is_followed, "at most 150e-6 s for the angle observer");
        require!(self.bandwidth_rad_per_s, is_positive(self.bandwidth_rad_per_s), "above 0");
        let is_slow = self.bandwidth_rad_per_s * inverter.period_s <= 1.0 / 3.0;
        require!(self.bandwidth_rad_per_s, is_slow, "at most a third of 1 / inverter.period_s");
        require!(self.aligning_current_a, is_positive(self.aligning_current_a), "above 0");
        require!(
            self.aligning_current_a,
            self.aligning_current_a <= limits.current_a,
            "at most limits.current_a"
        );
        if let Encoder::Incremental { counts_per_turn } = self.encoder {
            let is_counted = 2 <= counts_per_turn && counts_per_turn <= 1 << 16;
            if !is_counted {
                let (name, value) = ("encoder.counts_per_turn", counts_per_turn as f32);
                return Err(ConfigurationError { name, value, range: "2 to 65536" });
            }
        }
        let ratio = joint.gear_ratio.abs();
        require!(self.joint.gear_ratio, 1e-3 <= ratio && ratio <= 1e4, "0.001 to 10000, of either sign");
        require!(self.joint.zero_rad, joint.zero_rad.abs() <= 100.0, "-100 to 100");
        let dead_time = inverter.dead_time_share;
        require!(self.inverter.dead_time_share, 0.0 <= dead_time && dead_time <= 0.2, "0 to 0.2");
        require!(self.inverter.dead_time_current_a, is_positive(inverter.dead_time_current_a), "above 0");
        require!(self.inverter.max_duty, 0.6 <= inverter.max_duty && inverter.max_duty <= 1.0, "0.6 to 1");
        Ok(ValidConfiguration(*self))
    }
}

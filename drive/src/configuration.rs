//! What a drive is told of its motor, its inverter and their limits.

use core::f32::consts::{FRAC_PI_4, PI};
use core::fmt;

use crate::encoder::{As5047p, As5600, Mt6701};
use crate::vector::Dq;

/// Poles of the observer of angle and speed, `rad/s`.
pub(crate) const TRACKING_RAD_PER_S: f32 = 2_000.0;
/// From a sample to the middle of the period that its voltage is made in: the one after it.
pub(crate) const PERIODS_TO_VOLTAGE: f32 = 1.5;
/// Most that the tracking's poles may turn in a period, `rad`: beyond 0.8 it would not be stable.
const MOST_TRACKING_SHARE: f32 = 0.301;

/// A permanent-magnet motor with three phases.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Motor {
    /// `R` of a phase, `ohm`, > 0: half of what is measured between two leads.
    pub resistance_ohm: f32,
    /// `L_d`, `H`, > 0.
    pub direct_inductance_h: f32,
    /// `L_q`, `H`, > 0.
    pub quadrature_inductance_h: f32,
    /// `ψ`, peak flux of the magnets through a phase, `V s` per electrical radian, > 0. An error of it is one of the torque.
    pub flux_linkage_vs: f32,
    /// `p`, > 0.
    pub pole_pairs: u8,
    /// Whether the encoder counts down when the phases turn the rotor up; it is read backwards then.
    pub is_encoder_reversed: bool,
    /// Mechanical angle of the encoder, as it is read, at which the magnets point along phase U, `rad`, -π to π.
    pub encoder_offset_rad: f32,
}

/// Limits of motor and inverter; beyond most of them the bridge is turned off.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Limits {
    /// Most current that is asked for, peak of a phase, `A`, > 0.
    pub current_a: f32,
    /// Current of a phase that is never right, `A`, above `current_a`.
    pub trip_current_a: f32,
    /// Lowest voltage of the supply, `V`, > 0.
    pub least_bus_v: f32,
    /// Highest one, above the lowest: braking feeds it.
    pub most_bus_v: f32,
    /// From this temperature on less current is asked for, `°C`.
    pub derating_c: f32,
    /// At this one none, and the bridge is off, `°C`, above `derating_c`.
    pub trip_c: f32,
    /// Fastest that the rotor may turn, `rad/s`, > 0. An angle further away than it turns so is no angle.
    pub speed_rad_per_s: f32,
    /// How long a rotor may stand still with all of `current_a`, `s`, > 0; with less of it longer, with half of it for ever.
    /// Infinity where it may always.
    pub stall_s: f32,
}

/// What measures the rotor's angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)
)]
pub enum Encoder {
    /// Two channels, A and B: it knows its angle from a start on.
    Incremental {
        /// All four edges counted, 2 to 65 536.
        counts_per_turn: u32,
    },
    /// See [`As5047p`].
    As5047p,
    /// See [`Mt6701`].
    Mt6701,
    /// See [`As5600`].
    As5600,
}

/// What the rotor turns.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Joint {
    /// Turns of the rotor in one of the joint, 0.001 to 10 000; below 0 where the joint turns the other way.
    pub gear_ratio: f32,
    /// Angle of the joint at the encoder's zero, `rad`, -100 to 100; of an incremental one, that is where it starts.
    pub zero_rad: f32,
}

/// What a board's half bridges are, whatever motor they turn.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Inverter {
    /// One period of the pulse-width modulation, and from one step to the next, `s`, > 0, up to 150 µs.
    pub period_s: f32,
    /// Dead time of one edge of a half bridge, as a share of a period, 0 to 0.2.
    pub dead_time_share: f32,
    /// Current below which that changes proportionally less, `A`, > 0.
    pub dead_time_current_a: f32,
    /// Largest duty cycle, 0.6 to 1: converters that measure at the low side need the rest.
    pub most_duty: f32,
}

/// All of it: what an inverter turns, and the inverter.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Configuration {
    /// `wc`, bandwidth of the current loops, `rad/s`, > 0; up to a third of `1/period_s`.
    pub bandwidth_rad_per_s: f32,
    /// That turns the rotor when it is aligned, `A`, > 0, up to `limits.current_a`.
    pub aligning_current_a: f32,
    /// The motor.
    pub motor: Motor,
    /// Its encoder.
    pub encoder: Encoder,
    /// Its joint.
    pub joint: Joint,
    /// Limits of motor and inverter.
    pub limits: Limits,
    /// The inverter.
    pub inverter: Inverter,
}

/// A value that no drive can have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConfigurationError {
    /// Its name.
    pub name: &'static str,
    /// The value.
    pub value: f32,
    /// What it has to be.
    pub range: &'static str,
}

impl fmt::Display for ConfigurationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} is {}: it has to be {}", self.name, self.value, self.range)
    }
}

impl core::error::Error for ConfigurationError {}

impl Motor {
    /// `3/2 p ψ`, `N m/A`: torque of a current across the magnets.
    #[must_use]
    pub const fn torque_constant_nm_per_a(&self) -> f32 {
        1.5 * self.pole_pairs as f32 * self.flux_linkage_vs
    }

    /// Torque of currents in `A`, `N m`: `3/2 p (ψ i_q + (L_d - L_q) i_d i_q)`.
    #[must_use]
    pub fn torque_nm(&self, Dq { d, q }: Dq) -> f32 {
        let saliency_h = self.direct_inductance_h - self.quadrature_inductance_h;
        1.5 * f32::from(self.pole_pairs) * (self.flux_linkage_vs + saliency_h * d) * q
    }
}

impl Encoder {
    /// Angles that it tells apart in a turn of the rotor.
    #[must_use]
    pub const fn counts_per_turn(&self) -> u32 {
        match self {
            Self::Incremental { counts_per_turn } => *counts_per_turn,
            Self::As5047p => As5047p::COUNTS_PER_TURN,
            Self::Mt6701 => Mt6701::COUNTS_PER_TURN,
            Self::As5600 => As5600::COUNTS_PER_TURN,
        }
    }

    /// Whether it knows its angle from its first reading on.
    #[must_use]
    pub const fn is_absolute(&self) -> bool {
        !matches!(self, Self::Incremental { .. })
    }
}

/// A configuration that a drive can be made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Checked(Configuration);

impl Checked {
    /// All of it.
    #[must_use]
    pub const fn get(&self) -> &Configuration {
        &self.0
    }
}

/// Gives the error of a value that is not right.
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
    /// Says whether a drive can be made of it.
    ///
    /// # Errors
    /// The first value outside its range.
    pub const fn check(&self) -> Result<(), ConfigurationError> {
        match self.checked() {
            Ok(_) => Ok(()),
            Err(error) => Err(error),
        }
    }

    /// As [`check`](Self::check): a drive that is made of what it gives looks no more. Of a constant it is checked when that is
    /// compiled.
    ///
    /// # Errors
    /// The first value outside its range.
    pub const fn checked(&self) -> Result<Checked, ConfigurationError> {
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
        require!(self.limits.least_bus_v, is_positive(limits.least_bus_v), "above 0");
        require!(
            self.limits.most_bus_v,
            is_above(limits.most_bus_v, limits.least_bus_v),
            "above limits.least_bus_v"
        );
        require!(self.limits.derating_c, limits.derating_c.is_finite(), "a number");
        require!(self.limits.trip_c, is_above(limits.trip_c, limits.derating_c), "above limits.derating_c");
        require!(self.limits.speed_rad_per_s, is_positive(limits.speed_rad_per_s), "above 0");
        let ahead_rad =
            PERIODS_TO_VOLTAGE * inverter.period_s * motor.pole_pairs as f32 * limits.speed_rad_per_s;
        require!(
            self.limits.speed_rad_per_s,
            ahead_rad <= FRAC_PI_4,
            "so slow that the rotor turns an eighth of an electrical turn in 1.5 periods at most"
        );
        require!(self.limits.stall_s, limits.stall_s > 0.0, "above 0, or infinity");
        require!(self.inverter.period_s, is_positive(inverter.period_s), "above 0");
        let is_followed = inverter.period_s * TRACKING_RAD_PER_S <= MOST_TRACKING_SHARE;
        require!(self.inverter.period_s, is_followed, "up to 150e-6: the rotor is followed no slower");
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
        require!(self.inverter.most_duty, 0.6 <= inverter.most_duty && inverter.most_duty <= 1.0, "0.6 to 1");
        Ok(Checked(*self))
    }
}

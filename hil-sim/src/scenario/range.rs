//! Which numbers a key takes.

use std::fmt;

/// A range of numbers. None of them holds NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Range {
    /// Any number a controller's `f32` can hold.
    Finite,
    /// Finite and above 0.
    Positive,
    /// Finite and not below 0.
    NotNegative,
    /// Above 0; infinity too.
    PositiveOrInfinite,
    /// Both ends included.
    Between(f64, f64),
}

use Range::{Between, Finite, NotNegative, Positive, PositiveOrInfinite};

/// Most axes of a device.
pub(super) const MAX_DOF: f64 = dimsart_core::limits::MAX_DOF as f64;
/// Longest delay of a link or a module: 100 s at 1 kHz.
const MAX_TICKS: f64 = 100_000.0;

/// From an old modem to a gigabit.
const BIT_RATE: Range = Between(300.0, 1e9);

/// Largest seed, 2^53 - 1: up to here every whole number is told from its neighbours.
const MAX_SEED: f64 = 9_007_199_254_740_991.0;

/// The range of every numeric key. A bare last segment serves every section.
const RANGES: &[(&str, Range)] = &[
    ("seed", Between(0.0, MAX_SEED)),
    ("duration_s", Positive),
    ("sample_period_s", Between(1e-5, 0.1)),
    ("dof", Between(1.0, MAX_DOF)),
    ("forward_delay_ticks", Between(0.0, MAX_TICKS)),
    ("backward_delay_ticks", Between(0.0, MAX_TICKS)),
    ("jitter_ticks", Between(0.0, MAX_TICKS)),
    ("time_delay_ticks", Between(0.0, MAX_TICKS)),
    ("playout_ticks", Between(0.0, 1000.0)),
    ("timeout_ticks", Between(0.0, 1_000_000.0)),
    ("link.every_ticks", Between(1.0, 100.0)),
    ("loss", Between(0.0, 1.0)),
    ("duplication", Between(0.0, 1.0)),
    ("reordering", Between(0.0, 1.0)),
    ("bits_per_s", BIT_RATE),
    ("data_bits_per_s", BIT_RATE),
    ("forward_bits_per_s", BIT_RATE),
    ("backward_bits_per_s", BIT_RATE),
    ("bit_error_rate", Between(0.0, 1.0)),
    ("byte_drop", Between(0.0, 1.0)),
    ("byte_insert", Between(0.0, 1.0)),
    ("queue_bytes", Between(1.0, 1e7)),
    ("queue_frames", Between(1.0, 1e5)),
    ("other_nodes", Between(0.0, 100.0)),
    ("rejoins", Between(0.0, 1e6)),
    ("header_bytes", Between(0.0, 1500.0)),
    ("delay_s", Between(0.0, 100.0)),
    ("spread_s", Between(0.0, 100.0)),
    ("gamma_shape", Between(0.01, 1000.0)),
    ("burst_start", Between(0.0, 1.0)),
    ("burst_end", Between(0.0, 1.0)),
    ("burst_loss", Between(0.0, 1.0)),
    ("impedance_ns_per_m", Positive),
    ("hand.mass_kg", NotNegative),
    ("mass_kg", Positive),
    ("damping_ns_per_m", NotNegative),
    ("wall.stiffness_n_per_m", PositiveOrInfinite),
    ("stiffness_n_per_m", NotNegative),
    ("coulomb_friction_n", NotNegative),
    ("encoder_step_m", NotNegative),
    ("start_position_m", Finite),
    ("resistance_ohm", Positive),
    ("inductance_h", Positive),
    ("torque_constant_nm_per_a", Positive),
    ("rotor_inertia_kg_m2", NotNegative),
    ("transmission_rad_per_m", Positive),
    ("current_bandwidth_rad_per_s", Positive),
    ("voltage_limit_v", PositiveOrInfinite),
    ("path_amplitude_m", Finite),
    ("contact_force_n", Finite),
    ("limits.position_m", Positive),
    ("position_m", Finite),
    ("rest_position_m", Finite),
    ("force_n", Positive),
    ("wave", Positive),
    ("every_ticks", Between(1.0, MAX_TICKS)),
];

impl Range {
    /// The range of `key`: of the first entry that is all of it or its end. None for a key without numbers.
    pub(super) fn of(key: &str) -> Option<Self> {
        let serves =
            |name: &str| key.strip_suffix(name).is_some_and(|rest| rest.is_empty() || rest.ends_with('.'));
        RANGES.iter().find(|(name, _)| serves(name)).map(|(_, range)| *range)
    }

    pub(super) fn holds(self, value: f64) -> bool {
        let finite = value.abs() <= f64::from(f32::MAX);
        match self {
            Finite => finite,
            // A smaller number is 0 to a controller.
            Positive => finite && value >= f64::from(f32::MIN_POSITIVE),
            NotNegative => finite && value >= 0.0,
            PositiveOrInfinite => Positive.holds(value) || value == f64::INFINITY,
            Between(least, most) => (least..=most).contains(&value),
        }
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Finite => f.write_str("a finite number"),
            Positive => f.write_str("a finite number > 0"),
            NotNegative => f.write_str("a finite number >= 0"),
            PositiveOrInfinite => f.write_str("a number > 0, or inf"),
            Between(least, most) => write!(f, "a number from {least} to {most}"),
        }
    }
}

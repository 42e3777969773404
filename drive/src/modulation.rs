//! Space-vector modulation: converts a voltage to the duty cycles of three half bridges.
//!
//! A common voltage that centres the maximum and minimum phase is added to all phases: the same duty cycles as by
//! sectors, with the full hexagon of inner radius `U/√3` (van der Broeck, Skudelny, Stanke, "Analysis and realization
//! of a pulsewidth modulator based on voltage space vectors", IEEE Trans. Industry Applications 24(1), 1988).
//!
//! During the dead time of a half bridge, its current determines the voltage: the mean phase voltage falls by
//! `U share`, against the current. This is compensated by the sign of the reference current, which is noise-free, and
//! proportionally at small currents.

use crate::configuration::{Configuration, Inverter};
use crate::number::{larger, smaller, within};
use crate::vector::{AlphaBeta, FRAC_1_SQRT_3};

/// Duty cycles of the upper switches of the half bridges U, V, W, 0 to 1.
pub type Duties = [f32; 3];

/// The modulator of an inverter.
#[derive(Debug, Clone)]
pub struct Modulation {
    dead_time_share: f32,
    dead_time_per_a: f32,
    /// Maximum voltage in any direction, as a share of the supply, after dead-time compensation.
    radius_share: f32,
    per_radius_share: f32,
}

/// Voltage range of a supply.
#[derive(Debug, Clone, Copy)]
pub struct SupplyRange {
    /// `1/V`.
    pub inverse_bus_v: f32,
    /// Maximum voltage in any direction, `V`.
    pub max_v: f32,
    /// `1 / max_v`.
    pub inverse_max_v: f32,
}

impl Modulation {
    /// Creates the modulator of a [valid](Configuration::check) configuration.
    #[inline]
    #[must_use]
    pub fn new(configuration: &Configuration) -> Self {
        let Inverter { dead_time_share, dead_time_current_a, max_duty, .. } = configuration.inverter;
        let radius_share = FRAC_1_SQRT_3 * (2.0 * (max_duty - dead_time_share) - 1.0);
        Self {
            dead_time_share,
            dead_time_per_a: dead_time_share / dead_time_current_a,
            radius_share,
            per_radius_share: 1.0 / radius_share,
        }
    }

    /// Returns the voltage range for `bus_v`, > 0.
    #[inline]
    #[must_use]
    pub fn supply(&self, bus_v: f32) -> SupplyRange {
        let inverse_bus_v = 1.0 / bus_v;
        SupplyRange {
            inverse_bus_v,
            max_v: self.radius_share * bus_v,
            inverse_max_v: self.per_radius_share * inverse_bus_v,
        }
    }

    /// Returns the duty cycles for a voltage up to [`SupplyRange::max_v`], `V`, with the reference current `wanted_a` for
    /// dead-time compensation. They are within range without clamping.
    #[inline]
    #[must_use]
    pub fn duties(&self, voltage_v: AlphaBeta, wanted_a: AlphaBeta, supply: &SupplyRange) -> Duties {
        let [u, v, w] = voltage_v.to_phases();
        let centre_v = 0.5 * (larger(larger(u, v), w) + smaller(smaller(u, v), w));
        let half = 0.5 - supply.inverse_bus_v * centre_v;
        let [a, b, c] = wanted_a.scaled(self.dead_time_per_a).to_phases();
        let lost = |share| within(share, self.dead_time_share);
        let duty = |phase_v, share| half + supply.inverse_bus_v * phase_v + lost(share);
        // Unrolled: a loop takes 50 % longer.
        [duty(u, a), duty(v, b), duty(w, c)]
    }
}

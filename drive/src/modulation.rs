//! From a voltage to the duty cycles of three half bridges.
//!
//! Space-vector modulation by adding to all phases what centres their largest and smallest: the same duty cycles as by
//! sectors, and so the whole hexagon, whose inner circle is `U/√3` (van der Broeck, Skudelny, Stanke, "Analysis and
//! realization of a pulsewidth modulator based on voltage space vectors", IEEE Trans. Industry Applications 24(1), 1988).
//!
//! While both switches of a half bridge are off, its current chooses the voltage: that takes `U share` off the phase's
//! mean, against the current. It is given back with the sign of the current that is wanted, which is free of noise, and
//! in proportion to it where it is small.

use crate::configuration::{Configuration, Inverter};
use crate::number::{larger, smaller, within};
use crate::vector::{FRAC_1_SQRT_3, Stator};

/// Share of the period that the upper switches of the half bridges U, V, W are on, 0 to 1.
pub type Duties = [f32; 3];

/// The modulator of an inverter.
#[derive(Debug, Clone)]
pub struct Modulation {
    dead_time_share: f32,
    dead_time_per_a: f32,
    /// Of the supply: radius of the circle of which every voltage can be made, beside what dead time takes.
    radius_share: f32,
    per_radius_share: f32,
}

/// What can be made of a supply.
#[derive(Debug, Clone, Copy)]
pub struct Supply {
    /// `1/V`.
    pub per_bus_v: f32,
    /// The longest voltage that can be made in every direction, `V`.
    pub most_v: f32,
    /// One over it.
    pub per_most_v: f32,
}

impl Modulation {
    /// Of a configuration that is [right](Configuration::check).
    #[inline]
    #[must_use]
    pub fn new(configuration: &Configuration) -> Self {
        let Inverter { dead_time_share, dead_time_current_a, most_duty, .. } = configuration.inverter;
        let radius_share = FRAC_1_SQRT_3 * (2.0 * (most_duty - dead_time_share) - 1.0);
        Self {
            dead_time_share,
            dead_time_per_a: dead_time_share / dead_time_current_a,
            radius_share,
            per_radius_share: 1.0 / radius_share,
        }
    }

    /// What can be made of `bus_v`, > 0.
    #[inline]
    #[must_use]
    pub fn supply(&self, bus_v: f32) -> Supply {
        let per_bus_v = 1.0 / bus_v;
        Supply { per_bus_v, most_v: self.radius_share * bus_v, per_most_v: self.per_radius_share * per_bus_v }
    }

    /// The duty cycles that make a voltage, `V`, no longer than [can be made](Supply::most_v), while `wanted_a` flows in the
    /// phases. So they stay within their range by themselves.
    #[inline]
    #[must_use]
    pub fn duties(&self, voltage_v: Stator, wanted_a: Stator, supply: &Supply) -> Duties {
        let [u, v, w] = voltage_v.phases();
        let centre_v = 0.5 * (larger(larger(u, v), w) + smaller(smaller(u, v), w));
        let half = 0.5 - supply.per_bus_v * centre_v;
        let [a, b, c] = wanted_a.times(self.dead_time_per_a).phases();
        let lost = |share| within(share, self.dead_time_share);
        let duty = |phase_v, share| half + supply.per_bus_v * phase_v + lost(share);
        // One by one: a loop over three takes half as long again.
        [duty(u, a), duty(v, b), duty(w, c)]
    }
}

//! From a voltage to the duty cycles of three half bridges.
//!
//! Space-vector modulation by adding to all phases what centres their largest and smallest: the same duty cycles as by
//! sectors, and so the whole hexagon, whose inner circle is `U/√3` (van der Broeck, Skudelny, Stanke, "Analysis and
//! realization of a pulsewidth modulator based on voltage space vectors", IEEE Trans. Industry Applications 24(1), 1988).
//!
//! While both switches of a half bridge are off, its current chooses the voltage: that takes `U share` off the phase's
//! mean, against the current. It is given back with the sign of the current that is wanted, which is free of noise, and
//! in proportion to it where it is small.

use dimsart_core::math::limit;

use crate::configuration::Configuration;
use crate::vector::{FRAC_1_SQRT_3, Stator};

/// Share of the period that the upper switches of the half bridges U, V, W are on, 0 to 1.
pub type Duties = [f32; 3];

/// Radius of the circle that every voltage of can be made, `V`.
#[inline]
pub(crate) fn radius_v(bus_v: f32, most_duty: f32) -> f32 {
    FRAC_1_SQRT_3 * (2.0 * most_duty - 1.0) * bus_v
}

/// The duty cycles that make a voltage, `V`, of a supply of `bus_v`, > 0, while `wanted_a` flows in the phases.
#[inline]
#[must_use]
pub fn duties(voltage_v: Stator, wanted_a: Stator, bus_v: f32, configuration: &Configuration) -> Duties {
    let [u, v, w] = voltage_v.phases();
    let centre_v = 0.5 * (u.max(v).max(w) + u.min(v).min(w));
    let per_volt = 1.0 / bus_v;
    let Configuration { dead_time_share, dead_time_current_a, most_duty, .. } = *configuration;
    let per_ampere = dead_time_share / dead_time_current_a;
    let [a, b, c] = wanted_a.phases();
    [(u, a), (v, b), (w, c)].map(|(phase_v, phase_a)| {
        let lost = limit(per_ampere * phase_a, dead_time_share);
        (0.5 + per_volt * (phase_v - centre_v) + lost).max(1.0 - most_duty).min(most_duty)
    })
}

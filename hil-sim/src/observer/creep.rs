//! What a link that loses packets does to a contact whose receivers do not make up for it.
//!
//! A wave that is given out as 0 takes its displacement along: under the force `F`, a share `p` of lost waves makes the hand
//! creep by `p F/b`, for ever. There is no stiffness then.
//!
//! So does rounding, a little, on a perfect link: what a side does wrong in a tick stays. With the unit roundoff `u = 2⁻²⁴`,
//! its three products and its difference move the wave's force by less than `6 u F`: `2/a` and its product with `2 F` by
//! `4 u F`, `a` times the wave and the wave that leaves by `u F` each. Both sides together: less than `12 u F/b`.

use core::ops::ControlFlow;

use super::Observer;
use super::reception::Received;
use crate::outcome::Outcome;
use crate::response::Controller;
use crate::rig::Rig;

/// Of an `f32`.
const UNIT_ROUNDOFF: f64 = 1.0 / 16_777_216.0;
/// Roundings of a side's wave, in units of its force.
const ROUNDINGS: f64 = 6.0;
const SECONDS_PER_HOUR: f64 = 3600.0;
/// Share of missing waves that is worth a word.
const NOTABLE: f64 = 1e-3;

/// Bound of how fast rounding at a side of impedance `impedance_ns_per_m` lets a hand creep that holds `force_n`, `m/s`.
#[must_use]
pub fn by_rounding_m_per_s(force_n: f64, impedance_ns_per_m: f64) -> f64 {
    ROUNDINGS * UNIT_ROUNDOFF * force_n / impedance_ns_per_m
}

/// Two stations with a contact between them.
#[derive(Debug)]
pub(crate) struct Creep {
    pub(crate) controllers: [Controller; 2],
    /// Largest force that the hand holds in contact, `N`.
    pub(crate) contact_force_n: f64,
    /// From one packet to the next, ticks.
    pub(crate) every_ticks: u32,
}

impl Observer for Creep {
    fn observe(&mut self, _rig: &Rig) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    fn report(&mut self, rig: &Rig, outcome: &mut Outcome) {
        outcome.rounding_creep_m_per_h = self.by_rounding_m_per_h();
        let warnings = self.by_losses(rig, &outcome.received);
        if !warnings.is_empty() {
            outcome.predict_nothing();
            outcome.warnings.extend(warnings);
        }
    }
}

impl Creep {
    /// Fastest creep of a hand in contact that rounding makes, `m/h`; none where a station has no waves.
    fn by_rounding_m_per_h(&self) -> Option<f64> {
        let of = |controller: &Controller| {
            Some(by_rounding_m_per_s(self.contact_force_n, controller.impedance_ns_per_m?))
        };
        Some(SECONDS_PER_HOUR * self.controllers.iter().map(of).sum::<Option<f64>>()?)
    }

    /// In words, for every station that loses displacement, how fast the hand creeps.
    fn by_losses(&self, rig: &Rig, received: &[Received]) -> Vec<String> {
        let max_n = self.contact_force_n;
        #[expect(clippy::cast_precision_loss, reason = "far fewer ticks than 2^53")]
        let ticks = (rig.ticks() as f64).max(1.0);
        let creeps = |(controller, received): (&Controller, &Received)| {
            let (policy, impedance_ns_per_m) = (controller.losing_policy?, controller.impedance_ns_per_m?);
            let missing = f64::from(received.lost) + f64::from(received.superseded);
            let share = f64::from(self.every_ticks) * missing / ticks;
            let creep_mm_per_s = 1e3 * share * max_n / impedance_ns_per_m;
            let (at_most, remedy) = match policy {
                "LIMITED" => (
                    "up to ",
                    "PLAYOUT_TICKS, as long as the delay varies, makes up for it (link.playout_ticks)",
                ),
                _ => ("", "STALE HOLD keeps the mean (link.stale=hold)"),
            };
            (share > NOTABLE && max_n > 0.0).then(|| {
                format!(
                    "the {} gets no wave in {:.1} % of the ticks and makes up for little of it (STALE {policy}): the hand \
                     creeps by p F/b, {at_most}{creep_mm_per_s:.1} mm/s at {max_n} N, and no stiffness is predicted; \
                     {remedy}",
                    received.station,
                    100.0 * share
                )
            })
        };
        self.controllers.iter().zip(received).filter_map(creeps).collect()
    }
}

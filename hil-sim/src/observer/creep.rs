//! Creep of a contact by lost packets and by rounding.
//!
//! A lost wave that is replaced by 0 loses its displacement: under the force `F`, a share `p` of lost waves makes the
//! hand creep by `p F/b`, and no stiffness exists.
//!
//! Rounding has a similar, small effect on a perfect link. With the unit roundoff `u = 2⁻²⁴`, its three products and
//! its difference change the wave's force by less than `6 u F`: `2/a` and its product with `2 F` by `4 u F`, `a`
//! times the wave and the outgoing wave by `u F` each. Both sides together: less than `12 u F/b`.

use core::ops::ControlFlow;

use super::Observer;
use super::reception::Received;
use crate::outcome::Outcome;
use crate::response::Controller;
use crate::rig::Rig;

/// Unit roundoff of `f32`.
const UNIT_ROUNDOFF: f64 = 1.0 / 16_777_216.0;
/// Rounding of a side's wave, in units of its force.
const ROUNDINGS: f64 = 6.0;
const SECONDS_PER_HOUR: f64 = 3600.0;
/// Share of missing waves above which a warning is reported.
const NOTABLE: f64 = 1e-3;

/// Upper bound of the creep of a hand with force `force_n` by rounding at a side of impedance `impedance_n_s_per_m`,
/// `m/s`.
#[must_use]
pub fn rounding_creep_m_per_s(force_n: f64, impedance_n_s_per_m: f64) -> f64 {
    ROUNDINGS * UNIT_ROUNDOFF * force_n / impedance_n_s_per_m
}

/// Two stations in contact.
#[derive(Debug)]
pub(crate) struct Creep {
    pub(crate) controllers: [Controller; 2],
    /// Maximum force of the hand in contact, `N`.
    pub(crate) contact_force_n: f64,
    /// Ticks per packet.
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
    /// Maximum creep of a hand in contact by rounding, `m/h`; `None` if a station has no waves.
    fn by_rounding_m_per_h(&self) -> Option<f64> {
        let of = |controller: &Controller| {
            Some(rounding_creep_m_per_s(self.contact_force_n, controller.impedance_n_s_per_m?))
        };
        Some(SECONDS_PER_HOUR * self.controllers.iter().map(of).sum::<Option<f64>>()?)
    }

    /// Describes the creep of the hand for every station that loses displacement.
    fn by_losses(&self, rig: &Rig, received: &[Received]) -> Vec<String> {
        let max_n = self.contact_force_n;
        #[expect(clippy::cast_precision_loss, reason = "far fewer ticks than 2^53")]
        let ticks = (rig.ticks() as f64).max(1.0);
        let creeps = |(controller, received): (&Controller, &Received)| {
            let (policy, impedance_n_s_per_m) = (controller.lossy_policy?, controller.impedance_n_s_per_m?);
            let missing = f64::from(received.lost) + f64::from(received.superseded);
            let share = f64::from(self.every_ticks) * missing / ticks;
            let creep_mm_per_s = 1e3 * share * max_n / impedance_n_s_per_m;
            let (at_most, remedy) = match policy {
                "LIMITED" => ("up to ", "set link.playout_ticks (PLAYOUT_TICKS) to the range of the delay"),
                _ => ("", "set link.stale=hold (STALE HOLD), which keeps the mean"),
            };
            (share > NOTABLE && max_n > 0.0).then(|| {
                format!(
                    "the {} loses waves in {:.1} % of the ticks and STALE {policy} replaces few of these waves: the \
                    hand creeps (share lost × force / wave impedance), {at_most}{creep_mm_per_s:.1} mm/s at \
                    {max_n} N, so no stiffness is predicted; {remedy}",
                    received.station,
                    100.0 * share
                )
            })
        };
        self.controllers.iter().zip(received).filter_map(creeps).collect()
    }
}

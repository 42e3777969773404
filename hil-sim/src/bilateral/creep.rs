//! What a link that loses packets does to a contact whose receivers do not make up for it.
//!
//! A wave that is given out as 0 takes its displacement along: under the force `F`, a share `p` of lost waves makes the hand
//! creep by `p F/b`, for ever. There is no stiffness then.

use super::Experiment;
use crate::outcome::Received;

/// Share of missing waves that is worth a word.
const NOTABLE: f64 = 1e-3;

impl Experiment {
    /// In words, for every side that loses displacement, how fast the hand creeps.
    pub(super) fn creep(&self, received: &[Received]) -> Vec<String> {
        let sides = [&self.chain.master, &self.chain.slave].into_iter().zip(received);
        let dof = self.scenario.dof;
        let forces_n = (0..dof).map(|axis| self.scenario.contact_force_n(axis).abs());
        let most_n = forces_n.fold(0.0, f64::max);
        #[expect(clippy::cast_precision_loss, reason = "far fewer ticks than 2^53")]
        let ticks = (self.rig.ticks() as f64).max(1.0);
        let every_ticks = f64::from(self.scenario.link.every_ticks.unwrap_or(1));
        let said = sides.filter_map(|(controller, received)| {
            let (policy, impedance_ns_per_m) = (controller.losing_policy?, controller.impedance_ns_per_m?);
            let missing = f64::from(received.lost) + f64::from(received.superseded);
            let share = every_ticks * missing / ticks;
            let creep_mm_per_s = 1e3 * share * most_n / impedance_ns_per_m;
            let (at_most, remedy) = match policy {
                "LIMITED" => ("up to ", "PLAYOUT_TICKS, as long as the delay varies, makes up for it (link.playout_ticks)"),
                _ => ("", "STALE HOLD keeps the mean (link.stale=hold)"),
            };
            (share > NOTABLE && most_n > 0.0).then(|| {
                format!(
                    "the {} gets no wave in {:.1} % of the ticks and makes up for little of it (STALE {policy}): the hand \
                     creeps by p F/b, {at_most}{creep_mm_per_s:.1} mm/s at {most_n} N, and no stiffness is predicted; \
                     {remedy}",
                    received.station,
                    100.0 * share
                )
            })
        });
        said.collect()
    }
}

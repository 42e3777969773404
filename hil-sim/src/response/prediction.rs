//! Compares the perceived stiffness with the prediction of the static chain.

use core::ops::ControlFlow;

use super::chain::Chain;
use crate::observer::Observer;
use crate::outcome::{AxisOutcome, ContactStiffness, Outcome};
use crate::rig::Rig;

/// Observer that adds the predicted stiffness.
#[derive(Debug)]
pub(super) struct Prediction {
    pub(super) chain: Chain,
    pub(super) dof: usize,
}

impl Observer for Prediction {
    fn observe(&mut self, _rig: &Rig) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    fn report(&mut self, rig: &Rig, outcome: &mut Outcome) {
        if let Some([master, slave]) = self.chain.mismatched_impedances_n_s_per_m() {
            outcome.faults.push(format!(
                "wave impedances differ, {master} N s/m on the master and {slave} N s/m on the slave, so forces \
                and motions are scaled and no stiffness is predicted: use the same B_PARAM in both schemes"
            ));
        }
        let device = rig.stations().first().map(|station| station.name.clone()).unwrap_or_default();
        let round_trip_s = outcome.round_trip_ticks.map(|ticks| f64::from(ticks) * rig.period_s());
        for axis in 0..self.dof {
            let felt = outcome.perceived.iter().find(|felt| felt.axis == axis);
            let k_perceived_n_per_m = felt.map(|felt| felt.stiffness);
            let k_predicted_n_per_m =
                round_trip_s.and_then(|round_trip_s| self.chain.stiffness_n_per_m(axis, round_trip_s));
            outcome.k_perceived_n_per_m.push(k_perceived_n_per_m);
            outcome.k_predicted_n_per_m.push(k_predicted_n_per_m);
            outcome.axes.push(AxisOutcome {
                device: device.clone(),
                axis,
                following: None,
                contact: Some(ContactStiffness { k_perceived_n_per_m, k_predicted_n_per_m }),
                loop_figures: None,
                contact_growth_per_tick: None,
            });
        }
        let unsettled =
            outcome.perceived.iter().filter_map(|felt| Some((felt.axis, felt.unsettled.as_ref()?)));
        let warnings = unsettled.map(|(axis, how)| {
            format!(
                "the perceived stiffness of axis {axis} has not settled: {how}; increase duration_s or the damping"
            )
        });
        outcome.warnings.extend(warnings);
    }
}

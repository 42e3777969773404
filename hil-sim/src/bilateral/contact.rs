//! What the hand feels of what the slave meets in the settled contact, beside what the static chain predicts.

use core::ops::ControlFlow;

use dimsart_core::types;

use super::Side;
use super::chain::Chain;
use super::phases::Phases;
use crate::observer::Observer;
use crate::observer::perceived::{Feeling, Obstacle, Perceived};
use crate::outcome::{AxisOutcome, ContactStiffness, Outcome};
use crate::plant::EnvironmentKind;
use crate::rig::{Probe, Rig};
use crate::rig_file::{AxisSpring, AxisWall};
use crate::scenario::Scenario;

/// What the hand feels on every axis that it pushes; nothing where its station, the master, is not in the rig.
pub(super) fn feeling(scenario: &Scenario, phases: &Phases, alone: Option<Side>, end_s: f64) -> Feeling {
    let settled_s = phases.settled_s..phases.release_s.min(end_s);
    let is_felt = |axis: &usize| alone != Some(Side::Slave) && scenario.contact_force_n(*axis).abs() > 0.0;
    let slave = alone.is_none().then_some(1);
    let felt = |axis| {
        let wall = &scenario.environments.wall;
        let wall = (scenario.environment == EnvironmentKind::Wall).then_some(AxisWall {
            position: wall.position_m,
            stiffness: wall.stiffness_n_per_m,
            damping: wall.damping_ns_per_m,
            solid: wall.solid,
        });
        let spring = &scenario.environments.spring;
        let is_spring = scenario.environment == EnvironmentKind::Spring && spring.stiffness_n_per_m > 0.0;
        let spring = is_spring.then_some(AxisSpring {
            rest_position: spring.rest_position_m,
            stiffness: spring.stiffness_n_per_m,
            damping: spring.damping_ns_per_m,
        });
        let obstacle = Obstacle::new(Side::Slave.name(), slave, axis, wall, spring)?;
        Some(Perceived {
            station: 0,
            axis,
            unit: "N/m",
            force: Probe::new(types::DES_FORCE.first()),
            watched_s: vec![settled_s.clone()],
            obstacles: vec![obstacle],
            min_depth: 0.0,
            last: None,
        })
    };
    Feeling((0..scenario.dof).filter(is_felt).filter_map(felt).collect())
}

/// Compares what was felt with what the static chain predicts.
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
        if let Some([master, slave]) = self.chain.unlike_impedances_ns_per_m() {
            outcome.faults.push(format!(
                "the wave impedances differ, {master} N s/m on the master and {slave} N s/m on the slave: forces and \
                 motions are scaled, and no stiffness is predicted; give both schemes the same B_PARAM"
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
                "the perceived stiffness of axis {axis} has not settled: {how}; a longer run (duration_s) or more damping \
                 lets it"
            )
        });
        outcome.warnings.extend(warnings);
    }
}

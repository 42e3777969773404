//! The paper's bilateral experiment: a scenario becomes a rig with observers.

pub mod chain;
mod contact;
mod guards;
pub mod linear_loop;
mod one_side;
pub mod phases;
mod side;
mod station;

use std::collections::BTreeMap;
use std::time::Instant;

use crate::experiment::{Experiment, ExperimentError, Setup};
use crate::first_packet::first_packet;
use crate::link::{Carrier, Ends};
use crate::observer::Observer;
use crate::observer::channel_energy::ChannelEnergy;
use crate::observer::creep::Creep;
use crate::observer::limit_cycles::Swings;
use crate::observer::peer::Peer;
use crate::observer::port_energy::PortEnergy;
use crate::observer::reception::Reception;
use crate::observer::round_trip::{RoundTrips, Ways};
use crate::observer::watch::Watch;
use crate::outcome::Outcome;
use crate::recorder::Recorder;
use crate::rig::{End, Rig};
use crate::scenario::Scenario;
use chain::{Chain, Controller};
use contact::{Prediction, feeling};
use guards::{board_key, guard_both};
use linear_loop::Loops;
use phases::Phases;
use station::{controller, station};

pub use one_side::one_side;
pub use side::Side;
pub use station::{device, settings};

/// What is known of a scenario's run before it is run.
#[derive(Debug)]
struct Plan {
    chain: Chain,
    phases: Phases,
    link_round_trip_ticks: u32,
}

impl Plan {
    fn new(scenario: &Scenario, master: Controller, slave: Controller) -> Result<Self, ExperimentError> {
        let in_the_slave = |error| ExperimentError::Plant { place: Side::Slave.name().to_owned(), error };
        let chain = Chain::new(scenario, master, slave).map_err(in_the_slave)?;
        let link_round_trip_ticks = Carrier::new(scenario)?.round_trip_ticks();
        let phases = Phases::new(scenario, &chain, link_round_trip_ticks);
        Ok(Self { chain, phases, link_round_trip_ticks })
    }

    fn of(scenario: &Scenario) -> Result<Self, ExperimentError> {
        let mut master = controller(scenario, Side::Master)?;
        let mut slave = controller(scenario, Side::Slave)?;
        Self::new(scenario, Controller::read(&mut master), Controller::read(&mut slave))
    }

    /// The experiment with a rig of both stations, or of one of them alone.
    fn experiment(
        self,
        begun: Instant,
        scenario: &Scenario,
        rig: Rig,
        alone: Option<Side>,
    ) -> Result<Experiment, ExperimentError> {
        let recorder = Recorder::new(&rig, &scenario.record)?;
        let end_s = scenario.duration_s.unwrap_or(self.phases.end_s);
        let observers = self.observers(scenario, &rig, alone, end_s);
        let outcome = Outcome::default();
        let mut experiment = Experiment::observed(begun, rig, end_s, recorder, observers, outcome);
        experiment.phases = Some(self.phases);
        let keys = [Side::Master, Side::Slave].map(|side| (side, board_key(scenario, side)));
        experiment.board_keys = keys
            .into_iter()
            .filter_map(|(side, key)| Some(key.transpose()?.map(|key| (side.name().to_owned(), key))))
            .collect::<Result<BTreeMap<_, _>, _>>()?;
        Ok(experiment)
    }

    /// In the order in which they report. What takes both stations is observed where both are.
    fn observers(
        &self,
        scenario: &Scenario,
        rig: &Rig,
        alone: Option<Side>,
        end_s: f64,
    ) -> Vec<Box<dyn Observer>> {
        let Self { chain, phases, link_round_trip_ticks } = self;
        let every_ticks = scenario.link.every_ticks.unwrap_or(1);
        let ways = Ways {
            delay_ticks: chain.delay_ticks(),
            // In the order of the connections.
            playout_ticks: [chain.slave.playout_ticks, chain.master.playout_ticks],
            waits: every_ticks > 1,
            planned_ticks: *link_round_trip_ticks,
            has_both_ends: alone.is_none(),
        };
        // From the hand's push on until it lets go: when that has settled, nothing is to oscillate.
        let pushed_s = phases.contact_start_s..phases.release_s.min(end_s);
        let forces_n = (0..scenario.dof).map(|axis| scenario.contact_force_n(axis).abs());
        let creep = Creep {
            controllers: [chain.master.clone(), chain.slave.clone()],
            contact_force_n: forces_n.fold(0.0, f64::max),
            every_ticks,
        };
        let mut observers: Vec<Box<dyn Observer>> = Vec::new();
        if alone.is_none() {
            observers.push(Box::new(Loops::new(scenario)));
            observers.push(Box::new(ChannelEnergy::new(rig)));
            observers.push(Box::new(PortEnergy::default()));
        }
        observers.push(Box::new(RoundTrips::new(ways)));
        observers.push(Box::new(feeling(scenario, phases, alone, end_s)));
        observers.push(Box::new(Prediction { chain: chain.clone(), dof: scenario.dof }));
        observers.push(Box::new(Watch::new(rig, [scenario.limits.ranges(); 2])));
        observers.push(Box::new(Swings::new(rig, |_| vec![pushed_s.clone()])));
        observers.push(Box::new(Reception { reports_silence: alone.is_none() }));
        match alone {
            None => observers.push(Box::new(creep)),
            Some(side) => observers.push(Box::new(Peer::new(rig, side.other().name(), every_ticks))),
        }
        observers
    }
}

impl Setup for Scenario {
    fn experiment(&self) -> Result<Experiment, ExperimentError> {
        let begun = Instant::now();
        let mut master = controller(self, Side::Master)?;
        let mut slave = controller(self, Side::Slave)?;
        let plan = Plan::new(self, Controller::read(&mut master), Controller::read(&mut slave))?;
        let mut rig = Rig::new(self.sample_period_s);
        let master = rig.add(station(self, &plan.phases, Side::Master, master)?);
        let slave = rig.add(station(self, &plan.phases, Side::Slave, slave)?);
        let end = |station| End { station, link: 0 };
        let channel = |station: usize| {
            rig.stations().get(station).map_or(0, |station| station.dimsart.listening_channel(0))
        };
        let ends = Ends { forward_channel: channel(slave), backward_channel: channel(master) };
        let [forward, backward] = Carrier::new(self)?.connect(ends);
        guard_both(self, &mut rig, ends)?;
        rig.connect(end(master), end(slave), forward);
        rig.connect(end(slave), end(master), backward);
        plan.experiment(begun, self, rig, None)
    }
}

/// When the hand guides, pushes and lets go.
///
/// # Errors
/// As [`Experiment::new`].
pub fn phases(scenario: &Scenario) -> Result<Phases, ExperimentError> {
    Ok(Plan::of(scenario)?.phases)
}

/// Ticks of a round trip when nothing on the way is late: [the link's](Carrier::round_trip_ticks) and the delay
/// modules' of both schemes.
///
/// # Errors
/// As [`Experiment::new`].
pub fn round_trip_ticks(scenario: &Scenario) -> Result<u32, ExperimentError> {
    let plan = Plan::of(scenario)?;
    Ok(plan.link_round_trip_ticks.saturating_add(plan.chain.delay_ticks().unwrap_or(0)))
}

/// Words of the packets that the scenario's schemes send for one axis, from master and from slave; 0 for a side
/// that sends none.
///
/// # Errors
/// As [`Experiment::new`].
pub fn words_of_one_axis(scenario: &Scenario) -> Result<[usize; 2], ExperimentError> {
    let mut words = [0; 2];
    for (words, side) in words.iter_mut().zip([Side::Master, Side::Slave]) {
        let mut dimsart = controller(&Scenario { dof: 1, ..scenario.clone() }, side)?;
        *words = first_packet(&mut dimsart, 0).map_or(0, |packet| packet.words.len());
    }
    Ok(words)
}

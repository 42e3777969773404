//! One side of the experiment, the other one being another process or a board.

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use super::guards::guard_one;
use super::station::{controller, station};
use super::{Plan, Side};
use crate::bilateral::chain::Controller;
use crate::experiment::{Experiment, ExperimentError};
use crate::link::{self, Channels};
use crate::meeting::{Missed, meet};
use crate::pace::Pace;
use crate::rig::{End, Rig, Station};
use crate::scenario::Scenario;

/// Silence after which a side that is a process of its own calls its link lost unless told otherwise, ticks.
const DESKTOP_TIMEOUT_TICKS: u32 = 1000;

/// One side only, in real time, the other one being another process or a board behind the link of its
/// [address](Side::address). Waits up to `wait` for it to start, unless `stop` is set meanwhile.
///
/// # Errors
/// As [`Experiment::new`], and when the link cannot be opened or the other side does not come.
pub fn one_side(
    scenario: &Scenario,
    side: Side,
    wait: Duration,
    stop: &AtomicBool,
) -> Result<Experiment, ExperimentError> {
    let mut scenario = scenario.clone();
    // Two processes of a desktop computer are not real time.
    scenario.link.timeout_ticks.get_or_insert(DESKTOP_TIMEOUT_TICKS);
    let scenario = &scenario;
    let mut dimsart = controller(scenario, side)?;
    let own = Controller::read(&mut dimsart);
    // A scheme that is not at hand on this computer leaves figures unknown that are of both sides.
    let other = controller(scenario, side.other());
    let out = other.as_ref().map_or(0, |other| other.listening_channel(0));
    let are_authenticated = scenario.link.key_file.is_some();
    let channels = Channels { out, listening: dimsart.listening_channel(0), are_authenticated };
    let other = other.map(|mut other| Controller::read(&mut other)).unwrap_or_default();
    let plan = match side {
        Side::Master => Plan::new(scenario, own, other)?,
        Side::Slave => Plan::new(scenario, other, own)?,
    };
    let mut rig = Rig::new(scenario.sample_period_s);
    let mut station = station(scenario, &plan.phases, side, dimsart)?;
    guard_one(scenario, side, &mut station, channels)?;
    let station = rig.add(station);
    let end = End { station, link: 0 };
    let (own, peer) = (side.address(scenario), side.other().address(scenario));
    let (link, arrival) = link::open(own, peer, channels)
        .map_err(|source| ExperimentError::Link { side: side.name(), source })?;
    // One of the two follows the other one's beat.
    let arrival = arrival.filter(|_| side == Side::Slave);
    rig.connect(end, end, link);
    let peer = side.meeting_place(scenario).clone();
    let start = meet(&mut rig, arrival.as_ref(), wait, stop).map_err(|missed| {
        let other = side.other().name();
        let authentication_failure = rig.stations().first().and_then(Station::authentication_failure);
        match (missed, authentication_failure) {
            (Missed::Stopped, _) => ExperimentError::Stopped { other },
            (_, Some(reason)) => ExperimentError::AuthenticationFailure { peer, other, reason },
            (Missed::Silence, None) => ExperimentError::NoPeer { peer, waited_s: wait.as_secs_f64(), other },
            (Missed::Stranger, None) => ExperimentError::WrongPeer { peer, other },
        }
    })?;
    let mut experiment = plan.experiment(Instant::now(), scenario, rig, Some(side))?;
    experiment.pace = Some(Pace::new(start, scenario.sample_period_s));
    Ok(experiment)
}

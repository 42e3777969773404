//! One station of a rig that is linked with another process or a board.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::build::{controller, machine, station};
use super::chain::Controller;
use super::guards::guard_one;
use super::press::{Planned, planned_with};
use super::{experiment_of, press};
use crate::experiment::{Experiment, ExperimentError};
use crate::link::{self, Address, Channels};
use crate::pace::TickPacer;
use crate::rig::{Rig, Station, StationLink};
use crate::rig_file::{ControllerAxes, LinkSection, RigFile};
use crate::synchronisation::{SynchronisationError, synchronise_with_peer};

/// Default link timeout of a station that is a separate process, ticks.
const DESKTOP_TIMEOUT_TICKS: i64 = 1000;

/// A station that can run alone, its peer, and their addresses.
#[derive(Debug)]
pub struct SingleStation<'f> {
    /// Controller.
    pub own: ControllerAxes<'f>,
    /// Controller of the peer.
    pub other: ControllerAxes<'f>,
    /// Own address.
    pub own_address: &'f Address,
    /// Peer address.
    pub peer_address: &'f Address,
    /// Sending link.
    out: &'f LinkSection,
}

impl<'f> SingleStation<'f> {
    /// Finds the station of a controller; `None` without a link with addresses in both directions.
    #[must_use]
    pub fn of(file: &'f RigFile, name: &str) -> Option<Self> {
        let parts = ControllerAxes::all(file);
        let part = |name: &str| parts.iter().find(|part| part.name() == name).cloned();
        let out = file.links.iter().find(|link| link.from == name && link.address.is_some())?;
        let back = file.links.iter().find(|link| link.to == name && link.from == out.to)?;
        Some(Self {
            own: part(name)?,
            other: part(&out.to)?,
            own_address: back.address.as_ref()?,
            peer_address: out.address.as_ref()?,
            out,
        })
    }

    /// Returns the peer's address: the other end of its own medium, or another socket.
    #[must_use]
    pub fn peer_address(&self) -> &'f Address {
        match self.own_address {
            Address::Udp(_) => self.peer_address,
            own => own,
        }
    }

    /// Whether the peer is further up in the file: this station then synchronises with it.
    fn follows(&self, file: &RigFile) -> bool {
        let place = |name: &str| ControllerAxes::all(file).iter().position(|part| part.name() == name);
        place(self.other.name()) < place(self.own.name())
    }
}

/// Adds a default timeout for a process on a desktop computer without real time.
fn with_timeout(file: &RigFile) -> RigFile {
    let mut file = file.clone();
    for controller in &mut file.controllers {
        let receiver = controller.set.entry("COMM_RXMOD".to_owned()).or_default();
        receiver.entry("TIMEOUT_TICKS".to_owned()).or_insert(DESKTOP_TIMEOUT_TICKS.into());
    }
    file
}

/// Creates the experiment of one station in real time. Waits up to `wait` for its peer, unless `stop` is set.
///
/// # Errors
/// As [`Experiment::new`], or the link cannot be opened or the peer does not respond.
pub fn one_station(
    file: &RigFile,
    name: &str,
    wait: Duration,
    stop: &AtomicBool,
) -> Result<Experiment, ExperimentError> {
    let file = &with_timeout(file);
    let no_address = || ExperimentError::NoAddress { name: name.to_owned() };
    let alone = SingleStation::of(file, name).ok_or_else(no_address)?;
    let mut dimsart = controller(file, &alone.own)?;
    let own = Controller::read(&mut dimsart);
    // Without the peer's scheme, figures of both stations are unknown.
    let other = controller(file, &alone.other);
    let numbers = [alone.out.to_link, alone.out.from_link].map(usize::from);
    let out = other.as_ref().map_or(0, |other| other.receive_channel(numbers[0]));
    let is_authenticated = alone.out.key_file.is_some();
    let channels = Channels { out, receive: dimsart.receive_channel(numbers[1]), is_authenticated };
    let other = other.map(|mut other| Controller::read(&mut other)).unwrap_or_default();
    let hand = file.press_pair().map(|[hand, _]| hand.name().to_owned());
    let planned: Option<Planned> = match hand {
        None => None,
        Some(hand) if hand == name => Some(planned_with(file, [own, other])?),
        Some(_) => Some(planned_with(file, [other, own])?),
    };
    let moved = planned.as_ref().map_or_else(|| file.clone(), |planned| planned.moved(file));
    let part = press::part(&moved, name).ok_or_else(no_address)?;
    let machine =
        Arc::new(Mutex::new(machine(&moved, part.device, 1, &press::release_times_s(planned.as_ref()))?));
    let mut rig = Rig::new(file.sample_period_s);
    let mut station = station(&moved, &part, machine, dimsart)?;
    guard_one(file, alone.out, alone.own_address, &mut station, channels)?;
    let station = rig.add(station);
    let end = StationLink { station, link: numbers[1] };
    let (link, arrival) = link::open(alone.own_address, alone.peer_address, channels)
        .map_err(|source| ExperimentError::Link { name: name.to_owned(), source })?;
    // One station synchronises with the other.
    let arrival = arrival.filter(|_| alone.follows(file));
    rig.connect(end, end, link);
    let peer = alone.peer_address().clone();
    let start = synchronise_with_peer(&mut rig, arrival.as_ref(), wait, stop).map_err(|missed| {
        let other = alone.other.name().to_owned();
        let authentication_failure = rig.stations().first().and_then(Station::authentication_failure);
        match (missed, authentication_failure) {
            (SynchronisationError::Stopped, _) => ExperimentError::Stopped { other },
            (_, Some(reason)) => ExperimentError::AuthenticationFailure { peer, other, reason },
            (SynchronisationError::NoPacket, None) => {
                ExperimentError::NoPeer { peer, waited_s: wait.as_secs_f64(), other }
            }
            (SynchronisationError::RejectedPackets, None) => ExperimentError::WrongPeer { peer, other },
        }
    })?;
    let mut experiment =
        experiment_of(Instant::now(), &moved, planned, rig, Some((name, alone.other.name())))?;
    experiment.pace = Some(TickPacer::new(start, file.sample_period_s));
    Ok(experiment)
}

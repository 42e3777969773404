//! One station of a rig, what it is linked with being another process or a board.

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
use crate::meeting::{Missed, meet};
use crate::pace::Pace;
use crate::rig::{End, Rig, Station};
use crate::rig_file::{LinkSection, Part, RigFile};

/// Silence after which a station that is a process of its own calls its link lost unless told otherwise, ticks.
const DESKTOP_TIMEOUT_TICKS: i64 = 1000;

/// A station that can run alone: its controller, the other one, and where each of them is.
#[derive(Debug)]
pub struct Alone<'f> {
    /// Its controller.
    pub own: Part<'f>,
    /// The one at the other end of its link.
    pub other: Part<'f>,
    /// Where it listens.
    pub own_address: &'f Address,
    /// Where the other one does.
    pub peer_address: &'f Address,
    /// The link that it sends over.
    out: &'f LinkSection,
}

impl<'f> Alone<'f> {
    /// The station of that controller; none where it has no link with an address each way.
    #[must_use]
    pub fn of(file: &'f RigFile, name: &str) -> Option<Self> {
        let parts = Part::of_all(file);
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

    /// Where it finds the other one: at the other end of what it is at itself, or at another socket.
    #[must_use]
    pub fn meeting_place(&self) -> &'f Address {
        match self.own_address {
            Address::Udp(_) => self.peer_address,
            own => own,
        }
    }

    /// Whether the other controller is further up in the file: this one then follows its beat.
    fn follows(&self, file: &RigFile) -> bool {
        let place = |name: &str| Part::of_all(file).iter().position(|part| part.name() == name);
        place(self.other.name()) < place(self.own.name())
    }
}

/// The file with a timeout for a process of a desktop computer, which is not real time, where none was set.
fn with_timeout(file: &RigFile) -> RigFile {
    let mut file = file.clone();
    for controller in &mut file.controllers {
        let receiver = controller.set.entry("COMM_RXMOD".to_owned()).or_default();
        receiver.entry("TIMEOUT_TICKS".to_owned()).or_insert(DESKTOP_TIMEOUT_TICKS.into());
    }
    file
}

/// One station only, in real time, what it is linked with being another process or a board. Waits up to `wait` for that to
/// start, unless `stop` is set meanwhile.
///
/// # Errors
/// As [`Experiment::new`], and when the link cannot be opened or the other one does not come.
pub fn one_station(
    file: &RigFile,
    name: &str,
    wait: Duration,
    stop: &AtomicBool,
) -> Result<Experiment, ExperimentError> {
    let file = &with_timeout(file);
    let no_address = || ExperimentError::NoAddress { name: name.to_owned() };
    let alone = Alone::of(file, name).ok_or_else(no_address)?;
    let mut dimsart = controller(file, &alone.own)?;
    let own = Controller::read(&mut dimsart);
    // A scheme that is not at hand on this computer leaves figures unknown that are of both.
    let other = controller(file, &alone.other);
    let numbers = [alone.out.to_link, alone.out.from_link].map(usize::from);
    let out = other.as_ref().map_or(0, |other| other.listening_channel(numbers[0]));
    let are_authenticated = alone.out.key_file.is_some();
    let channels = Channels { out, listening: dimsart.listening_channel(numbers[1]), are_authenticated };
    let other = other.map(|mut other| Controller::read(&mut other)).unwrap_or_default();
    let hand = file.pressed().map(|[hand, _]| hand.name().to_owned());
    let planned: Option<Planned> = match hand {
        None => None,
        Some(hand) if hand == name => Some(planned_with(file, [own, other])?),
        Some(_) => Some(planned_with(file, [other, own])?),
    };
    let moved = planned.as_ref().map_or_else(|| file.clone(), |planned| planned.moved(file));
    let part = press::part(&moved, name).ok_or_else(no_address)?;
    let machine = Arc::new(Mutex::new(machine(&moved, part.device, 1, planned.as_ref())?));
    let mut rig = Rig::new(file.sample_period_s);
    let mut station = station(&moved, &part, machine, dimsart)?;
    guard_one(file, alone.out, alone.own_address, &mut station, channels)?;
    let station = rig.add(station);
    let end = End { station, link: numbers[1] };
    let (link, arrival) = link::open(alone.own_address, alone.peer_address, channels)
        .map_err(|source| ExperimentError::Link { name: name.to_owned(), source })?;
    // One of the two follows the other one's beat.
    let arrival = arrival.filter(|_| alone.follows(file));
    rig.connect(end, end, link);
    let peer = alone.meeting_place().clone();
    let start = meet(&mut rig, arrival.as_ref(), wait, stop).map_err(|missed| {
        let other = alone.other.name().to_owned();
        let authentication_failure = rig.stations().first().and_then(Station::authentication_failure);
        match (missed, authentication_failure) {
            (Missed::Stopped, _) => ExperimentError::Stopped { other },
            (_, Some(reason)) => ExperimentError::AuthenticationFailure { peer, other, reason },
            (Missed::Silence, None) => ExperimentError::NoPeer { peer, waited_s: wait.as_secs_f64(), other },
            (Missed::Stranger, None) => ExperimentError::WrongPeer { peer, other },
        }
    })?;
    let mut experiment =
        experiment_of(Instant::now(), &moved, planned, rig, Some((name, alone.other.name())))?;
    experiment.pace = Some(Pace::new(start, file.sample_period_s));
    Ok(experiment)
}

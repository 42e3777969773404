//! A rig: controllers, plants and links in one virtual time.
//!
//! ```text
//! every tick, controller by controller:  link ──bytes──▶ Dimsart ◀──positions── plant
//!                                        link ◀──bytes── Dimsart ──forces─────▶ plant (held for a tick)
//! ```
//! The controller is the very code that runs on a board; what a tick is, is said by
//! [`Dimsart::tick`](dimsart_core::Dimsart::tick) alone. It can also run [there](Station::move_to).

mod arrivals;
mod guarded;
mod inputs;
mod probe;
mod remote;
mod simulated_dimsart;
mod trace;

pub use inputs::Inputs;
pub use probe::Probe;
pub use remote::{RemoteController, RemoteError};
pub use simulated_dimsart::{SIZES, SimulatedDimsart};
pub use trace::TickTrace;

use dimsart_core::envelope::Class;
use dimsart_core::{Packet, PacketError, Tick, Word};
use dimsart_link::auth::{AuthError, Guard};

use crate::bus::MediumReport;
use crate::bus::time::tick_seconds;
use crate::link::{Carried, Link, TransitTicks};
use crate::plant::Plant;
use arrivals::Arrivals;
use guarded::Guarded;

/// A controller and the plant it is joined to.
#[derive(Debug)]
pub struct Station {
    /// Name, such as `master`.
    pub name: String,
    /// The controller, or the copy of one that runs on a board: then it is not ticked, but shows the board's
    /// Data Base.
    pub dimsart: Box<SimulatedDimsart>,
    /// The plant.
    pub plant: Box<dyn Plant>,
    /// What the last tick came to.
    pub last_tick: Tick,
    every_ticks: u64,
    remote: Option<Box<dyn RemoteController>>,
    trouble: Option<RemoteError>,
    guarded: Option<Guarded>,
    /// Whether something with a tag came in where no guard is.
    is_tagged: bool,
    resets_links: bool,
    is_motion_allowed: bool,
    trace: Option<TickTrace>,
    inputs: Option<Inputs>,
    arrivals: Arrivals,
    sensed: Vec<f32>,
    /// Places of the frame that show another value than the one measured there.
    shown: Vec<(usize, Shown)>,
    measured: Vec<Word>,
    commanded: Vec<Word>,
    command: Vec<f32>,
}

/// What a place of a station's frame shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shown {
    /// A value.
    Value(f32),
    /// The value of another place in the same tick.
    Place(usize),
}

impl Station {
    /// Joins a controller to a plant: what its sensors show goes in, forces come out.
    #[must_use]
    pub fn new(name: &str, dimsart: Box<SimulatedDimsart>, plant: Box<dyn Plant>) -> Self {
        let (words_in, words_out) = (dimsart.frame().output_words(), dimsart.frame().input_words());
        Self {
            name: name.to_owned(),
            dimsart,
            plant,
            last_tick: Tick::Idle,
            every_ticks: 1,
            remote: None,
            trouble: None,
            guarded: None,
            is_tagged: false,
            resets_links: false,
            is_motion_allowed: true,
            trace: None,
            inputs: None,
            arrivals: Arrivals::default(),
            sensed: vec![0.0; words_in],
            shown: Vec::new(),
            measured: vec![Word(0); words_in],
            commanded: vec![Word(0); words_out],
            command: vec![0.0; words_out],
        }
    }

    /// What the encoders reported in the last tick, `m` or `rad`, one per axis.
    #[must_use]
    pub fn position(&self) -> &[f32] {
        self.sensed.get(..self.plant.dof()).unwrap_or_default()
    }

    /// The command that its device got in the last tick, `N` or `N m`, one per axis.
    #[must_use]
    pub fn command(&self) -> &[f32] {
        &self.command
    }

    /// Has its controller stepped in every so many ticks of the rig; in between, its commands are held. 0 counts as 1.
    pub fn step_every(&mut self, ticks: u32) {
        self.every_ticks = u64::from(ticks.max(1));
    }

    /// Ticks of the rig from one tick of its controller to the next.
    #[must_use]
    pub fn every_ticks(&self) -> usize {
        usize::try_from(self.every_ticks).unwrap_or(usize::MAX)
    }

    /// Whether its controller is stepped in a tick of the rig.
    #[must_use]
    pub fn is_due(&self, tick: u64) -> bool {
        tick.is_multiple_of(self.every_ticks)
    }

    /// Sets what a place of the frame shows from the next tick on.
    pub fn show(&mut self, place: usize, shown: Shown) {
        self.shown.retain(|(changed, _)| *changed != place);
        self.shown.push((place, shown));
    }

    /// The value that a place of the frame showed in the last tick.
    #[must_use]
    pub fn shown(&self, place: usize) -> Option<f32> {
        self.sensed.get(place).copied()
    }

    /// Lets a board that was started with this station's controller be the controller, and the guard of its link if it has
    /// a key.
    pub fn move_to(&mut self, board: impl RemoteController + 'static) {
        if board.is_authenticated() {
            self.guarded = None;
        }
        self.remote = Some(Box::new(board));
    }

    /// The board that the controller runs on; none when it runs here.
    pub fn board_mut(&mut self) -> Option<&mut (dyn RemoteController + 'static)> {
        self.remote.as_deref_mut()
    }

    /// Has every tick of the controller traced from now on, if it runs here.
    pub fn start_trace(&mut self) {
        self.trace = Some(TickTrace::default());
    }

    /// The last tick; none until a trace was [started](Self::start_trace).
    #[must_use]
    pub fn trace(&self) -> Option<&TickTrace> {
        self.trace.as_ref()
    }

    /// Keeps what goes into the controller from now on. Not of a board that authenticates its links by itself: what comes
    /// in there is opened by nobody else.
    pub fn keep_inputs(&mut self) {
        let is_open = !self.remote.as_ref().is_some_and(|remote| remote.is_authenticated());
        self.inputs = is_open.then(Inputs::default);
    }

    /// What went into the controller for the last tick; none unless they are [kept](Self::keep_inputs).
    #[must_use]
    pub fn inputs(&self) -> Option<&Inputs> {
        self.inputs.as_ref()
    }

    /// The same, for who gives the controller commands.
    pub fn inputs_mut(&mut self) -> Option<&mut Inputs> {
        self.inputs.as_mut()
    }

    /// [Allows motion](dimsart_core::Dimsart::allow_motion) from the next tick on, or forbids it.
    pub fn allow_motion(&mut self, is_allowed: bool) {
        self.is_motion_allowed = is_allowed;
        self.inputs.iter_mut().for_each(|inputs| inputs.is_motion_allowed = is_allowed);
    }

    /// Has the nodes of its links join buses again that they have left, in the next tick, as a board's reset does.
    pub fn reset_links(&mut self) {
        self.resets_links = true;
    }

    /// Has a link authenticate what goes over it. Its clock are the ticks of a controller that is stepped every
    /// `period_s`.
    pub fn guard(&mut self, link: usize, guard: Guard, period_s: f64) {
        self.guarded = Some(Guarded::new(link, guard, period_s));
    }

    /// Whether a link authenticates what goes over it.
    pub(crate) fn is_guarded(&self) -> bool {
        self.guarded.is_some()
    }

    /// Why something that came in was not trusted, the newest case; none when keys were no matter.
    #[must_use]
    pub fn authentication_failure(&self) -> Option<AuthenticationFailure> {
        let refusal = self.guarded.as_ref().and_then(|guarded| guarded.refusal);
        refusal
            .map(AuthenticationFailure::Refused)
            .or(self.is_tagged.then_some(AuthenticationFailure::NoKeyHere))
    }

    /// Packets so far that came together with a newer one: a tick uses one.
    #[must_use]
    pub fn superseded(&self) -> u32 {
        self.arrivals.superseded()
    }

    /// How often the sender at the other end of a link has restarted.
    #[must_use]
    pub fn restarts(&self) -> u32 {
        self.arrivals.restarts()
    }

    /// How many packets a tick the sender at the other end of a link sends, lost ones included; none where few came.
    #[must_use]
    pub fn packets_per_tick(&self, link: usize) -> Option<f64> {
        self.arrivals.packets_per_tick(link)
    }

    /// Whether its actuators have something to do: the scheme commands, or the way to zero is not over.
    fn is_driven(&self) -> bool {
        self.last_tick == Tick::Ran || self.command.iter().any(|command| *command != 0.0)
    }

    fn receive(&mut self, tick: u64, link: usize, carried: Carried) {
        match carried {
            Carried::Packet(packet) if self.takes_packet(link, &packet) => {
                let packet = Ok(packet);
                // Fails only where there is no such link.
                if self.dimsart.deliver(link, &packet).is_ok()
                    && let Ok(packet) = packet
                {
                    self.arrivals.add(tick, link, packet);
                }
            }
            carried => {
                let bytes = carried.into_bytes();
                self.receive_bytes(tick, link, &bytes);
            }
        }
    }

    /// Whether the controller takes a packet, and nobody looks at its bytes.
    fn takes_packet(&self, link: usize, packet: &Packet) -> bool {
        let is_guarded = self.guarded.as_ref().is_some_and(|guarded| guarded.link == link);
        let is_looked_at =
            is_guarded || self.remote.is_some() || self.trace.is_some() || self.inputs.is_some();
        !is_looked_at && packet.channel == self.dimsart.listening_channel(link) && packet.counter != 0
    }

    fn receive_bytes(&mut self, tick: u64, link: usize, bytes: &[u8]) {
        let Self { guarded, remote, dimsart, is_tagged, trace, inputs, arrivals, .. } = self;
        let listening_channel = dimsart.listening_channel(link);
        let mut give = |content: &[u8]| match remote {
            Some(remote) => remote.receive(link, content),
            // What is refused is counted by the controller.
            None => {
                if let Some(trace) = trace {
                    trace.received.push((link, dimsart.listening_channel(link), content.to_vec()));
                }
                if let Err(PacketError::Class { found }) = dimsart.receive(link, content) {
                    *is_tagged |= found >= HANDSHAKE;
                }
            }
        };
        let mut deliver = |content: &[u8]| {
            if let Ok(packet) = Packet::from_bytes(content, listening_channel) {
                arrivals.add(tick, link, packet);
            }
            inputs.iter_mut().for_each(|inputs| inputs.packets.push((link, content.to_vec())));
            give(content);
        };
        match guarded.as_mut().filter(|guarded| guarded.link == link) {
            Some(guarded) => guarded.open(bytes, deliver),
            None => deliver(bytes),
        }
    }

    fn send(&mut self, link: usize, mut carry: impl FnMut(Carried)) {
        let Self { guarded, remote, dimsart, trace, .. } = self;
        let mut guarded = guarded.as_mut().filter(|guarded| guarded.link == link);
        if let Some(guarded) = &mut guarded {
            guarded.tick();
            guarded.shake_hands(|bytes| carry(bytes.into()));
        }
        let mut carry = |content: Carried| match &mut guarded {
            Some(guarded) => guarded.seal(&content.into_bytes(), |bytes| carry(bytes.into())),
            None => carry(content),
        };
        match remote {
            Some(remote) => remote.outgoing(link).map(Carried::from).for_each(carry),
            None => {
                if let Some(packet) = dimsart.outgoing(link) {
                    trace.iter_mut().for_each(|trace| trace.sent.push((link, packet.clone())));
                    carry(Carried::Packet(packet));
                }
            }
        }
    }

    fn tick(&mut self) {
        self.plant.sense(&mut self.sensed);
        for (place, shown) in &self.shown {
            let value = match shown {
                Shown::Value(value) => *value,
                Shown::Place(other) => self.sensed.get(*other).copied().unwrap_or_default(),
            };
            self.sensed.iter_mut().skip(*place).take(1).for_each(|word| *word = value);
        }
        for (word, sensed) in self.measured.iter_mut().zip(&self.sensed) {
            *word = Word::from(*sensed);
        }
        self.inputs.iter_mut().for_each(|inputs| self.measured.clone_into(&mut inputs.measured));
        self.dimsart.allow_motion(self.is_motion_allowed);
        self.last_tick = match &mut self.remote {
            None => match &mut self.trace {
                None => self.dimsart.tick(&self.measured, &mut self.commanded),
                Some(trace) => self.dimsart.tick_observed(&self.measured, &mut self.commanded, trace),
            },
            Some(remote) => match remote.tick(&self.measured, &mut self.commanded, &mut self.dimsart) {
                Ok(tick) => tick,
                Err(trouble) => {
                    self.commanded.fill(Word(0));
                    self.trouble.get_or_insert(trouble);
                    Tick::Idle
                }
            },
        };
        if let Some(trace) = &mut self.trace {
            trace.keep(&self.measured, &self.commanded);
        }
        for (command, word) in self.command.iter_mut().zip(&self.commanded) {
            *command = f32::from_bits(word.0);
        }
    }
}

/// The first class that has to do with keys.
const HANDSHAKE: u8 = Class::Handshake as u8;

/// Why what comes in over a link is not trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum AuthenticationFailure {
    /// The guard refused it.
    #[error("{0}")]
    Refused(AuthError),
    /// It has a tag, and there is no guard.
    #[error("it is authenticated, and this side has no key")]
    NoKeyHere,
}

/// Where a link begins or ends: a station and its link number there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct End {
    /// Index of the station.
    pub station: usize,
    /// Link number in the station's Data Base.
    pub link: usize,
}

#[derive(Debug)]
struct Connection {
    from: End,
    to: End,
    link: Box<dyn Link>,
}

/// Stations and the connections between them, stepped together.
#[derive(Debug)]
pub struct Rig {
    stations: Vec<Station>,
    connections: Vec<Connection>,
    period_s: f64,
    tick: u64,
}

impl Rig {
    /// An empty rig whose controllers are stepped every `period_s`.
    #[must_use]
    pub fn new(period_s: f64) -> Self {
        Self { stations: Vec::new(), connections: Vec::new(), period_s, tick: 0 }
    }

    /// Adds a station; stations are stepped in the order they were added.
    pub fn add(&mut self, station: Station) -> usize {
        self.stations.push(station);
        self.stations.len() - 1
    }

    /// Lets a link carry what leaves at `from` to where it enters, `to`. For a link to another process
    /// both ends are the same.
    pub fn connect(&mut self, from: End, to: End, link: Box<dyn Link>) {
        self.connections.push(Connection { from, to, link });
    }

    /// Lets the guards of two stations find together before the first tick, as if the link had been there long
    /// before. Does nothing to stations without guards.
    pub fn introduce(&mut self, left: usize, right: usize) {
        let Ok([left, right]) = self.stations.get_disjoint_mut([left, right]) else { return };
        if let (Some(left), Some(right)) = (&mut left.guarded, &mut right.guarded) {
            guarded::introduce(&mut left.guard, &mut right.guard);
        }
    }

    /// The stations, in the order they were added.
    #[must_use]
    pub fn stations(&self) -> &[Station] {
        &self.stations
    }

    /// The stations, to be given commands between two steps.
    pub fn stations_mut(&mut self) -> &mut [Station] {
        &mut self.stations
    }

    /// Time between two ticks, `s`.
    #[must_use]
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// What the media between the stations came to so far, each with the packets of all links over it.
    #[must_use]
    pub fn media(&self) -> Vec<MediumReport> {
        let mut media: Vec<MediumReport> = Vec::new();
        for report in self.connections.iter().filter_map(|connection| connection.link.report(self.tick)) {
            match media.iter_mut().find(|medium| medium.traffic.medium == report.traffic.medium) {
                Some(medium) => medium.join(report),
                None => media.push(report),
            }
        }
        media
    }

    /// Ticks that packets take over each connection, in the order of [`connect`](Self::connect); none for one that
    /// does not measure it.
    pub fn transit_ticks(&self) -> impl Iterator<Item = Option<TransitTicks>> {
        self.connections.iter().map(|connection| connection.link.transit_ticks())
    }

    /// Steps done.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        self.tick
    }

    /// Virtual time, `s`.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        tick_seconds(self.tick, self.period_s)
    }

    /// Takes what went wrong with the board of a station, by the station's name; its device then gets no force.
    pub fn trouble(&mut self) -> Option<(String, RemoteError)> {
        let taken =
            |station: &mut Station| station.trouble.take().map(|trouble| (station.name.clone(), trouble));
        self.stations.iter_mut().find_map(taken)
    }

    /// One tick of every controller. The world stands still: what the controllers saw and commanded
    /// can be looked at before [`advance`](Self::advance).
    pub fn tick(&mut self) {
        let tick = self.tick;
        for (index, station) in
            self.stations.iter_mut().enumerate().filter(|(_, station)| station.is_due(tick))
        {
            station.trace.iter_mut().for_each(TickTrace::clear);
            station.arrivals.begin_tick();
            for connection in self.connections.iter_mut().filter(|connection| connection.to.station == index)
            {
                let end = connection.to.link;
                connection.link.receive_carried(tick, &mut |carried| station.receive(tick, end, carried));
            }
            station.tick();
            for connection in
                self.connections.iter_mut().filter(|connection| connection.from.station == index)
            {
                let (tick, link) = (self.tick, &mut connection.link);
                if station.resets_links {
                    link.reset(tick);
                }
                station.send(connection.from.link, |carried| link.send_carried(tick, carried));
            }
            station.resets_links = false;
        }
    }

    /// Moves the world on to the next tick, with the forces held that were commanded.
    pub fn advance(&mut self) {
        let start_s = self.time_s();
        for station in &mut self.stations {
            station.plant.switch(station.is_driven());
            station.plant.advance(start_s, self.period_s, &station.command);
            if station.is_due(self.tick) {
                station.inputs.iter_mut().for_each(Inputs::clear);
            }
        }
        self.tick += 1;
    }

    /// Lets a tick pass in which nothing moves.
    pub fn stand_still(&mut self) {
        self.tick += 1;
    }

    /// [`tick`](Self::tick), then [`advance`](Self::advance).
    pub fn step(&mut self) {
        self.tick();
        self.advance();
    }
}

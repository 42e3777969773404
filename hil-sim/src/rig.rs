//! A rig: controllers, plants and links in one virtual time.
//!
//! ```text
//! every tick, controller by controller:  link ──bytes──▶ Dimsart ◀──positions── plant
//!                                        link ◀──bytes── Dimsart ──forces─────▶ plant (held for a tick)
//! ```
//! The controller is the same code as on a board ([`Dimsart::tick`](dimsart_core::Dimsart::tick)); it can also run
//! [on a board](Station::run_on_board).

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
use dimsart_core::{Packet, PacketError, TickResult, Word};
use dimsart_link::auth::{AuthError, SecureChannel};

use crate::bus::MediumReport;
use crate::bus::time::tick_time_s;
use crate::link::{Link, Payload, TransitTicks};
use crate::plant::Plant;
use arrivals::Arrivals;
use guarded::Guarded;

/// A controller with its plant.
#[derive(Debug)]
pub struct Station {
    /// Name, such as `master`.
    pub name: String,
    /// The controller, or the copy of a board's controller: the copy is not ticked and mirrors the board's Data Base.
    pub dimsart: Box<SimulatedDimsart>,
    /// The plant.
    pub plant: Box<dyn Plant>,
    /// Result of the last tick.
    pub last_tick: TickResult,
    every_ticks: u64,
    remote: Option<Box<dyn RemoteController>>,
    trouble: Option<RemoteError>,
    guarded: Option<Guarded>,
    /// Whether an authenticated packet arrived without a guard.
    is_tagged: bool,
    resets_links: bool,
    is_motion_allowed: bool,
    trace: Option<TickTrace>,
    inputs: Option<Inputs>,
    arrivals: Arrivals,
    sensed: Vec<f32>,
    /// Frame entries that are overridden.
    shown: Vec<(usize, FrameOverride)>,
    measured: Vec<Word>,
    commanded: Vec<Word>,
    command: Vec<f32>,
}

/// Override of a frame entry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FrameOverride {
    /// Value.
    Value(f32),
    /// Value of another entry in the same tick.
    OtherEntry(usize),
}

impl Station {
    /// Connects a controller to the sensors and actuators of a plant.
    #[must_use]
    pub fn new(name: &str, dimsart: Box<SimulatedDimsart>, plant: Box<dyn Plant>) -> Self {
        let (words_in, words_out) = (dimsart.frame().output_words(), dimsart.frame().input_words());
        Self {
            name: name.to_owned(),
            dimsart,
            plant,
            last_tick: TickResult::Idle,
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

    /// Returns the measured positions of the last tick, `m` or `rad`, one per axis.
    #[must_use]
    pub fn position(&self) -> &[f32] {
        self.sensed.get(..self.plant.dof()).unwrap_or_default()
    }

    /// Returns the commands of the last tick, `N` or `N m`, one per axis.
    #[must_use]
    pub fn command(&self) -> &[f32] {
        &self.command
    }

    /// Sets the ticks of the rig per tick of its controller; commands are held in between. 0 counts as 1.
    pub fn set_ticks_per_step(&mut self, ticks: u32) {
        self.every_ticks = u64::from(ticks.max(1));
    }

    /// Returns the ticks of the rig per tick of its controller.
    #[must_use]
    pub fn ticks_per_step(&self) -> usize {
        usize::try_from(self.every_ticks).unwrap_or(usize::MAX)
    }

    /// Whether its controller runs in a tick of the rig.
    #[must_use]
    pub fn is_due(&self, tick: u64) -> bool {
        tick.is_multiple_of(self.every_ticks)
    }

    /// Overrides a frame entry from the next tick on.
    pub fn override_entry(&mut self, place: usize, shown: FrameOverride) {
        self.shown.retain(|(changed, _)| *changed != place);
        self.shown.push((place, shown));
    }

    /// Returns the value of a frame entry in the last tick.
    #[must_use]
    pub fn entry_value(&self, place: usize) -> Option<f32> {
        self.sensed.get(place).copied()
    }

    /// Replaces the controller, and the guard of its link if the board has a key, by a board that was started with
    /// this station's controller.
    pub fn run_on_board(&mut self, board: impl RemoteController + 'static) {
        if board.is_authenticated() {
            self.guarded = None;
        }
        self.remote = Some(Box::new(board));
    }

    /// Returns the board that runs the controller, if any.
    pub fn board_mut(&mut self) -> Option<&mut (dyn RemoteController + 'static)> {
        self.remote.as_deref_mut()
    }

    /// Starts tracing the ticks of the controller, if it runs in this process.
    pub fn start_trace(&mut self) {
        self.trace = Some(TickTrace::default());
    }

    /// Returns the trace of the last tick; `None` before [start](Self::start_trace).
    #[must_use]
    pub fn trace(&self) -> Option<&TickTrace> {
        self.trace.as_ref()
    }

    /// Starts recording the inputs of the controller. Not available for a board that authenticates its links itself.
    pub fn record_inputs(&mut self) {
        let is_open = !self.remote.as_ref().is_some_and(|remote| remote.is_authenticated());
        self.inputs = is_open.then(Inputs::default);
    }

    /// Returns the inputs of the last tick; `None` unless they are [kept](Self::record_inputs).
    #[must_use]
    pub fn inputs(&self) -> Option<&Inputs> {
        self.inputs.as_ref()
    }

    /// Returns the inputs for adding commands.
    pub fn inputs_mut(&mut self) -> Option<&mut Inputs> {
        self.inputs.as_mut()
    }

    /// [Enables motion](dimsart_core::Dimsart::set_motion_allowed) from the next tick on, or disables it.
    pub fn set_motion_allowed(&mut self, is_allowed: bool) {
        self.is_motion_allowed = is_allowed;
        self.inputs.iter_mut().for_each(|inputs| inputs.is_motion_allowed = is_allowed);
    }

    /// Restores bus-off nodes of its links in the next tick, as a reset of the board does.
    pub fn reset_links(&mut self) {
        self.resets_links = true;
    }

    /// Enables authentication of a link. Its clock counts ticks of a controller with period `period_s`.
    pub fn enable_authentication(&mut self, link: usize, guard: SecureChannel, period_s: f64) {
        self.guarded = Some(Guarded::new(link, guard, period_s));
    }

    /// Whether a link is authenticated.
    pub(crate) fn is_guarded(&self) -> bool {
        self.guarded.is_some()
    }

    /// Returns the latest authentication failure, if any.
    #[must_use]
    pub fn authentication_failure(&self) -> Option<AuthenticationFailure> {
        let refusal = self.guarded.as_ref().and_then(|guarded| guarded.refusal);
        refusal
            .map(AuthenticationFailure::Refused)
            .or(self.is_tagged.then_some(AuthenticationFailure::MissingKey))
    }

    /// Returns the number of superseded packets.
    #[must_use]
    pub fn superseded(&self) -> u32 {
        self.arrivals.superseded()
    }

    /// Returns the number of restarts of the sender on a link.
    #[must_use]
    pub fn restarts(&self) -> u32 {
        self.arrivals.restarts()
    }

    /// Returns the packets per tick sent on a link, including lost packets; `None` after too few packets.
    #[must_use]
    pub fn packets_per_tick(&self, link: usize) -> Option<f64> {
        self.arrivals.packets_per_tick(link)
    }

    /// Whether its actuators are active: commanded by the scheme or ramping to zero.
    fn is_driven(&self) -> bool {
        self.last_tick == TickResult::Ran || self.command.iter().any(|command| *command != 0.0)
    }

    fn receive(&mut self, tick: u64, link: usize, carried: Payload) {
        match carried {
            Payload::Packet(packet) if self.takes_packet(link, &packet) => {
                let packet = Ok(packet);
                // Fails only for a nonexistent link.
                if self.dimsart.receive_parsed(link, &packet).is_ok()
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

    /// Whether the controller accepts packets without inspection of their bytes.
    fn takes_packet(&self, link: usize, packet: &Packet) -> bool {
        let is_guarded = self.guarded.as_ref().is_some_and(|guarded| guarded.link == link);
        let is_looked_at =
            is_guarded || self.remote.is_some() || self.trace.is_some() || self.inputs.is_some();
        !is_looked_at && packet.channel == self.dimsart.receive_channel(link) && packet.counter != 0
    }

    fn receive_bytes(&mut self, tick: u64, link: usize, bytes: &[u8]) {
        let Self { guarded, remote, dimsart, is_tagged, trace, inputs, arrivals, .. } = self;
        let receive_channel = dimsart.receive_channel(link);
        let mut give = |content: &[u8]| match remote {
            Some(remote) => remote.receive(link, content),
            // The controller counts refused packets.
            None => {
                if let Some(trace) = trace {
                    trace.received.push((link, dimsart.receive_channel(link), content.to_vec()));
                }
                if let Err(PacketError::Class { found }) = dimsart.receive(link, content) {
                    *is_tagged |= found >= HANDSHAKE;
                }
            }
        };
        let mut deliver = |content: &[u8]| {
            if let Ok(packet) = Packet::from_bytes(content, receive_channel) {
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

    fn send(&mut self, link: usize, mut carry: impl FnMut(Payload)) {
        let Self { guarded, remote, dimsart, trace, .. } = self;
        let mut guarded = guarded.as_mut().filter(|guarded| guarded.link == link);
        if let Some(guarded) = &mut guarded {
            guarded.tick();
            guarded.send_handshake(|bytes| carry(bytes.into()));
        }
        let mut carry = |content: Payload| match &mut guarded {
            Some(guarded) => guarded.seal(&content.into_bytes(), |bytes| carry(bytes.into())),
            None => carry(content),
        };
        match remote {
            Some(remote) => remote.outgoing(link).map(Payload::from).for_each(carry),
            None => {
                if let Some(packet) = dimsart.take_outgoing(link) {
                    trace.iter_mut().for_each(|trace| trace.sent.push((link, packet.clone())));
                    carry(Payload::Packet(packet));
                }
            }
        }
    }

    fn tick(&mut self) {
        self.plant.sense(&mut self.sensed);
        for (place, shown) in &self.shown {
            let value = match shown {
                FrameOverride::Value(value) => *value,
                FrameOverride::OtherEntry(other) => self.sensed.get(*other).copied().unwrap_or_default(),
            };
            self.sensed.iter_mut().skip(*place).take(1).for_each(|word| *word = value);
        }
        for (word, sensed) in self.measured.iter_mut().zip(&self.sensed) {
            *word = Word::from(*sensed);
        }
        self.inputs.iter_mut().for_each(|inputs| self.measured.clone_into(&mut inputs.measured));
        self.dimsart.set_motion_allowed(self.is_motion_allowed);
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
                    TickResult::Idle
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

/// First class of handshake packets.
const HANDSHAKE: u8 = Class::Handshake as u8;

/// Authentication failure of a received packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum AuthenticationFailure {
    /// The guard refused it.
    #[error("{0}")]
    Refused(AuthError),
    /// The packet has a tag and there is no guard.
    #[error("the packet is authenticated, but this controller has no key")]
    MissingKey,
}

/// End of a link: station and link number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StationLink {
    /// Index of the station.
    pub station: usize,
    /// Link number in the station's Data Base.
    pub link: usize,
}

#[derive(Debug)]
struct Connection {
    from: StationLink,
    to: StationLink,
    link: Box<dyn Link>,
}

/// Stations and their connections, stepped together.
#[derive(Debug)]
pub struct Rig {
    stations: Vec<Station>,
    connections: Vec<Connection>,
    period_s: f64,
    tick: u64,
}

impl Rig {
    /// Creates an empty rig with controllers of period `period_s`.
    #[must_use]
    pub fn new(period_s: f64) -> Self {
        Self { stations: Vec::new(), connections: Vec::new(), period_s, tick: 0 }
    }

    /// Adds a station; stations are stepped in the order of addition.
    pub fn add(&mut self, station: Station) -> usize {
        self.stations.push(station);
        self.stations.len() - 1
    }

    /// Connects a link from `from` to `to`. For a link to another process both ends are equal.
    pub fn connect(&mut self, from: StationLink, to: StationLink, link: Box<dyn Link>) {
        self.connections.push(Connection { from, to, link });
    }

    /// Completes the handshake of two stations' guards before the first tick. No effect without guards.
    pub fn complete_handshake(&mut self, left: usize, right: usize) {
        let Ok([left, right]) = self.stations.get_disjoint_mut([left, right]) else { return };
        if let (Some(left), Some(right)) = (&mut left.guarded, &mut right.guarded) {
            guarded::complete_handshake(&mut left.guard, &mut right.guard);
        }
    }

    /// Returns the stations in stepping order.
    #[must_use]
    pub fn stations(&self) -> &[Station] {
        &self.stations
    }

    /// Returns the stations for commands between two steps.
    pub fn stations_mut(&mut self) -> &mut [Station] {
        &mut self.stations
    }

    /// Returns the sample period, `s`.
    #[must_use]
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// Returns the reports of the media, including the packets of all links.
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

    /// Returns the delay of each connection in ticks, in the order of [`connect`](Self::connect); `None` if not
    /// measured.
    pub fn transit_ticks(&self) -> impl Iterator<Item = Option<TransitTicks>> {
        self.connections.iter().map(|connection| connection.link.transit_ticks())
    }

    /// Returns the number of ticks.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        self.tick
    }

    /// Returns the virtual time, `s`.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        tick_time_s(self.tick, self.period_s)
    }

    /// Takes the error of a station's board, with the station's name; its device then gets force 0.
    pub fn take_board_error(&mut self) -> Option<(String, RemoteError)> {
        let taken =
            |station: &mut Station| station.trouble.take().map(|trouble| (station.name.clone(), trouble));
        self.stations.iter_mut().find_map(taken)
    }

    /// Runs one tick of every controller, without moving the plants, so that inputs and commands can be inspected
    /// before [`advance`](Self::advance).
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
                connection.link.receive_payload(tick, &mut |carried| station.receive(tick, end, carried));
            }
            station.tick();
            for connection in
                self.connections.iter_mut().filter(|connection| connection.from.station == index)
            {
                let (tick, link) = (self.tick, &mut connection.link);
                if station.resets_links {
                    link.reset(tick);
                }
                station.send(connection.from.link, |carried| link.send_payload(tick, carried));
            }
            station.resets_links = false;
        }
    }

    /// Advances the plants to the next tick, with constant commands.
    pub fn advance(&mut self) {
        let start_s = self.time_s();
        for station in &mut self.stations {
            station.plant.set_enabled(station.is_driven());
            station.plant.advance(start_s, self.period_s, &station.command);
            if station.is_due(self.tick) {
                station.inputs.iter_mut().for_each(Inputs::clear);
            }
        }
        self.tick += 1;
    }

    /// Advances one tick without motion.
    pub fn advance_without_motion(&mut self) {
        self.tick += 1;
    }

    /// Calls [`tick`](Self::tick), then [`advance`](Self::advance).
    pub fn step(&mut self) {
        self.tick();
        self.advance();
    }
}

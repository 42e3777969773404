//! A node on a CAN bus: what waits to be sent, what came in, and its error counters.

use std::collections::VecDeque;

use super::frame::{CanFrame, Identifier, WireBits};

/// Above, a node is error-passive.
const PASSIVE_ABOVE: u32 = 127;
/// Above, a node leaves the bus.
const BUS_OFF_ABOVE: u32 = 255;

/// How far a node still takes part (ISO 11898-1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorState {
    /// Takes part in full.
    Active,
    /// Errors it sees destroy no frame of others, and it waits 8 bits more between frames of its own.
    Passive,
    /// Neither sends nor receives.
    BusOff,
}

/// One node.
#[derive(Debug)]
pub struct Node {
    /// Its name in pictures.
    pub name: String,
    /// What it listens for.
    pub(super) accepts: Vec<Identifier>,
    pub(super) waiting: VecDeque<Waiting>,
    /// With the moment of arrival, `ns`.
    pub(super) arrived: VecDeque<(u64, CanFrame)>,
    /// Error counters of ISO 11898-1: of what it sends and of what it receives.
    pub(super) transmit_errors: u32,
    pub(super) receive_errors: u32,
    /// Until when it sends nothing: an error-passive node lets others go first.
    pub(super) suspended_until_ns: u64,
    /// When it is on the bus again; 0 while it never was off.
    pub(super) back_ns: u64,
    /// How often it left the bus.
    pub bus_offs: u32,
    /// The same, since its controller was reset last.
    pub(super) recent_bus_offs: u32,
    /// Contents that found no room, or a node that was off.
    pub dropped: u64,
}

/// A frame that waits.
#[derive(Debug)]
pub(super) struct Waiting {
    pub(super) frame: CanFrame,
    pub(super) bits: WireBits,
    pub(super) ready_ns: u64,
}

impl Node {
    pub(super) fn new(name: &str, accepts: &[Identifier]) -> Self {
        Self {
            name: name.to_owned(),
            accepts: accepts.to_vec(),
            waiting: VecDeque::new(),
            arrived: VecDeque::new(),
            transmit_errors: 0,
            receive_errors: 0,
            suspended_until_ns: 0,
            back_ns: 0,
            bus_offs: 0,
            recent_bus_offs: 0,
            dropped: 0,
        }
    }

    /// How far it takes part at a moment.
    #[must_use]
    pub fn state(&self, now_ns: u64) -> ErrorState {
        if now_ns < self.back_ns {
            ErrorState::BusOff
        } else if self.transmit_errors > PASSIVE_ABOVE || self.receive_errors > PASSIVE_ABOVE {
            ErrorState::Passive
        } else {
            ErrorState::Active
        }
    }

    /// Its transmit and receive error counters.
    #[must_use]
    pub fn error_counters(&self) -> (u32, u32) {
        (self.transmit_errors, self.receive_errors)
    }

    /// Counts what became of a frame of its own. True if that was one error too many: it leaves the bus.
    pub(super) fn has_sent(&mut self, well: bool, is_acknowledged: bool) -> bool {
        match (well, is_acknowledged) {
            (true, true) => self.transmit_errors = self.transmit_errors.saturating_sub(1),
            // Alone on the bus: a passive node does not count it, else it would leave for want of company.
            (true, false) if self.transmit_errors > PASSIVE_ABOVE => {}
            _ => self.transmit_errors += 8,
        }
        self.transmit_errors > BUS_OFF_ABOVE
    }

    /// Counts what became of a frame of another node.
    pub(super) fn has_received(&mut self, well: bool) {
        self.receive_errors = match (well, self.receive_errors) {
            (true, errors) if errors > PASSIVE_ABOVE => PASSIVE_ABOVE - 8,
            (true, errors) => errors.saturating_sub(1),
            // It stops counting when it is passive.
            (false, errors) => (errors + 1).min(PASSIVE_ABOVE + 1),
        };
    }

    /// The frame it would send at `start_ns`: the most urgent that waits, the oldest of one identifier first.
    pub(super) fn candidate(&self, start_ns: u64) -> Option<(Identifier, usize)> {
        if start_ns < self.suspended_until_ns || start_ns < self.back_ns {
            return None;
        }
        let ready = self.waiting.iter().enumerate().filter(|(_, waiting)| waiting.ready_ns <= start_ns);
        ready.map(|(place, waiting)| (waiting.frame.identifier, place)).min()
    }

    /// When it next has something to send; none when nothing waits.
    pub(super) fn ready_ns(&self) -> Option<u64> {
        let earliest = self.waiting.iter().map(|waiting| waiting.ready_ns).min()?;
        Some(earliest.max(self.suspended_until_ns).max(self.back_ns))
    }
}

//! A node on a CAN bus: send queue, received frames, error counters.

use std::collections::VecDeque;

use super::frame::{CanFrame, Identifier, WireBits};

/// Limit of error-passive.
const PASSIVE_ABOVE: u32 = 127;
/// Limit of bus-off.
const BUS_OFF_ABOVE: u32 = 255;

/// Error state of a node (ISO 11898-1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorState {
    /// Error-active.
    Active,
    /// Error-passive: does not abort frames of other nodes, and waits 8 more bits between its own frames.
    Passive,
    /// Bus-off: neither sends nor receives.
    BusOff,
}

/// One node.
#[derive(Debug)]
pub struct Node {
    /// Name in pictures.
    pub name: String,
    /// Received identifiers.
    pub(super) accepts: Vec<Identifier>,
    pub(super) waiting: VecDeque<Waiting>,
    /// Received frames with their arrival, `ns`.
    pub(super) arrived: VecDeque<(u64, CanFrame)>,
    /// Transmit and receive error counters (ISO 11898-1).
    pub(super) transmit_errors: u32,
    pub(super) receive_errors: u32,
    /// End of its suspension of transmission, if error-passive.
    pub(super) suspended_until_ns: u64,
    /// Time of its recovery; 0 if never bus-off.
    pub(super) back_ns: u64,
    /// Number of bus-off events.
    pub bus_offs: u32,
    /// Number of bus-off events since the last reset of its controller.
    pub(super) recent_bus_offs: u32,
    /// Dropped packets: queue full or bus-off.
    pub dropped: u64,
}

/// A queued frame.
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

    /// Returns its error state at a time.
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

    /// Returns its transmit and receive error counters.
    #[must_use]
    pub fn error_counters(&self) -> (u32, u32) {
        (self.transmit_errors, self.receive_errors)
    }

    /// Counts the result of its own frame; returns true if it becomes bus-off.
    pub(super) fn has_sent(&mut self, well: bool, is_acknowledged: bool) -> bool {
        match (well, is_acknowledged) {
            (true, true) => self.transmit_errors = self.transmit_errors.saturating_sub(1),
            // Alone on the bus, a passive node does not count a missing acknowledge, to avoid bus-off.
            (true, false) if self.transmit_errors > PASSIVE_ABOVE => {}
            _ => self.transmit_errors += 8,
        }
        self.transmit_errors > BUS_OFF_ABOVE
    }

    /// Counts the result of another node's frame.
    pub(super) fn has_received(&mut self, well: bool) {
        self.receive_errors = match (well, self.receive_errors) {
            (true, errors) if errors > PASSIVE_ABOVE => PASSIVE_ABOVE - 8,
            (true, errors) => errors.saturating_sub(1),
            // Counting stops when passive.
            (false, errors) => (errors + 1).min(PASSIVE_ABOVE + 1),
        };
    }

    /// Returns the frame to send at `start_ns`: highest priority first, oldest first for equal identifiers.
    pub(super) fn candidate(&self, start_ns: u64) -> Option<(Identifier, usize)> {
        if start_ns < self.suspended_until_ns || start_ns < self.back_ns {
            return None;
        }
        let ready = self.waiting.iter().enumerate().filter(|(_, waiting)| waiting.ready_ns <= start_ns);
        ready.map(|(place, waiting)| (waiting.frame.identifier, place)).min()
    }

    /// Returns the time of its next pending frame; `None` without one.
    pub(super) fn ready_ns(&self) -> Option<u64> {
        let earliest = self.waiting.iter().map(|waiting| waiting.ready_ns).min()?;
        Some(earliest.max(self.suspended_until_ns).max(self.back_ns))
    }
}

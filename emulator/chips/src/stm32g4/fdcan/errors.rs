//! Error counters (ISO 11898-1, "fault confinement").

const WARNING: u32 = 96;
const PASSIVE: u32 = 128;
const BUS_OFF: u32 = 256;
/// Error count of an error-passive receiver after a reception: 119 to 127.
const ACTIVE_AGAIN: u32 = 119;

/// Error counters of a controller.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Errors {
    pub(super) transmit: u32,
    pub(super) receive: u32,
    /// Number of errors since the program's last read.
    pub(super) logged: u32,
}

impl Errors {
    pub(super) fn is_warned(self) -> bool {
        self.transmit >= WARNING || self.receive >= WARNING
    }

    pub(super) fn is_passive(self) -> bool {
        self.transmit >= PASSIVE || self.receive >= PASSIVE
    }

    pub(super) fn is_off(self) -> bool {
        self.transmit >= BUS_OFF
    }

    pub(super) fn has_sent(&mut self) {
        self.transmit = self.transmit.saturating_sub(1);
    }

    pub(super) fn has_received(&mut self) {
        self.receive = if self.receive >= PASSIVE { ACTIVE_AGAIN } else { self.receive.saturating_sub(1) };
    }

    /// A transmission failed. An error-passive node does not count a missing acknowledge: otherwise a node
    /// alone on the bus would become bus-off.
    pub(super) fn has_not_sent(&mut self, for_want_of_acknowledge: bool) {
        self.logged = (self.logged + 1).min(0xFF);
        if !(for_want_of_acknowledge && self.is_passive()) {
            self.transmit += 8;
        }
    }

    /// A reception failed. `is_first`: this node was the first to send an error flag.
    pub(super) fn has_not_received(&mut self, is_first: bool) {
        self.logged = (self.logged + 1).min(0xFF);
        let counted = if is_first { 9 } else { 1 };
        // The count saturates above 128.
        self.receive = (self.receive + counted).min(PASSIVE + 8);
    }

    /// `ECR`.
    pub(super) fn register(self) -> u32 {
        let is_passive = u32::from(self.receive >= PASSIVE);
        self.transmit.min(0xFF) | self.receive.min(0x7F) << 8 | is_passive << 15 | self.logged << 16
    }
}

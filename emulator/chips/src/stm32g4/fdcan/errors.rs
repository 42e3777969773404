//! Error counters (ISO 11898-1, "fault confinement").

const WARNING: u32 = 96;
const PASSIVE: u32 = 128;
const BUS_OFF: u32 = 256;
/// What a passive receiver is at after it has received something: 119 to 127.
const ACTIVE_AGAIN: u32 = 119;

/// Counters of a controller.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Errors {
    pub(super) transmit: u32,
    pub(super) receive: u32,
    /// Since the program read it.
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

    /// A frame of its own went wrong. One that nobody acknowledges is not counted by a passive node: it would leave the
    /// bus for want of company.
    pub(super) fn has_not_sent(&mut self, for_want_of_acknowledge: bool) {
        self.logged = (self.logged + 1).min(0xFF);
        if !(for_want_of_acknowledge && self.is_passive()) {
            self.transmit += 8;
        }
    }

    /// A frame of another node was wrong, and this node was the first to say so, or not.
    pub(super) fn has_not_received(&mut self, is_first: bool) {
        self.logged = (self.logged + 1).min(0xFF);
        let counted = if is_first { 9 } else { 1 };
        // Behind 128 it stands still.
        self.receive = (self.receive + counted).min(PASSIVE + 8);
    }

    /// `ECR`.
    pub(super) fn register(self) -> u32 {
        let is_passive = u32::from(self.receive >= PASSIVE);
        self.transmit.min(0xFF) | self.receive.min(0x7F) << 8 | is_passive << 15 | self.logged << 16
    }
}

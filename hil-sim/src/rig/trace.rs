//! What goes into a controller and comes out of it in a tick, kept for who repeats the tick elsewhere.

use dimsart_core::{Observer, Packet, Word};

/// One tick of a controller, seen from outside.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TickTrace {
    /// What came in over links before it, in order: link, channel listened to there, bytes.
    pub received: Vec<(usize, u16, Vec<u8>)>,
    /// What the device measured.
    pub measured: Vec<Word>,
    /// What the device was commanded.
    pub commanded: Vec<Word>,
    /// Packets that it left, with their links.
    pub sent: Vec<(usize, Packet)>,
    /// Calls of modules that were made, by their places in the engine's steps.
    pub called: Vec<usize>,
}

impl Observer for TickTrace {
    fn call(&mut self, place: usize, call: impl FnOnce()) {
        self.called.push(place);
        call();
    }
}

impl TickTrace {
    /// Begins a tick.
    pub fn clear(&mut self) {
        self.received.clear();
        self.sent.clear();
        self.called.clear();
    }

    /// Ends one.
    pub(super) fn keep(&mut self, measured: &[Word], commanded: &[Word]) {
        measured.clone_into(&mut self.measured);
        commanded.clone_into(&mut self.commanded);
    }
}

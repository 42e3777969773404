//! Inputs and outputs of a controller's tick, for comparison.

use dimsart_core::{Observer, Packet, Word};

/// One tick of a controller, seen from outside.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TickTrace {
    /// Packets received before the tick, in order: link, channel, bytes.
    pub received: Vec<(usize, u16, Vec<u8>)>,
    /// Measurement.
    pub measured: Vec<Word>,
    /// Command.
    pub commands: Vec<Word>,
    /// Sent packets, with their links.
    pub sent: Vec<(usize, Packet)>,
    /// Module calls, by index in the engine's steps.
    pub module_calls: Vec<usize>,
}

impl Observer for TickTrace {
    fn call(&mut self, place: usize, call: impl FnOnce()) {
        self.module_calls.push(place);
        call();
    }
}

impl TickTrace {
    /// Starts a tick.
    pub fn clear(&mut self) {
        self.received.clear();
        self.sent.clear();
        self.module_calls.clear();
    }

    /// Ends a tick.
    pub(super) fn keep(&mut self, measured: &[Word], commanded: &[Word]) {
        measured.clone_into(&mut self.measured);
        commanded.clone_into(&mut self.commands);
    }
}

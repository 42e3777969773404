//! Inputs of a controller's tick, for replay.

use dimsart_core::Word;
use dimsart_link::protocol::Response;

/// Inputs of a controller from one tick to the next. Replayed in this order to a controller in the same initial
/// state, they give bit-identical signals.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Inputs {
    /// Requests whose commands were executed before the tick, in order.
    pub commands: Vec<Vec<u8>>,
    /// Whether motion was enabled.
    pub is_motion_allowed: bool,
    /// Packets received over links, in order: link number and bytes.
    pub packets: Vec<(usize, Vec<u8>)>,
    /// Measurement.
    pub measured: Vec<Word>,
}

impl Default for Inputs {
    /// No packets, motion enabled: for a controller without motion control.
    fn default() -> Self {
        Self { commands: Vec::new(), is_motion_allowed: true, packets: Vec::new(), measured: Vec::new() }
    }
}

impl Inputs {
    /// Keeps a request with an executed command.
    pub fn add_request(&mut self, content: &[u8], response: &Response<'_>) {
        // Other requests have no effect.
        if matches!(response, Response::Effect(effect) if effect.refused.is_none()) {
            self.commands.push(content.to_vec());
        }
    }

    /// Clears the inputs of a tick.
    pub(super) fn clear(&mut self) {
        self.commands.clear();
        self.packets.clear();
    }
}

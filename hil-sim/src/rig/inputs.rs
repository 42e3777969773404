//! All that a controller's tick depends on, kept for who repeats it elsewhere.

use dimsart_core::Word;
use dimsart_link::protocol::Response;

/// What went into a controller from one of its ticks to the next. Given in this order to a controller that began as it did,
/// it makes the same signals, bit by bit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Inputs {
    /// Contents of the requests whose commands were carried out before the tick, in order.
    pub commands: Vec<Vec<u8>>,
    /// Whether the device was allowed to move.
    pub is_motion_allowed: bool,
    /// What came in over links, in order: the link's number and the bytes.
    pub packets: Vec<(usize, Vec<u8>)>,
    /// What the device measured.
    pub measured: Vec<Word>,
}

impl Default for Inputs {
    /// Nothing came, and the device may move: as a controller that nobody has to permit anything.
    fn default() -> Self {
        Self { commands: Vec::new(), is_motion_allowed: true, packets: Vec::new(), measured: Vec::new() }
    }
}

impl Inputs {
    /// Keeps a request, if it was a command that was carried out.
    pub fn add_request(&mut self, content: &[u8], response: &Response<'_>) {
        // Nothing else has an effect.
        if matches!(response, Response::Effect(effect) if effect.refused.is_none()) {
            self.commands.push(content.to_vec());
        }
    }

    /// Forgets what is of one tick alone.
    pub(super) fn clear(&mut self) {
        self.commands.clear();
        self.packets.clear();
    }
}

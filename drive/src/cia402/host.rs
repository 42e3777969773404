//! Frames of the controller to all drives of a bus.

use super::{Cia402Frame, Cia402Node, Cia402Settings, OPERATIONAL};

/// The controller as a `CANopen` node.
#[derive(Debug, Clone)]
pub struct Cia402Host {
    node: Cia402Node,
    heartbeat_ticks: u16,
    ticks: u16,
}

impl Cia402Host {
    /// Creates the host of the drives with these settings.
    #[must_use]
    pub fn new(settings: &Cia402Settings) -> Self {
        Self { node: settings.host, heartbeat_ticks: settings.heartbeat_ticks(), ticks: 0 }
    }

    /// Returns SYNC, to be sent after the frames of all joints, then a heartbeat if due. Call once per tick.
    pub fn frames(&mut self) -> (Cia402Frame, Option<Cia402Frame>) {
        let is_due = self.ticks == 0;
        self.ticks = if is_due { self.heartbeat_ticks } else { self.ticks }.saturating_sub(1);
        let heartbeat = is_due.then(|| Cia402Frame::new(self.node.heartbeat_id(), [OPERATIONAL]));
        (Cia402Frame::new(Cia402Node::SYNC_ID, []), heartbeat)
    }
}

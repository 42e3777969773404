//! A link over a simulated, shared CAN bus.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use dimsart_link::carrier::can::{Assembler, frames};
use dimsart_link::carrier::can_fd::{pack, unpack};

use super::medium::{Medium, MediumState, Refusal};
use crate::bus::can::{CanBus, CanFrame, ErrorState, Format, Identifier};

/// Bus shared by several links.
#[derive(Debug, Clone)]
pub(super) struct SharedBus(Arc<Mutex<CanBus>>);

impl SharedBus {
    pub(super) fn new(bus: CanBus) -> Self {
        Self(Arc::new(Mutex::new(bus)))
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, CanBus> {
        // A poisoned lock is safe: every call leaves the bus consistent.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// One direction between two nodes.
#[derive(Debug)]
pub(super) struct CanDirection {
    pub(super) bus: SharedBus,
    pub(super) format: Format,
    /// Channel of the packets, which protects classic frames in [`frames`].
    pub(super) channel: u16,
    pub(super) identifier: Identifier,
    pub(super) sender: usize,
    pub(super) receiver: usize,
    /// Other nodes with their identifiers; each sends a packet of equal size with each packet.
    pub(super) others: Vec<(usize, Identifier)>,
    pub(super) assembler: Box<Assembler>,
}

/// Returns the frames of a packet; `None` if it is too long.
pub(crate) fn can_frames(
    content: &[u8],
    channel: u16,
    format: Format,
    identifier: Identifier,
) -> Option<Vec<CanFrame>> {
    match format {
        Format::Classic => {
            frames(content, channel)?.map(|data| CanFrame::new(identifier, format, &data)).collect()
        }
        Format::Fd => Some(vec![CanFrame::new(identifier, format, &pack(content)?)?]),
    }
}

impl Medium for CanDirection {
    fn send(&mut self, now_ns: u64, content: &[u8]) -> Result<(), Refusal> {
        let framed = |identifier| can_frames(content, self.channel, self.format, identifier);
        let frames = framed(self.identifier).ok_or(Refusal::TooLong)?;
        let mut bus = self.bus.lock();
        for (node, identifier) in &self.others {
            // Dropped packets are counted by the node.
            bus.submit(*node, now_ns, framed(*identifier).unwrap_or_default());
        }
        let is_off =
            bus.nodes().get(self.sender).is_some_and(|node| node.state(now_ns) == ErrorState::BusOff);
        match bus.submit(self.sender, now_ns, frames) {
            true => Ok(()),
            false if is_off => Err(Refusal::BusOff),
            false => Err(Refusal::QueueFull),
        }
    }

    fn receive(&mut self, now_ns: u64, deliver: &mut dyn FnMut(&[u8])) {
        let Self { assembler, channel, format, .. } = self;
        self.bus.lock().receive_by_id((self.receiver, self.identifier), now_ns, |_, frame| {
            let content = match format {
                Format::Classic => assembler.push(frame.data(), *channel),
                Format::Fd => unpack(frame.data()),
            };
            content.into_iter().for_each(&mut *deliver);
        });
    }

    fn reset(&mut self, now_ns: u64) {
        self.bus.lock().reset(self.sender, now_ns);
    }

    fn state(&self, now_ns: u64) -> MediumState {
        let bus = self.bus.lock();
        let nodes = bus.nodes();
        let gone = nodes.iter().filter(|node| node.bus_offs > 0).map(|node| {
            let (name, bus_offs) = (&node.name, node.bus_offs);
            let now = match node.state(now_ns) {
                ErrorState::BusOff => "and is still bus-off at the end",
                ErrorState::Active | ErrorState::Passive => "and recovered",
            };
            format!("the {name} went bus-off {bus_offs} times {now}; lower can.bit_error_rate")
        });
        let others = self.others.iter().filter_map(|(number, _)| nodes.get(*number));
        let crowded = match others.map(|node| node.dropped).sum() {
            0_u64 => None,
            dropped => Some(format!(
                "CAN bus: {dropped} packets of the other nodes (can.other_nodes) were dropped, \
                send queue full; raise the bit rates or reduce can.other_nodes"
            )),
        };
        let longest_ns = bus.responses().values().map(|response| response.longest_ns).max();
        MediumState {
            busy_ns: bus.busy_ns(),
            errors: bus.error_frames(),
            bus_offs: nodes.iter().map(|node| node.bus_offs).sum(),
            longest_ns: longest_ns.unwrap_or(0),
            senders: nodes.iter().map(|node| node.name.clone()).collect(),
            timeline: bus.timeline().clone(),
            faults: gone.chain(crowded).collect(),
        }
    }
}

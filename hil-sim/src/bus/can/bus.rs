//! CAN bus: arbitration, frame times, error frames with retransmission, bus-off.
//!
//! ```text
//! submit ──▶ waiting (per node) ──arbitration──▶ wire ──▶ arrived (per node) ──▶ receive
//! ```
//! When the bus is idle, the pending frame with the lowest identifier is sent. All nodes see a bit error: the frame
//! is aborted, followed by an error frame and a retransmission. An error in the last bit is too late for receivers,
//! which accept the frame twice. Error counters, error-passive and bus-off states follow ISO 11898-1. A bus-off node
//! recovers after 128 times 11 recessive bits, up to a maximum number of recoveries.

use std::collections::BTreeMap;

use super::frame::{CanFrame, INTERFRAME_BITS, Identifier, WireBits};
use super::node::{ErrorState, Node, Waiting};
use crate::bus::Random;
use crate::bus::time::bits_to_ns;
use crate::bus::traffic::{BusyInterval, Timeline};

/// Maximum bits of an error frame, including the interframe space: flag, echoed flag, delimiter.
const ERROR_FRAME_BITS: u32 = 6 + 6 + 8 + INTERFRAME_BITS;
/// Additional bits that an error-passive node waits after its own frame.
const SUSPENDED_BITS: u32 = 8;
/// Recovery from bus-off: length and number of recessive sequences.
const REJOIN_BITS: u32 = 128 * RECESSIVE_BITS;
const RECESSIVE_BITS: u32 = 11;
/// Position of the acknowledge bit from the end of a frame.
const BITS_FROM_ACKNOWLEDGE: u32 = 9;

/// Parameters of a bus.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CanParameters {
    /// Nominal bit rate, `bit/s`.
    pub bits_per_s: u32,
    /// Data bit rate of CAN FD, `bit/s`.
    pub data_bits_per_s: u32,
    /// Probability of a bit error seen by all nodes, 0 to 1.
    pub bit_error_rate: f64,
    /// Maximum number of recoveries from bus-off.
    pub rejoins: u32,
    /// Queue size of a node, frames.
    pub queue_frames: usize,
}

/// Response times of an identifier, from queueing to end of frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Response {
    /// Number of sent frames.
    pub frames: u64,
    /// Maximum, `ns`.
    pub longest_ns: u64,
    /// Sum, `ns`.
    pub sum_ns: u64,
}

/// A bus with its nodes.
#[derive(Debug)]
pub struct CanBus {
    parameters: CanParameters,
    random: Random,
    nodes: Vec<Node>,
    /// Time at which the bus becomes idle.
    free_ns: u64,
    busy_ns: u64,
    error_frames: u64,
    responses: BTreeMap<Identifier, Response>,
    timeline: Timeline,
}

impl CanBus {
    /// Creates a bus without nodes, with a random seed.
    #[must_use]
    pub fn new(parameters: CanParameters, seed: u64) -> Self {
        Self {
            parameters,
            random: Random::new(seed),
            nodes: Vec::new(),
            free_ns: 0,
            busy_ns: 0,
            error_frames: 0,
            responses: BTreeMap::new(),
            timeline: Timeline::default(),
        }
    }

    /// Adds a node that receives these identifiers; returns its number.
    pub fn add(&mut self, name: &str, accepts: &[Identifier]) -> usize {
        self.nodes.push(Node::new(name, accepts));
        self.nodes.len() - 1
    }

    /// Returns the nodes, by number.
    #[must_use]
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Returns the number of error frames.
    #[must_use]
    pub fn error_frames(&self) -> u64 {
        self.error_frames
    }

    /// Returns the busy time including interframe spaces, `ns`.
    #[must_use]
    pub fn busy_ns(&self) -> u64 {
        self.busy_ns
    }

    /// Returns the response times by identifier, highest priority first.
    #[must_use]
    pub fn responses(&self) -> &BTreeMap<Identifier, Response> {
        &self.responses
    }

    /// Returns the timeline.
    #[must_use]
    pub fn timeline(&self) -> &Timeline {
        &self.timeline
    }

    /// Queues the frames of a packet in a node from `now_ns` on; calls must be in order of time. Returns false if
    /// they do not all fit; then no frame is queued and the node counts the drop.
    pub fn submit(&mut self, node: usize, now_ns: u64, frames: Vec<CanFrame>) -> bool {
        if self.is_queue_full(node, now_ns, frames.len()) {
            return false;
        }
        let Some(node) = self.nodes.get_mut(node) else { return false };
        node.waiting.extend(frames.into_iter().map(|frame| Waiting {
            bits: frame.wire_bits(),
            frame,
            ready_ns: now_ns,
        }));
        true
    }

    /// Resets a node: a bus-off node joins again without recovery.
    pub fn reset(&mut self, node: usize, now_ns: u64) {
        self.run_until(now_ns);
        let rejoin_ns = bits_to_ns(REJOIN_BITS, self.parameters.bits_per_s);
        if let Some(node) = self.nodes.get_mut(node) {
            node.recent_bus_offs = 0;
            node.back_ns = node.back_ns.min(now_ns + rejoin_ns);
        }
    }

    /// Whether a packet of this many frames does not fit from `now_ns` on; the node then counts the drop.
    pub fn is_queue_full(&mut self, node: usize, now_ns: u64, frames: usize) -> bool {
        self.run_until(now_ns);
        let room = self.parameters.queue_frames;
        let Some(node) = self.nodes.get_mut(node) else { return true };
        let is_full = node.state(now_ns) == ErrorState::BusOff || node.waiting.len() + frames > room;
        node.dropped += u64::from(is_full);
        is_full
    }

    /// Passes received frames of a node that ended by `now_ns` to `deliver`.
    pub fn receive(&mut self, node: usize, now_ns: u64, mut deliver: impl FnMut(u64, &CanFrame)) {
        self.run_until(now_ns);
        let Some(node) = self.nodes.get_mut(node) else { return };
        while let Some((arrival_ns, frame)) =
            node.arrived.pop_front_if(|(arrival_ns, _)| *arrival_ns <= now_ns)
        {
            deliver(arrival_ns, &frame);
        }
    }

    /// Like `receive`, for frames with this identifier only.
    pub fn receive_by_id(
        &mut self,
        (node, identifier): (usize, Identifier),
        now_ns: u64,
        mut deliver: impl FnMut(u64, &CanFrame),
    ) {
        self.run_until(now_ns);
        let Some(node) = self.nodes.get_mut(node) else { return };
        node.arrived.retain(|(arrival_ns, frame)| {
            let is_it = *arrival_ns <= now_ns && frame.identifier == identifier;
            if is_it {
                deliver(*arrival_ns, frame);
            }
            !is_it
        });
    }

    /// Adds an identifier that a node receives.
    pub fn accept(&mut self, node: usize, identifier: Identifier) {
        if let Some(node) = self.nodes.get_mut(node) {
            node.accepts.push(identifier);
        }
    }

    /// Simulates all transmissions that start before `now_ns`.
    pub fn run_until(&mut self, now_ns: u64) {
        if self.free_ns >= now_ns {
            return;
        }
        while let Some(ready_ns) = self.nodes.iter().filter_map(Node::ready_ns).min() {
            let start_ns = self.free_ns.max(ready_ns);
            if start_ns >= now_ns {
                return;
            }
            let candidates = self.nodes.iter().enumerate().filter_map(|(index, node)| {
                let (identifier, place) = node.candidate(start_ns)?;
                Some((identifier, index, place))
            });
            let Some((_, sender, place)) = candidates.min() else { return };
            self.transmit(sender, place, start_ns);
        }
    }

    fn transmit(&mut self, sender: usize, place: usize, start_ns: u64) {
        let Some(node) = self.nodes.get_mut(sender) else { return };
        let Some(waiting) = node.waiting.remove(place) else { return };
        let others = self.nodes.iter().enumerate().filter(|(index, _)| *index != sender);
        let is_acknowledged = others.into_iter().any(|(_, node)| node.state(start_ns) != ErrorState::BusOff);
        let all = waiting.bits.sum();
        let good_bits = self.random.geometric(self.parameters.bit_error_rate);
        let good_bits = u32::try_from(good_bits).unwrap_or(u32::MAX).min(all);
        let is_good = good_bits >= all;
        let is_received = is_acknowledged && good_bits + 1 >= all;
        let bits = match (is_good, is_acknowledged) {
            (true, false) => all - BITS_FROM_ACKNOWLEDGE,
            (true, true) => all,
            (false, _) => good_bits + 1,
        };
        let end_ns = start_ns + self.lasts_ns(waiting.bits, bits);
        let is_sent = is_good && is_acknowledged;
        let gap_bits = if is_sent { INTERFRAME_BITS } else { ERROR_FRAME_BITS };
        self.free_ns = end_ns + bits_to_ns(gap_bits, self.parameters.bits_per_s);
        self.busy_ns += self.free_ns - start_ns;
        self.error_frames += u64::from(!is_sent);
        let shown_until_ns = if is_sent { end_ns } else { self.free_ns };
        self.timeline.add(BusyInterval {
            start_ns,
            end_ns: shown_until_ns,
            sender,
            label: waiting.frame.identifier.to_string(),
            is_error: !is_sent,
        });
        self.count(sender, start_ns, [is_good, is_acknowledged, is_good || is_received]);
        if is_received {
            self.deliver(sender, end_ns, &waiting.frame);
        }
        if is_sent {
            self.note_response(end_ns, &waiting);
        } else if let Some(node) = self.nodes.get_mut(sender)
            && node.state(self.free_ns) != ErrorState::BusOff
        {
            node.waiting.insert(place.min(node.waiting.len()), waiting);
        }
    }

    /// Duration of the first `bits` of a frame.
    fn lasts_ns(&self, frame: WireBits, bits: u32) -> u64 {
        let head = bits.min(frame.head);
        let fast = (bits - head).min(frame.fast);
        let slow = bits - fast;
        bits_to_ns(slow, self.parameters.bits_per_s) + bits_to_ns(fast, self.parameters.data_bits_per_s)
    }

    /// Maximum duration of a frame with these bits, including the interframe space, `ns`.
    #[must_use]
    pub fn frame_ns(parameters: &CanParameters, bits: WireBits) -> u64 {
        let slow = bits.head + bits.tail + INTERFRAME_BITS;
        bits_to_ns(slow, parameters.bits_per_s) + bits_to_ns(bits.fast, parameters.data_bits_per_s)
    }

    /// Updates error counters and states.
    fn count(&mut self, sender: usize, start_ns: u64, [is_good, is_acknowledged, is_received]: [bool; 3]) {
        let [recessive_ns, suspended_ns, rejoin_ns] = [RECESSIVE_BITS, SUSPENDED_BITS, REJOIN_BITS]
            .map(|bits| bits_to_ns(bits, self.parameters.bits_per_s));
        let (free_ns, rejoins) = (self.free_ns, self.parameters.rejoins);
        let taken_ns = free_ns - start_ns;
        for (index, node) in self.nodes.iter_mut().enumerate() {
            if node.state(start_ns) == ErrorState::BusOff {
                // A whole frame counts as one recessive sequence: its end and the interframe space.
                node.back_ns = node.back_ns.saturating_add(taken_ns.saturating_sub(recessive_ns));
            } else if index != sender {
                node.has_received(is_received);
            } else if node.has_sent(is_good, is_acknowledged) {
                let may_return = node.recent_bus_offs < rejoins;
                node.bus_offs += 1;
                node.recent_bus_offs += 1;
                node.dropped += u64::from(!node.waiting.is_empty());
                node.waiting.clear();
                (node.transmit_errors, node.receive_errors) = (0, 0);
                node.back_ns = if may_return { free_ns + rejoin_ns } else { u64::MAX };
            } else if node.state(free_ns) == ErrorState::Passive {
                node.suspended_until_ns = free_ns + suspended_ns;
            }
        }
    }

    fn note_response(&mut self, end_ns: u64, waiting: &Waiting) {
        let response = self.responses.entry(waiting.frame.identifier).or_default();
        let took_ns = end_ns - waiting.ready_ns;
        response.frames += 1;
        response.longest_ns = response.longest_ns.max(took_ns);
        response.sum_ns += took_ns;
    }

    fn deliver(&mut self, sender: usize, end_ns: u64, frame: &CanFrame) {
        let others = self.nodes.iter_mut().enumerate().filter(|(index, _)| *index != sender);
        for (_, node) in others {
            if node.accepts.contains(&frame.identifier) && end_ns >= node.back_ns {
                node.arrived.push_back((end_ns, frame.clone()));
            }
        }
    }
}

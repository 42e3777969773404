//! The CAN bus between the controllers of several boards.
//!
//! Boards run in turn, each for a [time slice](SLICE_S) that is shorter than the shortest bus activity. After
//! each slice, the bus decides which frames have started in it. A board's action therefore reaches the other
//! boards in the correct cycle. Only errors in a frame's first bits appear up to one slice late.
//!
//! ```text
//! offers of all nodes ──▶ arbitration ──▶ receivers, error flags ──▶ outcome and its time, for each node
//! ```
//! A frame is atomic: a node connected, disconnected or switched off during a frame takes effect from the
//! next frame.
//!
//! A mismatch of nominal bit rates is detected at the end of arbitration, a mismatch of data bit rates a few
//! bits into the data.

use cycles::machine::MachineError;

use crate::Bench;
use crate::stm32g4::fdcan::{Error, Message, Offer, Outcome, Passage, Rates, WireBits};

/// 16 bits at CAN's maximum nominal rate. The shortest bus activity has 18 bits: one faulty bit, error flag,
/// error delimiter and intermission.
const SLICE_S: f64 = 16e-6;
/// Intermission between frames.
const SPACE_BITS: f64 = 3.0;
const FLAG_BITS: f64 = 6.0;
const DELIMITER_BITS: f64 = 8.0;
/// Acknowledge, acknowledge delimiter and end of frame.
const BITS_FROM_ACKNOWLEDGE: f64 = 9.0;
/// Bits until a mismatch of data bit rates is detected.
const DATA_BITS_TO_ERROR: f64 = 10.0;

/// Result of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameResult {
    /// Acknowledged.
    Acknowledged,
    /// Not acknowledged by any node.
    NotAcknowledged,
    /// Aborted by an error flag.
    Aborted,
}

/// A frame that was on the bus.
#[derive(Debug, Clone)]
pub struct BusFrame {
    /// Start time, `s`.
    pub start_s: f64,
    /// Time of the end or the abort, `s`.
    pub end_s: f64,
    /// Index of the sending board.
    pub sender: usize,
    /// The frame.
    pub message: Message,
    /// Its fate.
    pub result: FrameResult,
}

/// A board and its connection to the bus.
#[derive(Debug)]
struct Node {
    bench: Bench,
    is_plugged: bool,
    /// Time from which the board sees an idle bus.
    free_s: f64,
}

/// A bus with its boards.
#[derive(Debug)]
pub struct CanBus {
    nodes: Vec<Node>,
    /// Whether its two wires are shorted: no node reads a dominant bit.
    is_shorted: bool,
    passed: Vec<BusFrame>,
}

/// A frame on the bus.
struct Meeting {
    sender: usize,
    message: Message,
    start_s: f64,
    rates: Rates,
    bits: WireBits,
}

/// A detected error: time and detecting node.
struct Found {
    at_s: f64,
    node: usize,
    error: Error,
    is_data_error: bool,
}

impl CanBus {
    /// Returns a bus with these boards, all connected.
    #[must_use]
    pub fn new(benches: Vec<Bench>) -> Self {
        let plug = |mut bench: Bench| {
            let now = bench.processor.cycles();
            bench.chip().fdcan(now).is_wired = true;
            Node { bench, is_plugged: true, free_s: 0.0 }
        };
        Self { nodes: benches.into_iter().map(plug).collect(), is_shorted: false, passed: Vec::new() }
    }

    /// Returns a board by its index.
    pub fn bench(&mut self, number: usize) -> Option<&mut Bench> {
        self.nodes.get_mut(number).map(|node| &mut node.bench)
    }

    /// Connects a board to the bus, or disconnects its wires at the bus side of its transceiver.
    pub fn set_connected(&mut self, number: usize, is_plugged: bool) {
        if let Some(node) = self.nodes.get_mut(number) {
            node.is_plugged = is_plugged;
        }
    }

    /// Shorts the two wires of the bus, or removes the short.
    pub fn set_shorted(&mut self, is_shorted: bool) {
        self.is_shorted = is_shorted;
    }

    /// Takes the frames since the last call.
    pub fn take_frames(&mut self) -> Vec<BusFrame> {
        std::mem::take(&mut self.passed)
    }

    /// Runs all boards for this time.
    ///
    /// # Errors
    /// As [`Bench::run_for`].
    pub fn run_for(&mut self, duration_s: f64) -> Result<(), MachineError> {
        let Some(mut now_s) = self.nodes.first().map(|node| node.bench.time_s()) else { return Ok(()) };
        let end_s = now_s + duration_s;
        while now_s < end_s {
            now_s = (now_s + SLICE_S).min(end_s);
            for node in &mut self.nodes {
                node.bench.run_for(now_s - node.bench.time_s())?;
            }
            self.decide(now_s);
        }
        Ok(())
    }

    /// Decides which frames have started before a time, on the bus and at each disconnected board.
    fn decide(&mut self, now_s: f64) {
        let (joined, alone): (Vec<usize>, Vec<usize>) = (0..self.nodes.len())
            .partition(|place| self.nodes.get(*place).is_some_and(|node| node.is_plugged && node.is_on()));
        if !joined.is_empty() {
            self.decide_among(&joined, now_s);
        }
        for place in alone {
            self.decide_among(&[place], now_s);
        }
        for node in &mut self.nodes {
            node.settle();
        }
    }

    fn decide_among(&mut self, group: &[usize], now_s: f64) {
        let mut offers: Vec<(usize, f64, Offer)> = Vec::new();
        let mut free_s = 0.0f64;
        for place in group {
            let Some(node) = self.nodes.get_mut(*place) else { continue };
            free_s = free_s.max(node.free_s);
            if let Some(offer) = node.offer() {
                offers.push((*place, node.bench.processor.bus.clock().seconds_at(offer.since), offer));
            }
        }
        let earliest_s = offers.iter().map(|(_, ready_s, _)| *ready_s).fold(f64::INFINITY, f64::min);
        let start_s = earliest_s.max(free_s);
        if start_s >= now_s {
            return;
        }
        offers.retain(|(_, ready_s, _)| *ready_s <= start_s);
        let Some(priority) = offers.iter().map(|(_, _, offer)| offer.message.priority()).min() else {
            return;
        };
        offers.retain(|(_, _, offer)| offer.message.priority() == priority);
        let Some((sender, _, offer)) = offers.first().cloned() else { return };
        // Senders with the same identifier continue until their frames differ.
        let rivals: Vec<usize> = offers.iter().skip(1).map(|(place, ..)| *place).collect();
        let message = offer.message;
        let Some(rates) = self.nodes.get_mut(sender).and_then(Node::rates) else { return };
        let meeting = Meeting { sender, bits: message.wire_bits(), message, start_s, rates };
        self.pass(group, &meeting, &rivals);
    }

    /// Decides the outcome of a frame for every node.
    fn pass(&mut self, group: &[usize], meeting: &Meeting, rivals: &[usize]) {
        let bit_s = meeting.rates.nominal.duration_s;
        self.see_transceivers(group, meeting);
        let mut found: Vec<Found> = Vec::new();
        let mut hears: Vec<usize> = Vec::new();
        let mut ignores: Vec<usize> = Vec::new();
        let is_mute = self.is_shorted || self.nodes.get(meeting.sender).is_some_and(|node| !node.is_on());
        for place in group {
            let Some(node) = self.nodes.get_mut(*place) else { continue };
            if *place == meeting.sender {
                found.extend(node.reads_back(meeting, is_mute, !rivals.is_empty(), *place));
                continue;
            }
            let begins = node.cycle(meeting.start_s);
            match node.fdcan().takes_part(begins) {
                None => {}
                Some(false) => ignores.push(*place),
                Some(true) if self.is_shorted => {}
                Some(true) => match node.understands(meeting, rivals.contains(place), *place) {
                    Ok(true) => hears.push(*place),
                    Ok(false) => ignores.push(*place),
                    Err(error) => {
                        // An error-passive or monitoring node does not abort the frame, unless it is a
                        // sender.
                        let breaks_off = !node.fdcan().is_passive() && node.fdcan().speaks();
                        if breaks_off || rivals.contains(place) {
                            found.push(error);
                        } else {
                            self.tell_error(*place, meeting, &error);
                        }
                    }
                },
            }
        }
        let first = found.iter().min_by(|one, other| one.at_s.total_cmp(&other.at_s));
        let acknowledges = |node: &mut Node| node.fdcan().speaks();
        let is_acknowledged = hears.iter().any(|place| self.nodes.get_mut(*place).is_some_and(acknowledges));
        let end_s = meeting.ends_s();
        let (result, end_s, free_s) = match first {
            Some(first) => {
                // The error flag of the detecting node, then the error flags of the other nodes.
                let flags = if hears.is_empty() && found.len() == 1 { 1.0 } else { 2.0 };
                let bits = flags * FLAG_BITS + DELIMITER_BITS + SPACE_BITS;
                (FrameResult::Aborted, first.at_s, first.at_s + bits * bit_s)
            }
            None if is_acknowledged => (FrameResult::Acknowledged, end_s, end_s + SPACE_BITS * bit_s),
            None => {
                let at_s = end_s - (BITS_FROM_ACKNOWLEDGE - 1.0) * bit_s;
                (FrameResult::NotAcknowledged, at_s, at_s + (FLAG_BITS + DELIMITER_BITS + SPACE_BITS) * bit_s)
            }
        };
        let is_data_error = first.is_some_and(|first| first.is_data_error);
        let sender_error = match result {
            FrameResult::Acknowledged => None,
            FrameResult::NotAcknowledged => Some(Error::Acknowledge),
            FrameResult::Aborted => {
                let own = found.iter().find(|found| found.node == meeting.sender);
                Some(own.map_or(Error::Recessive, |found| found.error))
            }
        };
        let outcome = sender_error.map_or(Outcome::Sent, Outcome::NotSent);
        self.tell(meeting.sender, meeting, [end_s, free_s], outcome, is_data_error);
        for place in rivals {
            self.tell(*place, meeting, [end_s, free_s], outcome, is_data_error);
        }
        for place in hears {
            let (outcome, at_s) = match result {
                FrameResult::Acknowledged => (Outcome::Received, end_s - bit_s),
                FrameResult::NotAcknowledged | FrameResult::Aborted => {
                    (Outcome::NotReceived { error: Error::Stuff, is_first: false }, end_s + FLAG_BITS * bit_s)
                }
            };
            self.tell(place, meeting, [at_s, free_s], outcome, is_data_error);
        }
        for error in
            found.iter().filter(|found| found.node != meeting.sender && !rivals.contains(&found.node))
        {
            let is_first = first.is_some_and(|first| first.node == error.node);
            let outcome = Outcome::NotReceived { error: error.error, is_first };
            self.tell(error.node, meeting, [end_s, free_s], outcome, error.is_data_error);
        }
        for place in ignores {
            self.tell(place, meeting, [end_s, free_s], Outcome::Ignored, false);
        }
        for place in group {
            if let Some(node) = self.nodes.get_mut(*place) {
                node.free_s = free_s;
            }
        }
        self.passed.push(BusFrame {
            start_s: meeting.start_s,
            end_s,
            sender: meeting.sender,
            message: meeting.message.clone(),
            result,
        });
    }

    fn tell(
        &mut self,
        place: usize,
        meeting: &Meeting,
        [end_s, free_s]: [f64; 2],
        outcome: Outcome,
        is_data_error: bool,
    ) {
        if let Some(node) = self.nodes.get_mut(place) {
            let passage = Passage {
                message: meeting.message.clone(),
                begins: node.cycle(meeting.start_s),
                ends: node.cycle(end_s),
                free: node.cycle(free_s),
                outcome,
                is_data_error,
            };
            node.fdcan().begin(passage);
            node.bench.processor.update_after_external_change();
        }
    }

    /// A node detects an error without sending an error flag, and waits until the bus is idle.
    fn tell_error(&mut self, place: usize, meeting: &Meeting, found: &Found) {
        let free_s = meeting.ends_s() + SPACE_BITS * meeting.rates.nominal.duration_s;
        let outcome = Outcome::NotReceived { error: found.error, is_first: false };
        self.tell(place, meeting, [found.at_s, free_s], outcome, found.is_data_error);
    }

    /// Records boards whose transceiver is not specified for the bit rates of a frame.
    fn see_transceivers(&mut self, group: &[usize], meeting: &Meeting) {
        let fast_s = meeting.message.switches_rate.then_some(meeting.rates.data.duration_s);
        let bits_per_s = 1.0 / fast_s.unwrap_or(f64::INFINITY).min(meeting.rates.nominal.duration_s);
        for place in group {
            let Some(node) = self.nodes.get_mut(*place) else { continue };
            let transceiver = node.bench.board.transceiver;
            if node.is_on() && bits_per_s > transceiver.max_bits_per_s * 1.001 {
                node.bench.note_fault(format!(
                    "{} is specified for {} Mbit/s, but the bus runs at {:.1} Mbit/s",
                    transceiver.name,
                    transceiver.max_bits_per_s / 1e6,
                    bits_per_s / 1e6
                ));
            }
        }
    }
}

impl Meeting {
    /// Duration of the bits at the nominal rate before the rate switch.
    fn head_s(&self) -> f64 {
        f64::from(self.bits.head) * self.rates.nominal.duration_s
    }

    fn ends_s(&self) -> f64 {
        self.start_s
            + self.head_s()
            + f64::from(self.bits.fast) * self.rates.data.duration_s
            + f64::from(self.bits.tail) * self.rates.nominal.duration_s
    }

    /// An error that is detected at the end of arbitration.
    fn early_error(&self, node: usize, error: Error) -> Found {
        let bits = if self.message.is_extended { 32.0 } else { 13.0 };
        let at_s = self.start_s + bits * self.rates.nominal.duration_s;
        Found { at_s, node, error, is_data_error: false }
    }

    /// An error that is detected in the data.
    fn data_error(&self, node: usize, error: Error) -> Found {
        let at_s = self.start_s + self.head_s() + DATA_BITS_TO_ERROR * self.rates.data.duration_s;
        Found { at_s, node, error, is_data_error: true }
    }
}

impl Node {
    /// Whether the board's transceiver is on and connected to the controller.
    fn is_on(&self) -> bool {
        let chip = &self.bench.processor.bus;
        let off = self.bench.board.transceiver.off;
        // An undriven control pin counts as off.
        let is_off = off.is_some_and(|(port, pin)| chip.output(port, pin).unwrap_or(true));
        !is_off && chip.is_can_connected()
    }

    fn fdcan(&mut self) -> &mut crate::stm32g4::fdcan::Fdcan {
        let now = self.bench.processor.cycles();
        self.bench.processor.bus.fdcan(now)
    }

    fn rates(&mut self) -> Option<Rates> {
        self.fdcan().rates()
    }

    fn offer(&mut self) -> Option<Offer> {
        self.fdcan().offer()
    }

    fn cycle(&self, time_s: f64) -> u64 {
        self.bench.processor.bus.clock().cycle_at(time_s)
    }

    fn settle(&mut self) {
        if self.fdcan().settle() {
            self.bench.processor.update_after_external_change();
        }
    }

    /// Returns the error that a sender detects in its read-back bits.
    fn reads_back(
        &mut self,
        meeting: &Meeting,
        is_mute: bool,
        has_rival: bool,
        place: usize,
    ) -> Option<Found> {
        let bit_s = meeting.rates.nominal.duration_s;
        if is_mute {
            // Its first bit is dominant.
            let at_s = meeting.start_s + bit_s;
            return Some(Found { at_s, node: place, error: Error::Dominant, is_data_error: false });
        }
        if has_rival {
            return Some(meeting.data_error(place, Error::Recessive));
        }
        let delay_s = self.bench.board.transceiver.loop_delay_s;
        let is_late = meeting.message.switches_rate && delay_s > meeting.rates.data.sample_s;
        (is_late && !self.fdcan().compensates_delay()).then(|| meeting.data_error(place, Error::Recessive))
    }

    /// Returns whether the node receives (`true`) or ignores (`false`) the frame, or the error that the node
    /// detects.
    fn understands(&mut self, meeting: &Meeting, is_rival: bool, place: usize) -> Result<bool, Found> {
        if is_rival {
            return Err(meeting.data_error(place, Error::Recessive));
        }
        let Some(rates) = self.rates() else { return Ok(false) };
        let message = &meeting.message;
        if !rates.nominal.fits(&meeting.rates.nominal) {
            return Err(meeting.early_error(place, Error::Stuff));
        }
        if message.is_fd && !self.fdcan().knows_fd() {
            if self.fdcan().tolerates_unknown() {
                return Ok(false);
            }
            return Err(meeting.early_error(place, Error::Form));
        }
        if message.switches_rate && !rates.data.fits(&meeting.rates.data) {
            return Err(meeting.data_error(place, Error::Stuff));
        }
        Ok(true)
    }
}

//! Checks whether the joints of a robot fit on one CAN bus: worst-case analysis and a simulation of 1 s.
//!
//! A central controller sends a packet to each joint every period, and each joint replies with a packet. Every packet
//! must arrive before the next one of its stream is sent.

use serde::Serialize;

use dimsart_core::Packet;

use crate::bus::can::{
    CanBus, CanFrame, CanParameters, Format, Identifier, Message, Response, worst_response_ns,
};
use crate::bus::time::{NS_PER_S, bits_to_ns, ns_to_seconds, seconds_to_ns};
use crate::bus::{MediumReport, Random, Traffic, load};
use crate::link::can_frames;

/// Base channels (identifiers) of packets to and from joints; commands have priority.
const TO_JOINTS: u16 = 0x100;
const FROM_JOINTS: u16 = 0x200;
/// Maximum number of joints, the channels per direction.
pub const MAX_JOINTS: u16 = 64;
/// Name of the controller.
const CONTROLLER: &str = "controller";
/// Simulated time, `ns`.
const SIMULATED_NS: u64 = NS_PER_S;
/// Common data rates of CAN FD transceivers, `bit/s`.
const DATA_RATES: [u32; 4] = [2_000_000, 4_000_000, 5_000_000, 8_000_000];

/// A bus with its joints.
#[derive(Debug, Clone, PartialEq)]
pub struct BusPlan {
    /// Joints on the bus, 1 to [`MAX_JOINTS`].
    pub joints: u16,
    /// Packets per second to and from each joint, `Hz`.
    pub rate_hz: f64,
    /// Words of a packet to a joint.
    pub words_to_joint: usize,
    /// Words of a packet from a joint.
    pub words_from_joint: usize,
    /// Classic CAN or CAN FD.
    pub format: Format,
    /// Bus parameters.
    pub parameters: CanParameters,
    /// Random seed of simulated bits and errors.
    pub seed: u64,
}

/// Figures of a plan; printed by `--json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BusFigures {
    /// Whether every packet arrives before the next one of its stream, in the worst case and in the simulation.
    pub fits: bool,
    /// Period of a stream, the maximum response time, `s`.
    pub period_s: f64,
    /// Worst-case load; above 1 the bus is overloaded.
    pub worst_load: f64,
    /// Simulated load.
    pub simulated_load: f64,
    /// Dropped packets in the simulation.
    pub dropped: u64,
    /// Error frames in the simulation.
    pub error_frames: u64,
    /// By descending priority.
    pub packets: Vec<PacketFigures>,
    /// Remedies if it does not fit.
    pub advice: Vec<String>,
}

/// Figures of a stream.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PacketFigures {
    /// Direction and joint.
    pub name: String,
    /// Identifier.
    pub identifier: String,
    /// Frames per packet.
    pub frames: usize,
    /// Maximum bits of a packet, including interframe spaces.
    pub max_bits: u32,
    /// Worst-case response time without errors, `s`; `None` if the bus is overloaded.
    pub worst_response_s: Option<f64>,
    /// Maximum simulated response time, including errors, `s`; `None` without received packets.
    pub simulated_response_s: Option<f64>,
}

/// Packet too long.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("packet of {words} words is too long: the maximum is 16 words on classic CAN and 13 on CAN FD")]
pub struct TooManyWords {
    /// Words of the packet.
    pub words: usize,
}

/// A stream of packets.
struct Stream {
    name: String,
    sender: String,
    channel: u16,
    words: usize,
}

impl BusPlan {
    /// Analyses and simulates the plan; also returns the traffic for a picture.
    ///
    /// # Errors
    /// [`TooManyWords`] for a packet that is too long.
    pub fn analyse(&self) -> Result<(BusFigures, MediumReport), TooManyWords> {
        let streams = self.streams();
        let packets: Vec<Vec<CanFrame>> =
            streams.iter().map(|stream| self.frames(stream, 0)).collect::<Result<_, _>>()?;
        let responses_ns = self.worst_responses_ns(&packets);
        let (bus, dropped) = self.simulate(&streams, &packets)?;
        let period_s = ns_to_seconds(self.period_ns());
        let seen = |identifier: Identifier| -> Option<&Response> { bus.responses().get(&identifier) };
        let figures = streams.iter().zip(&packets).zip(&responses_ns).map(|((stream, frames), worst_ns)| {
            let max_bits = frames.iter().map(|frame| self.max_bits(frame)).sum();
            let identifier = Identifier::Standard(stream.channel);
            PacketFigures {
                name: stream.name.clone(),
                identifier: identifier.to_string(),
                frames: frames.len(),
                max_bits,
                worst_response_s: worst_ns.map(ns_to_seconds),
                simulated_response_s: seen(identifier).map(|response| ns_to_seconds(response.longest_ns)),
            }
        });
        let figures: Vec<PacketFigures> = figures.collect();
        let is_in_time =
            |response_s: Option<f64>| response_s.is_some_and(|response_s| response_s <= period_s);
        let fits = dropped == 0
            && figures
                .iter()
                .all(|packet| is_in_time(packet.worst_response_s) && is_in_time(packet.simulated_response_s));
        let frame_ns: u64 = packets.iter().flatten().map(|frame| self.frame_ns(frame)).sum();
        let simulated_load = load(bus.busy_ns(), SIMULATED_NS);
        let report = MediumReport {
            traffic: Traffic {
                medium: "CAN bus".to_owned(),
                load: simulated_load,
                packets: bus.responses().values().map(|response| response.frames).sum(),
                dropped,
                errors: bus.error_frames(),
                bus_offs: bus.nodes().iter().map(|node| node.bus_offs).sum(),
                longest_s: bus
                    .responses()
                    .values()
                    .map(|response| ns_to_seconds(response.longest_ns))
                    .fold(0.0, f64::max),
            },
            senders: bus.nodes().iter().map(|node| node.name.clone()).collect(),
            timeline: bus.timeline().clone(),
            faults: Vec::new(),
        };
        let figures = BusFigures {
            fits,
            period_s,
            worst_load: ns_to_seconds(frame_ns) / period_s,
            simulated_load,
            dropped,
            error_frames: bus.error_frames(),
            packets: figures,
            advice: if fits { Vec::new() } else { self.advice() },
        };
        Ok((figures, report))
    }

    /// Returns the period of a stream, `ns`.
    #[must_use]
    pub fn period_ns(&self) -> u64 {
        seconds_to_ns(1.0 / self.rate_hz).max(1)
    }

    /// By descending priority.
    fn streams(&self) -> Vec<Stream> {
        let joints = 1..=self.joints;
        let to = joints.clone().map(|joint| Stream {
            name: format!("to joint {joint}"),
            sender: CONTROLLER.to_owned(),
            channel: TO_JOINTS + joint,
            words: self.words_to_joint,
        });
        let from = joints.map(|joint| Stream {
            name: format!("from joint {joint}"),
            sender: format!("joint {joint}"),
            channel: FROM_JOINTS + joint,
            words: self.words_from_joint,
        });
        to.chain(from).collect()
    }

    /// Returns the frames of packet number `count` of a stream, with random words.
    fn frames(&self, stream: &Stream, count: u64) -> Result<Vec<CanFrame>, TooManyWords> {
        let too_many = TooManyWords { words: stream.words };
        let mut random =
            Random::new(self.seed.wrapping_add(count << 16).wrapping_add(u64::from(stream.channel)));
        let mut words =
            std::iter::repeat_with(|| u32::try_from(random.uniform_integer(u32::MAX)).unwrap_or(0));
        let mut packet = Packet { channel: stream.channel, content: stream.channel, ..Packet::default() };
        let [low, high, ..] = (count + 1).to_le_bytes();
        packet.counter = u16::from_le_bytes([low, high]).max(1);
        packet.echo = packet.counter;
        for word in words.by_ref().take(stream.words) {
            packet.words.push(word).map_err(|_| too_many)?;
        }
        let identifier = Identifier::Standard(stream.channel);
        can_frames(&packet.to_bytes(), stream.channel, self.format, identifier).ok_or(too_many)
    }

    fn max_bits(&self, frame: &CanFrame) -> u32 {
        let bits = CanFrame::max_wire_bits(frame.identifier, self.format, frame.data().len());
        bits.sum() + crate::bus::can::INTERFRAME_BITS
    }

    fn frame_ns(&self, frame: &CanFrame) -> u64 {
        let bits = CanFrame::max_wire_bits(frame.identifier, self.format, frame.data().len());
        CanBus::frame_ns(&self.parameters, bits)
    }

    /// Worst-case response times of each stream's last frame, `ns`. The frames of a packet are sent in order, each as
    /// a message with priority over the next.
    fn worst_responses_ns(&self, packets: &[Vec<CanFrame>]) -> Vec<Option<u64>> {
        let message = |frame: &CanFrame| Message {
            period_ns: self.period_ns(),
            jitter_ns: 0,
            frame_ns: self.frame_ns(frame),
        };
        let messages: Vec<Message> = packets.iter().flatten().map(message).collect();
        let bit_ns = bits_to_ns(1_u32, self.parameters.bits_per_s);
        let mut last = 0;
        let response_ns = |frames: &Vec<CanFrame>| {
            last += frames.len();
            worst_response_ns(&messages, last.checked_sub(1)?, bit_ns)
        };
        packets.iter().map(response_ns).collect()
    }

    /// All packets are queued at the same time, the worst case.
    fn simulate(&self, streams: &[Stream], packets: &[Vec<CanFrame>]) -> Result<(CanBus, u64), TooManyWords> {
        let mut bus = CanBus::new(self.parameters, self.seed);
        let mut senders: Vec<&str> = Vec::new();
        let mut nodes = Vec::new();
        for stream in streams {
            let known = senders.iter().position(|sender| *sender == stream.sender);
            nodes.push(known.unwrap_or_else(|| {
                senders.push(&stream.sender);
                bus.add(&stream.sender, &[])
            }));
        }
        let periods = SIMULATED_NS / self.period_ns();
        for count in 0..periods.max(1) {
            let now_ns = count * self.period_ns();
            for ((stream, frames), node) in streams.iter().zip(packets).zip(&nodes) {
                // Skips packets that do not fit into the queue.
                if !bus.is_queue_full(*node, now_ns, frames.len()) {
                    bus.submit(*node, now_ns, self.frames(stream, count)?);
                }
            }
        }
        bus.run_until(periods * self.period_ns());
        let dropped = bus.nodes().iter().map(|node| node.dropped).sum();
        Ok((bus, dropped))
    }

    /// Whether the worst case without errors is in time.
    fn is_in_time(&self) -> bool {
        let packets: Result<Vec<_>, _> = self.streams().iter().map(|stream| self.frames(stream, 0)).collect();
        let Ok(packets) = packets else { return false };
        let responses_ns = self.worst_responses_ns(&packets);
        responses_ns.iter().all(|response_ns| response_ns.is_some_and(|ns| ns <= self.period_ns()))
    }

    /// Lists the remedies.
    fn advice(&self) -> Vec<String> {
        let streams = self.streams();
        let commands = streams.iter().filter(|stream| stream.sender == CONTROLLER);
        let waiting: usize =
            commands.filter_map(|stream| self.frames(stream, 0).ok()).map(|frames| frames.len()).sum();
        if self.is_in_time() {
            // If it fits without errors, other remedies do not apply.
            return vec![if waiting > self.parameters.queue_frames {
                format!(
                    "increase the send queue: the controller sends {waiting} frames at a time (--set \
                    can.queue_frames={waiting})"
                )
            } else {
                "the traffic fits only without bit errors: lower the bit error rate (cable, termination, bit rate), or \
                reduce joints, words or packet rate to leave room for retransmissions"
                    .to_owned()
            }];
        }
        let mut advice = Vec::new();
        let at = |rate_hz: u32| Self { rate_hz: f64::from(rate_hz), ..self.clone() }.is_in_time();
        let below = (1_u32..).take_while(|rate_hz| f64::from(*rate_hz) < self.rate_hz).last().unwrap_or(0);
        let highest = highest(below, at);
        if highest > 0 {
            advice.push(format!("send at most {highest} packets/s in each direction (--rate-hz {highest})"));
        }
        let fd = |rate: u32| {
            let parameters = CanParameters { data_bits_per_s: rate, ..self.parameters };
            Self { format: Format::Fd, parameters, ..self.clone() }
        };
        let is_new = |rate: &u32| self.format == Format::Classic || *rate > self.parameters.data_bits_per_s;
        match DATA_RATES.into_iter().filter(is_new).find(|rate| fd(*rate).is_in_time()) {
            Some(rate) => advice.push(format!(
                "use CAN FD with a data rate of {} Mbit/s (--carrier can_fd --set can.data_bits_per_s={rate})",
                rate / 1_000_000
            )),
            None => advice.push("reduce the load: even CAN FD at 8 Mbit/s is too slow".to_owned()),
        }
        let with = |joints: u32| {
            let joints = u16::try_from(joints).unwrap_or(0);
            Self { joints, ..self.clone() }.is_in_time()
        };
        match self::highest(u32::from(self.joints).saturating_sub(1), with) {
            0 => {}
            joints => advice.push(format!("connect at most {joints} joints to one bus (--joints {joints})")),
        }
        let most = self.words_to_joint.max(self.words_from_joint);
        let fewer = |words: usize| Self { words_to_joint: words, words_from_joint: words, ..self.clone() };
        if let Some(words) = (0..most).rev().find(|words| fewer(*words).is_in_time()) {
            let words = if words == 1 { "1 word".to_owned() } else { format!("{words} words") };
            advice.push(format!(
                "send {words} per packet instead of {most}: fewer signals, or no counters (CTX_COUNTERS OFF and \
                CRX_COUNTERS OFF)"
            ));
        }
        advice
    }
}

/// Returns the highest number up to `most` for which `holds` is true (monotonic); 0 if none.
fn highest(most: u32, holds: impl Fn(u32) -> bool) -> u32 {
    let (mut good, mut bad) = (0, most + 1);
    while good + 1 < bad {
        let middle = good + (bad - good) / 2;
        if holds(middle) {
            good = middle;
        } else {
            bad = middle;
        }
    }
    good
}

#[cfg(test)]
mod tests;

//! What was on a medium, and what it came to.

use std::collections::VecDeque;

use serde::Serialize;

use super::time::ns_seconds;

/// Stretches that a timeline remembers.
const REMEMBERED: usize = 512;

/// The last stretches in which a medium was taken.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Timeline(VecDeque<Occupation>);

/// One stretch in which a medium was taken by one sender.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Occupation {
    /// Its begin, `ns` of virtual time.
    pub start_ns: u64,
    /// Its end, `ns`.
    pub end_ns: u64,
    /// Number of the sender.
    pub sender: usize,
    /// What was sent: an identifier, or nothing.
    pub label: String,
    /// Whether it did not get through.
    pub is_error: bool,
}

impl Timeline {
    /// Adds the latest stretch; the oldest is forgotten when there are too many.
    pub fn add(&mut self, occupation: Occupation) {
        if self.0.len() == REMEMBERED {
            self.0.pop_front();
        }
        self.0.push_back(occupation);
    }

    /// The stretches, in the order of their begin.
    pub fn occupations(&self) -> impl DoubleEndedIterator<Item = &Occupation> + Clone {
        self.0.iter()
    }
}

/// What the traffic on one medium came to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Traffic {
    /// Which medium: `uart, master to slave`.
    pub medium: String,
    /// Share of the time in which it was taken, 0 to 1.
    pub load: f64,
    /// Packets given to it.
    pub packets: u64,
    /// Packets that it did not take: for want of room, too long for it, or of a node that was off the bus.
    pub dropped: u64,
    /// What went wrong on the wire: bytes damaged, dropped or inserted on a UART, error frames on a CAN bus, packets
    /// lost on the way of UDP.
    pub errors: u64,
    /// How often a CAN node left the bus.
    pub bus_offs: u32,
    /// Longest time from being given to having arrived, `s`.
    pub longest_s: f64,
}

/// All that a medium has to say about itself.
#[derive(Debug, Clone, PartialEq)]
pub struct MediumReport {
    /// The figures.
    pub traffic: Traffic,
    /// Names of the senders, by number.
    pub senders: Vec<String>,
    /// Who had it when.
    pub timeline: Timeline,
    /// What went wrong and what to do, in words.
    pub faults: Vec<String>,
}

impl MediumReport {
    /// Adds the packets of another link over the same medium, and what it alone has to say.
    pub(crate) fn join(&mut self, other: Self) {
        self.traffic.packets += other.traffic.packets;
        self.traffic.dropped += other.traffic.dropped;
        let news = other.faults.into_iter().filter(|fault| !self.faults.contains(fault)).collect::<Vec<_>>();
        self.faults.extend(news);
    }
}

/// Share of the time until `now_ns` that was taken, 0 to 1: what lies beyond is not counted.
pub(crate) fn load(busy_ns: u64, now_ns: u64) -> f64 {
    (ns_seconds(busy_ns) / ns_seconds(now_ns.max(1))).min(1.0)
}

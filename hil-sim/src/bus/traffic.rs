//! Traffic of a medium: timeline and figures.

use std::collections::VecDeque;

use serde::Serialize;

use super::time::ns_to_seconds;

/// Maximum intervals of a timeline.
const REMEMBERED: usize = 512;

/// Latest busy intervals of a medium.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Timeline(VecDeque<BusyInterval>);

/// A busy interval of a medium by one sender.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BusyInterval {
    /// Start, `ns` of virtual time.
    pub start_ns: u64,
    /// End, `ns`.
    pub end_ns: u64,
    /// Sender number.
    pub sender: usize,
    /// Identifier of the frame, or empty.
    pub label: String,
    /// Whether the transmission failed.
    pub is_error: bool,
}

impl Timeline {
    /// Adds an interval; drops the oldest if full.
    pub fn add(&mut self, occupation: BusyInterval) {
        if self.0.len() == REMEMBERED {
            self.0.pop_front();
        }
        self.0.push_back(occupation);
    }

    /// Returns the intervals in order of their start.
    pub fn busy_intervals(&self) -> impl DoubleEndedIterator<Item = &BusyInterval> + Clone {
        self.0.iter()
    }
}

/// Traffic figures of a medium.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Traffic {
    /// Medium: `uart, master to slave`.
    pub medium: String,
    /// Load, 0 to 1.
    pub load: f64,
    /// Packets sent.
    pub packets: u64,
    /// Dropped packets: queue full, too long, or bus-off.
    pub dropped: u64,
    /// Errors on the wire: bytes damaged, dropped or inserted on a UART, error frames on a CAN bus, lost UDP packets.
    pub errors: u64,
    /// Bus-off events of CAN nodes.
    pub bus_offs: u32,
    /// Maximum time from sending to arrival, `s`.
    pub longest_s: f64,
}

/// Report of a medium.
#[derive(Debug, Clone, PartialEq)]
pub struct MediumReport {
    /// Figures.
    pub traffic: Traffic,
    /// Sender names by number.
    pub senders: Vec<String>,
    /// Timeline.
    pub timeline: Timeline,
    /// Faults with remedies.
    pub faults: Vec<String>,
}

impl MediumReport {
    /// Adds the packets and faults of another link over the same medium.
    pub(crate) fn join(&mut self, other: Self) {
        self.traffic.packets += other.traffic.packets;
        self.traffic.dropped += other.traffic.dropped;
        let news = other.faults.into_iter().filter(|fault| !self.faults.contains(fault)).collect::<Vec<_>>();
        self.faults.extend(news);
    }
}

/// Load until `now_ns`, 0 to 1; later time is not counted.
pub(crate) fn load(busy_ns: u64, now_ns: u64) -> f64 {
    (ns_to_seconds(busy_ns) / ns_to_seconds(now_ns.max(1))).min(1.0)
}

//! A link over a simulated medium: ticks on the controller side, nanoseconds on the medium side.

use dimsart_link::carrier::stream::{self, StreamReceiver};

use super::transit::{Transit, TransitTicks};
use super::{InProcess, Link};
use crate::bus::time::ns_to_seconds;
use crate::bus::{DatagramPath, MediumReport, Timeline, Traffic, Uart, load};

/// Reason for a refused packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Refusal {
    /// Queue full.
    QueueFull,
    /// The sender is bus-off.
    BusOff,
    /// Packet too long for the medium.
    TooLong,
}

/// One direction of a medium for whole packets.
pub(super) trait Medium: core::fmt::Debug + Send {
    fn send(&mut self, now_ns: u64, content: &[u8]) -> Result<(), Refusal>;

    fn receive(&mut self, now_ns: u64, deliver: &mut dyn FnMut(&[u8]));

    /// As [`Link::reset`].
    fn reset(&mut self, _now_ns: u64) {}

    /// Returns its state by `now_ns`; identical for both directions of a shared medium.
    fn state(&self, now_ns: u64) -> MediumState;
}

/// State of a medium.
#[derive(Debug)]
pub(super) struct MediumState {
    pub(super) busy_ns: u64,
    pub(super) errors: u64,
    pub(super) bus_offs: u32,
    pub(super) longest_ns: u64,
    /// Names of the senders; empty: the link's sender.
    pub(super) senders: Vec<String>,
    pub(super) timeline: Timeline,
    pub(super) faults: Vec<String>,
}

/// A medium followed by the modelled link of the rig.
#[derive(Debug)]
pub(super) struct MediumLink<M> {
    name: String,
    sender: String,
    /// Remedy for a full queue.
    remedy: &'static str,
    period_ns: u64,
    medium: M,
    behind: InProcess,
    transit: Transit,
    packets: u64,
    full: u64,
    off: u64,
    too_long: u64,
}

impl<M: Medium> MediumLink<M> {
    /// Creates the link; `name` is the medium, `sender` the sending station.
    pub(super) fn new(
        (name, sender, remedy): (String, &str, &'static str),
        period_ns: u64,
        medium: M,
        behind: InProcess,
    ) -> Self {
        let sender = sender.to_owned();
        let transit = Transit::default();
        let (packets, full, off, too_long) = (0, 0, 0, 0);
        Self { name, sender, remedy, period_ns, medium, behind, transit, packets, full, off, too_long }
    }

    fn faults(&self) -> impl Iterator<Item = String> {
        let Self { name, sender, packets, full, off, too_long, remedy, .. } = self;
        let full = (*full > 0).then(|| {
            format!("{name}: {full} of the {sender}'s {packets} packets dropped, send queue full; {remedy}")
        });
        let off = (*off > 0)
            .then(|| format!("{name}: {off} of the {sender}'s {packets} packets lost while bus-off"));
        let too_long = (*too_long > 0).then(|| {
            format!(
                "{name}: {too_long} of the {sender}'s {packets} packets are too long for this carrier; send fewer \
                signals per packet, or choose another link.carrier"
            )
        });
        full.into_iter().chain(off).chain(too_long)
    }
}

impl<M: Medium> Link for MediumLink<M> {
    fn send(&mut self, now: u64, bytes: &[u8]) {
        self.packets += 1;
        match self.medium.send(now * self.period_ns, bytes) {
            Ok(()) => self.transit.sent(now, bytes),
            Err(Refusal::QueueFull) => self.full += 1,
            Err(Refusal::BusOff) => self.off += 1,
            Err(Refusal::TooLong) => self.too_long += 1,
        }
    }

    fn receive(&mut self, now: u64, deliver: &mut dyn FnMut(&[u8])) {
        let behind = &mut self.behind;
        self.medium.receive(now * self.period_ns, &mut |bytes| behind.send(now, bytes));
        let transit = &mut self.transit;
        behind.receive(now, &mut |bytes| {
            transit.arrived(now, bytes);
            deliver(bytes);
        });
    }

    fn reset(&mut self, now: u64) {
        self.medium.reset(now * self.period_ns);
    }

    fn transit_ticks(&self) -> Option<TransitTicks> {
        self.transit.ticks()
    }

    fn report(&self, now: u64) -> Option<MediumReport> {
        let now_ns = now * self.period_ns;
        let state = self.medium.state(now_ns);
        let traffic = Traffic {
            medium: self.name.clone(),
            load: load(state.busy_ns, now_ns),
            packets: self.packets,
            dropped: self.full + self.off + self.too_long,
            errors: state.errors,
            bus_offs: state.bus_offs,
            longest_s: ns_to_seconds(state.longest_ns),
        };
        let senders = if state.senders.is_empty() { vec![self.name.clone()] } else { state.senders };
        let faults = self.faults().chain(state.faults).collect();
        Some(MediumReport { traffic, senders, timeline: state.timeline, faults })
    }
}

/// UART with the frames of the firmware.
#[derive(Debug)]
pub(super) struct Serial {
    uart: Uart,
    receiver: StreamReceiver,
}

impl Serial {
    pub(super) fn new(uart: Uart) -> Self {
        Self { uart, receiver: StreamReceiver::new() }
    }
}

impl Medium for Serial {
    fn send(&mut self, now_ns: u64, content: &[u8]) -> Result<(), Refusal> {
        let mut frame = [0; stream::MAX_FRAME_BYTES];
        let frame = stream::encode(content, &mut frame).ok_or(Refusal::TooLong)?;
        if self.uart.send(now_ns, frame) { Ok(()) } else { Err(Refusal::QueueFull) }
    }

    fn receive(&mut self, now_ns: u64, deliver: &mut dyn FnMut(&[u8])) {
        let receiver = &mut self.receiver;
        self.uart.receive(now_ns, |_, byte| receiver.push(byte).into_iter().for_each(&mut *deliver));
    }

    fn state(&self, _now_ns: u64) -> MediumState {
        let Self { uart, .. } = self;
        MediumState {
            busy_ns: uart.busy_ns(),
            errors: uart.errors(),
            bus_offs: 0,
            longest_ns: uart.longest_ns(),
            senders: Vec::new(),
            timeline: uart.timeline().clone(),
            faults: Vec::new(),
        }
    }
}

impl Medium for DatagramPath {
    fn send(&mut self, now_ns: u64, content: &[u8]) -> Result<(), Refusal> {
        if DatagramPath::send(self, now_ns, content) { Ok(()) } else { Err(Refusal::QueueFull) }
    }

    fn receive(&mut self, now_ns: u64, deliver: &mut dyn FnMut(&[u8])) {
        DatagramPath::receive(self, now_ns, |_, content| deliver(content));
    }

    fn state(&self, _now_ns: u64) -> MediumState {
        MediumState {
            busy_ns: self.busy_ns(),
            errors: self.lost(),
            bus_offs: 0,
            longest_ns: self.longest_ns(),
            senders: Vec::new(),
            timeline: self.timeline().clone(),
            faults: Vec::new(),
        }
    }
}

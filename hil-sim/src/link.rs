//! Links: carry bytes between controllers, independent of their content.
//!
//! A link is one direction. Time is given in ticks; links never read a clock. A new kind of link is one file here.
//! Links over a simulated medium use a [`bus`](crate::bus) through the core's [carriers](dimsart_link::carrier);
//! [`Buses`] creates them from a rig file.

mod address;
mod arrival;
mod buses;
mod can;
mod in_process;
mod medium;
mod open;
mod parameters;
mod port;
mod serial;
#[cfg(all(feature = "socketcan", target_os = "linux"))]
mod socketcan;
mod transit;
mod udp;

pub use address::Address;
pub use arrival::ArrivalPoll;
pub use buses::{Buses, Route, round_trip_ticks};
pub(crate) use can::can_frames;
pub use in_process::{InProcess, InProcessParameters};
pub use open::{Channels, OpenError, open};
pub use port::{PortError, Stream, open_port, open_serial, open_with_timeout};
pub use serial::Serial;
#[cfg(all(feature = "socketcan", target_os = "linux"))]
pub use socketcan::SocketCan;
pub use transit::TransitTicks;
pub use udp::{Udp, UdpError};

use dimsart_core::Packet;

use crate::bus::MediumReport;

/// Content of a link.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Payload {
    /// Packet without serialisation, for speed within a process.
    Packet(Packet),
    /// Bytes.
    Bytes(Vec<u8>),
}

impl Payload {
    /// Its bytes.
    #[must_use]
    pub fn into_bytes(self) -> Vec<u8> {
        match self {
            Self::Packet(packet) => packet.to_bytes().to_vec(),
            Self::Bytes(bytes) => bytes,
        }
    }
}

impl From<&[u8]> for Payload {
    fn from(bytes: &[u8]) -> Self {
        Self::Bytes(bytes.to_vec())
    }
}

/// One direction of a connection.
pub trait Link: core::fmt::Debug + Send {
    /// Sends a packet in tick `now`.
    fn send(&mut self, now: u64, bytes: &[u8]);

    /// Passes every packet that has arrived by tick `now` to `deliver`, in the order of arrival.
    fn receive(&mut self, now: u64, deliver: &mut dyn FnMut(&[u8]));

    /// Like [`send`](Self::send); a link that ignores bytes carries the packet unchanged.
    fn send_payload(&mut self, now: u64, carried: Payload) {
        self.send(now, &carried.into_bytes());
    }

    /// Like [`receive`](Self::receive), in the carried form.
    fn receive_payload(&mut self, now: u64, deliver: &mut dyn FnMut(Payload)) {
        self.receive(now, &mut |bytes| deliver(bytes.into()));
    }

    /// Handles a reset of the sending controller in tick `now`: a bus-off node recovers.
    fn reset(&mut self, _now: u64) {}

    /// Returns the delay in ticks; `None` if not measured or before the first arrival.
    fn transit_ticks(&self) -> Option<TransitTicks> {
        None
    }

    /// Returns the report of its medium by tick `now`, with the link's packets; `None` without a medium.
    fn report(&self, _now: u64) -> Option<MediumReport> {
        None
    }
}

//! Links: carry bytes from one controller to another and know nothing of what is in them.
//!
//! A link is one direction. Time is given to it in ticks; nothing here reads a clock.
//! A new kind of link is one file here. Those over a simulated medium put contents on a [`bus`](crate::bus) as the
//! core's [carriers](dimsart_link::carrier) do, and [`Buses`] makes them of a rig file.

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
pub use port::{PortError, Stream, open_port, open_serial, open_waiting};
pub use serial::Serial;
#[cfg(all(feature = "socketcan", target_os = "linux"))]
pub use socketcan::SocketCan;
pub use transit::TransitTicks;
pub use udp::{Udp, UdpError};

use dimsart_core::Packet;

use crate::bus::MediumReport;

/// What goes over a link.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Carried {
    /// A packet that nobody has made bytes of: within a process that is as good, and faster.
    Packet(Packet),
    /// Bytes.
    Bytes(Vec<u8>),
}

impl Carried {
    /// Its bytes.
    #[must_use]
    pub fn into_bytes(self) -> Vec<u8> {
        match self {
            Self::Packet(packet) => packet.to_bytes().to_vec(),
            Self::Bytes(bytes) => bytes,
        }
    }
}

impl From<&[u8]> for Carried {
    fn from(bytes: &[u8]) -> Self {
        Self::Bytes(bytes.to_vec())
    }
}

/// One direction of a connection.
pub trait Link: core::fmt::Debug + Send {
    /// Takes a packet to be carried, in tick `now`.
    fn send(&mut self, now: u64, bytes: &[u8]);

    /// Gives `deliver` every packet that has arrived by tick `now`, in the order of arrival.
    fn receive(&mut self, now: u64, deliver: &mut dyn FnMut(&[u8]));

    /// As [`send`](Self::send); a link that does not look at bytes carries a packet as it is.
    fn send_carried(&mut self, now: u64, carried: Carried) {
        self.send(now, &carried.into_bytes());
    }

    /// As [`receive`](Self::receive), as it was carried.
    fn receive_carried(&mut self, now: u64, deliver: &mut dyn FnMut(Carried)) {
        self.receive(now, &mut |bytes| deliver(bytes.into()));
    }

    /// The controller that sends was reset in tick `now`: where it has left its bus, it joins it again.
    fn reset(&mut self, _now: u64) {}

    /// Ticks from sending to arrival; none for a link that does not measure it, and
    /// while nothing has arrived.
    fn transit_ticks(&self) -> Option<TransitTicks> {
        None
    }

    /// What its medium came to by tick `now`, and its own packets on it; none for a link without one.
    fn report(&self, _now: u64) -> Option<MediumReport> {
        None
    }
}

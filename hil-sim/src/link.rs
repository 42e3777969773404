//! Links: carry bytes from one controller to another and know nothing of what is in them.
//!
//! A link is one direction. Time is given to it in ticks; nothing here reads a clock.
//! A new kind of link is one file here. Those over a simulated medium put contents on a [`bus`](crate::bus) as the
//! core's [carriers](dimsart_core::carrier) do, and [`Carrier`] makes them of a scenario.

mod address;
mod arrival;
mod buses;
mod can;
mod carrier;
mod in_process;
mod medium;
mod open;
mod parameters;
mod serial;
#[cfg(all(feature = "socketcan", target_os = "linux"))]
mod socketcan;
mod transit;
mod udp;

pub use address::Address;
pub use arrival::ArrivalPoll;
pub use buses::{Buses, Route};
pub(crate) use can::can_frames;
pub use carrier::{Carrier, Ends};
pub use in_process::{InProcess, InProcessParameters};
pub use open::{Channels, OpenError, open};
pub use serial::Serial;
#[cfg(all(feature = "socketcan", target_os = "linux"))]
pub use socketcan::SocketCan;
pub use transit::TransitTicks;
pub use udp::{Udp, UdpError};

use crate::bus::MediumReport;

/// One direction of a connection.
pub trait Link: core::fmt::Debug + Send {
    /// Takes a packet to be carried, in tick `now`.
    fn send(&mut self, now: u64, bytes: &[u8]);

    /// Gives `deliver` every packet that has arrived by tick `now`, in the order of arrival.
    fn receive(&mut self, now: u64, deliver: &mut dyn FnMut(&[u8]));

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

//! Links: carry bytes from one controller to another and know nothing of what is in them.
//!
//! A link is one direction. Time is given to it in ticks; nothing here reads a clock.
//! A new kind of link is one file here.

mod address;
mod ear;
mod in_process;
mod open;
mod serial;
#[cfg(all(feature = "socketcan", target_os = "linux"))]
mod socketcan;
mod udp;

pub use address::Address;
pub use ear::Ear;
pub use in_process::{InProcess, InProcessParameters};
pub use open::{Channels, OpenError, open};
pub use serial::Serial;
#[cfg(all(feature = "socketcan", target_os = "linux"))]
pub use socketcan::SocketCan;
pub use udp::{Udp, UdpError};

/// One direction of a connection.
pub trait Link: core::fmt::Debug + Send {
    /// Takes a packet to be carried, in tick `now`.
    fn send(&mut self, now: u64, bytes: &[u8]);

    /// Gives `deliver` every packet that has arrived by tick `now`, in the order of arrival.
    fn receive(&mut self, now: u64, deliver: &mut dyn FnMut(&[u8]));
}

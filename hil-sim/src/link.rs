//! Links: carry bytes from one controller to another and know nothing of what is in them.
//!
//! A link is one direction. Time is given to it in ticks; nothing here reads a clock.
//! A new kind of link is one file here.

mod in_process;
mod udp;

pub use in_process::{InProcess, InProcessParameters};
pub use udp::{Ear, Udp, UdpError};

/// One direction of a connection.
pub trait Link: core::fmt::Debug + Send {
    /// Takes a packet to be carried, in tick `now`.
    fn send(&mut self, now: u64, bytes: &[u8]);

    /// Gives `deliver` every packet that has arrived by tick `now`, in the order of arrival.
    fn receive(&mut self, now: u64, deliver: &mut dyn FnMut(&[u8]));
}

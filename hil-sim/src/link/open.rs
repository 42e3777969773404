//! Opens the link of a side that is a process of its own, over the medium of its address.

use super::PortError;
use super::{Address, ArrivalPoll, Link, Serial, Udp, UdpError};

/// The channels of a side's packets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Channels {
    /// Of what it sends.
    pub out: u16,
    /// Of what it listens to.
    pub listening: u16,
    /// Whether packets have tags, on both.
    pub are_authenticated: bool,
}

/// Why a link does not open.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The socket.
    #[error(transparent)]
    Udp(#[from] UdpError),
    /// The serial port.
    #[error(transparent)]
    Serial(#[from] PortError),
    /// The CAN interface.
    #[error(
        "the CAN interface {interface} does not open: {source}; bring it up with `ip link set {interface} up`"
    )]
    Can {
        /// The interface.
        interface: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// This program cannot.
    #[error("this program knows no CAN interfaces: build it on Linux with `--features socketcan`")]
    NoSocketCan,
    /// A side that would answer itself.
    #[error("both sides are at {0}: each needs a UDP address of its own")]
    Same(Address),
    /// A socket can only talk to another one.
    #[error("{own} is a UDP address and the other side's, {peer}, is none: both have to be of one kind")]
    OtherMedium {
        /// This side's.
        own: Address,
        /// The other side's.
        peer: Address,
    },
}

/// Both directions of a side at `own`, and who hears when something comes in, where that is possible. `peer` is for
/// UDP alone: at the other media there is nobody else.
///
/// # Errors
/// [`OpenError`] says what does not open and what to do.
pub fn open(
    own: &Address,
    peer: &Address,
    channels: Channels,
) -> Result<(Box<dyn Link>, Option<ArrivalPoll>), OpenError> {
    match (own, peer) {
        (Address::Udp(one), Address::Udp(other)) if one == other => Err(OpenError::Same(own.clone())),
        (Address::Udp(own), Address::Udp(peer)) => {
            let link = Udp::open(*own, *peer)?;
            let arrival = link.arrival();
            Ok((Box::new(link), arrival))
        }
        (Address::Udp(_), _) => Err(OpenError::OtherMedium { own: own.clone(), peer: peer.clone() }),
        (Address::Serial { path, baud }, _) => {
            let link = Serial::open(path, *baud)?;
            let arrival = link.arrival();
            Ok((Box::new(link), arrival))
        }
        (Address::Can { interface, is_fd }, _) => Ok((open_can(interface, *is_fd, channels)?, None)),
    }
}

#[cfg(all(feature = "socketcan", target_os = "linux"))]
fn open_can(interface: &str, is_fd: bool, channels: Channels) -> Result<Box<dyn Link>, OpenError> {
    let link = super::SocketCan::open(interface, is_fd, channels);
    let link = link.map_err(|source| OpenError::Can { interface: interface.to_owned(), source })?;
    Ok(Box::new(link))
}

#[cfg(not(all(feature = "socketcan", target_os = "linux")))]
fn open_can(_: &str, _: bool, _: Channels) -> Result<Box<dyn Link>, OpenError> {
    Err(OpenError::NoSocketCan)
}

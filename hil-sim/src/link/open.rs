//! Opens the link of a station that is a separate process.

use super::PortError;
use super::{Address, ArrivalPoll, Link, Serial, Udp, UdpError};

/// Channels of a station's packets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Channels {
    /// Sending channel.
    pub out: u16,
    /// Receiving channel.
    pub receive: u16,
    /// Whether packets are authenticated.
    pub is_authenticated: bool,
}

/// Error of opening a link.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// UDP socket.
    #[error(transparent)]
    Udp(#[from] UdpError),
    /// Serial port.
    #[error(transparent)]
    Serial(#[from] PortError),
    /// CAN interface.
    #[error("cannot open CAN interface {interface}: {source}; bring it up with `ip link set {interface} up`")]
    Can {
        /// Interface.
        interface: String,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// CAN interfaces are not supported by this build.
    #[error("this build does not support CAN interfaces: build on Linux with `--features socketcan`")]
    NoSocketCan,
    /// Both stations have the same address.
    #[error("both sides use {0}: give each side a unique UDP address")]
    DuplicateAddress(Address),
    /// Only one station has a UDP address.
    #[error("{own} is a UDP address but {peer} is not: both sides must use the same kind of address")]
    MediumMismatch {
        /// Own address.
        own: Address,
        /// Peer address.
        peer: Address,
    },
}

/// Opens both directions at `own`, with an arrival detector if supported. `peer` is used for UDP only.
///
/// # Errors
/// [`OpenError`] if the link cannot be opened.
pub fn open(
    own: &Address,
    peer: &Address,
    channels: Channels,
) -> Result<(Box<dyn Link>, Option<ArrivalPoll>), OpenError> {
    match (own, peer) {
        (Address::Udp(one), Address::Udp(other)) if one == other => {
            Err(OpenError::DuplicateAddress(own.clone()))
        }
        (Address::Udp(own), Address::Udp(peer)) => {
            let link = Udp::open(*own, *peer)?;
            let arrival = link.arrival();
            Ok((Box::new(link), arrival))
        }
        (Address::Udp(_), _) => Err(OpenError::MediumMismatch { own: own.clone(), peer: peer.clone() }),
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

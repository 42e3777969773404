//! Packets between the links and the tick.

#[cfg_attr(feature = "auth", path = "links/guarded.rs")]
#[cfg_attr(not(feature = "auth"), path = "links/open.rs")]
mod carry;

use boards::{Board as _, ReceiveChannels, Selected};
use dimsart_core::{Dimsart, Packet, PacketError};

pub(crate) use self::carry::start;

type LinkIn = <Selected as boards::Board>::LinkIn;
type LinkOut = <Selected as boards::Board>::LinkOut;

/// The channel received on each link; set by the tick.
static LISTENING: ReceiveChannels = ReceiveChannels::new();

/// Sets the channels that the scheme receives on.
pub(crate) fn listen(dimsart: &Dimsart) {
    for link in 0..Selected::SIZES.links {
        LISTENING.set(link, dimsart.receive_channel(link));
    }
}

/// Returns the channel received on a link.
pub(crate) fn listened_to(link: usize) -> u16 {
    LISTENING.get(link)
}

/// A received packet, or an error.
pub(crate) struct Received {
    pub(crate) link: usize,
    pub(crate) packet: Result<Packet, PacketError>,
}

/// A packet to send.
pub(crate) struct Outgoing {
    pub(crate) link: usize,
    pub(crate) packet: Packet,
}

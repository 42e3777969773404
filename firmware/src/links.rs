//! Packets between the links and the tick.

#[cfg_attr(feature = "auth", path = "links/guarded.rs")]
#[cfg_attr(not(feature = "auth"), path = "links/open.rs")]
mod carry;

use boards::{Board as _, Listening, Selected};
use dimsart_core::{Dimsart, Packet, PacketError};

pub(crate) use self::carry::start;

type LinkIn = <Selected as boards::Board>::LinkIn;
type LinkOut = <Selected as boards::Board>::LinkOut;

/// What each link listens to. The tick says so.
static LISTENING: Listening = Listening::new();

/// Has the links listen to what the scheme wants to hear.
pub(crate) fn listen(dimsart: &Dimsart) {
    for link in 0..Selected::SIZES.links {
        LISTENING.set(link, dimsart.listening_channel(link));
    }
}

/// The channel that is listened to on a link.
pub(crate) fn listened_to(link: usize) -> u16 {
    LISTENING.get(link)
}

/// A packet that came in, or why it is none.
pub(crate) struct Received {
    pub(crate) link: usize,
    pub(crate) packet: Result<Packet, PacketError>,
}

/// A packet that a tick left to be sent.
pub(crate) struct Outgoing {
    pub(crate) link: usize,
    pub(crate) packet: Packet,
}

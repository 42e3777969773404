//! Packets between the links and the tick.

use boards::{LinkIn as _, LinkOut as _, Listening, Selected};
use dimsart_core::limits::MAX_LINKS;
use dimsart_core::{MAX_PACKET_BYTES, Packet, PacketError};

use crate::BoardDimsart;
use crate::handover::{Giver, Taker};

type LinkIn = <Selected as boards::Board>::LinkIn;
type LinkOut = <Selected as boards::Board>::LinkOut;

/// What each link listens to. The tick says so.
static LISTENING: Listening = Listening::new();

/// Has the links listen to what the scheme wants to hear.
pub(crate) fn listen(dimsart: &BoardDimsart) {
    for link in 0..MAX_LINKS {
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

#[embassy_executor::task]
pub(crate) async fn receive(mut link_in: LinkIn, mut packets: Giver<Received>) {
    let mut buffer = [0; MAX_PACKET_BYTES];
    loop {
        let (link, length) = link_in.receive(&LISTENING, &mut buffer).await;
        if let Some(bytes) = buffer.get(..length) {
            packets.give(Received { link, packet: Packet::from_bytes(bytes, listened_to(link)) });
        }
    }
}

#[embassy_executor::task]
pub(crate) async fn send(mut link_out: LinkOut, mut packets: Taker<Outgoing>) {
    loop {
        // The packet itself is not kept while its bytes go out.
        let (link, channel, bytes) = {
            let Outgoing { link, packet } = packets.next().await;
            (link, packet.channel, packet.to_bytes())
        };
        link_out.send(link, channel, &bytes).await;
    }
}

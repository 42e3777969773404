//! Packets between the links and the tick.

use boards::{LinkIn as _, LinkOut as _, Selected};
use dimsart_core::{MAX_PACKET_BYTES, Packet, PacketError};

use crate::handover::{Giver, Taker};

type LinkIn = <Selected as boards::Board>::LinkIn;
type LinkOut = <Selected as boards::Board>::LinkOut;

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
        let (link, length) = link_in.receive(&mut buffer).await;
        if let Some(bytes) = buffer.get(..length) {
            packets.give(Received { link, packet: Packet::from_bytes(bytes, 0) });
        }
    }
}

#[embassy_executor::task]
pub(crate) async fn send(mut link_out: LinkOut, mut packets: Taker<Outgoing>) {
    loop {
        let Outgoing { link, packet } = packets.next().await;
        link_out.send(link, &packet.to_bytes()).await;
    }
}

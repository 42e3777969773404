//! Packets between the links and the tick.

use boards::{LinkIn as _, LinkOut as _, Selected};
use dimsart_core::{MAX_PACKET_BYTES, Packet};
use heapless::Vec;

use crate::handover::{Giver, Taker};

type LinkIn = <Selected as boards::Board>::LinkIn;
type LinkOut = <Selected as boards::Board>::LinkOut;

/// A packet's bytes as they came in.
pub(crate) struct Received {
    pub(crate) link: usize,
    pub(crate) bytes: Vec<u8, MAX_PACKET_BYTES>,
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
        if let Some(Ok(bytes)) = buffer.get(..length).map(Vec::from_slice) {
            packets.give(Received { link, bytes });
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

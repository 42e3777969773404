//! Packets between the links and the tick, without authentication.

use boards::{LinkIn as _, LinkOut as _, MAX_PAYLOAD_BYTES};
use embassy_executor::SendSpawner;

use super::{LISTENING, LinkIn, LinkOut, Outgoing, Received, listened_to};
use crate::handover::{QueueReceiver, QueueSender};
use crate::{entry_points, token};

/// Starts the tasks.
pub(crate) fn start(
    background: SendSpawner,
    (link_in, link_out): (LinkIn, LinkOut),
    (packets_in, packets_out): (QueueSender<Received>, QueueReceiver<Outgoing>),
    (): (),
) {
    background.spawn(token(receive(link_in, packets_in)));
    background.spawn(token(send(link_out, packets_out)));
}

#[embassy_executor::task]
async fn receive(mut link_in: LinkIn, mut packets: QueueSender<Received>) {
    let mut buffer = [0; MAX_PAYLOAD_BYTES];
    loop {
        let (link, length) = link_in.receive(&LISTENING, &mut buffer).await;
        if let Some(bytes) = buffer.get(..length) {
            packets.send(Received { link, packet: entry_points::read(bytes, listened_to(link)) });
        }
    }
}

#[embassy_executor::task]
async fn send(mut link_out: LinkOut, mut packets: QueueReceiver<Outgoing>) {
    loop {
        // Drops the packet before its bytes are sent.
        let (link, channel, bytes) = {
            let Outgoing { link, packet } = packets.receive().await;
            (link, packet.channel, packet.to_bytes())
        };
        link_out.send(link, channel, &bytes).await;
    }
}

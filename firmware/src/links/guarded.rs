//! Packets between the links and the tick, with authentication.
//!
//! A single task handles both directions: sharing the guard between tasks would mask the tick's interrupt for
//! the duration of a tag.

use boards::{Board as _, LinkIn as _, LinkOut as _, MAX_PAYLOAD_BYTES, Selected};
use dimsart_core::envelope::MAX_CONTENT_BYTES;
use dimsart_core::{Packet, PacketError};
use dimsart_link::auth::{Key, KeyDomain, Profile, SecureChannel};
use embassy_executor::SendSpawner;
use embassy_futures::select::{Either3, select3};
use embassy_futures::yield_now;
use firmware::{StoredKey, StoredKeyState};

use super::{LISTENING, LinkIn, LinkOut, Outgoing, Received, listened_to};
use crate::handover::{QueueReceiver, QueueSender};
use crate::key_service::now_ms;
use crate::{entry_points, token};

const LINKS: usize = Selected::SIZES.links;

/// Starts the task. It uses the current key and every later one.
pub(crate) fn start(
    background: SendSpawner,
    (link_in, link_out): (LinkIn, LinkOut),
    (packets_in, packets_out): (QueueSender<Received>, QueueReceiver<Outgoing>),
    (keys, kept): (QueueReceiver<StoredKeyState>, StoredKeyState),
) {
    background.spawn(token(carry(link_in, link_out, packets_in, packets_out, keys, kept)));
}

/// The authentication state.
#[expect(clippy::large_enum_variant, reason = "a single instance per board")]
enum Door {
    /// Without a key: all packets pass.
    Open,
    /// Corrupt key: all packets are dropped.
    Blocked,
    Guarded([Guarded; LINKS]),
}

struct Guarded {
    guard: SecureChannel,
    /// Sending channel.
    channel: u16,
}

impl Door {
    fn new(kept: StoredKeyState) -> Self {
        match kept {
            StoredKeyState::None => Self::Open,
            StoredKeyState::Damaged => Self::Blocked,
            StoredKeyState::Key(StoredKey { key, seed }) => {
                let mut links = 0..;
                Self::Guarded([(); LINKS].map(|()| {
                    let link = links.next().unwrap_or_default();
                    let seed = seed.wrapping_add(link.into());
                    let guard =
                        SecureChannel::new(&Key::new(&key), KeyDomain::Link(link), Profile::Full, seed);
                    Guarded { guard, channel: 0 }
                }))
            }
        }
    }

    fn guarded(&mut self, link: usize) -> Option<&mut Guarded> {
        match self {
            Self::Guarded(guards) => guards.get_mut(link),
            _ => None,
        }
    }

    /// Opens a received message; `None` for a handshake.
    fn open(&mut self, link: usize, content: &[u8]) -> Option<Result<Packet, PacketError>> {
        let channel = listened_to(link);
        // Rejects it as an invalid packet.
        let refused = || entry_points::read(&[], channel);
        match self {
            Self::Open => Some(entry_points::read(content, channel)),
            Self::Blocked => Some(refused()),
            Self::Guarded(guards) => {
                let guard = &mut guards.get_mut(link)?.guard;
                guard.set_receive_channel(channel);
                match guard.open(now_ms(), content, &mut [0; MAX_CONTENT_BYTES]) {
                    Ok(opened) => opened.map(|content| entry_points::read(content, channel)),
                    Err(_) => Some(refused()),
                }
            }
        }
    }
}

#[embassy_executor::task]
async fn carry(
    mut link_in: LinkIn,
    mut link_out: LinkOut,
    mut packets_in: QueueSender<Received>,
    mut packets_out: QueueReceiver<Outgoing>,
    mut keys: QueueReceiver<StoredKeyState>,
    kept: StoredKeyState,
) {
    let mut door = Door::new(kept);
    let mut buffer = [0; MAX_PAYLOAD_BYTES];
    loop {
        // Priority: a new key, then outgoing packets (one per link and tick), then incoming packets, which
        // may be a flood.
        match select3(keys.receive(), packets_out.receive(), link_in.receive(&LISTENING, &mut buffer)).await {
            Either3::First(kept) => door = Door::new(kept),
            Either3::Second(Outgoing { link, packet }) => {
                if let Some(guarded) = door.guarded(link) {
                    guarded.guard.set_send_channel(packet.channel);
                    guarded.channel = packet.channel;
                }
                send_handshake(&mut door, link, &mut link_out).await;
                send(&mut door, link, &packet, &mut link_out).await;
            }
            Either3::Third((link, length)) => {
                if let Some(packet) = buffer.get(..length).and_then(|content| door.open(link, content)) {
                    match packet {
                        Ok(_) => packets_in.send(Received { link, packet }),
                        // A flood of invalid packets must not displace valid ones.
                        Err(_) => packets_in.send_with_reserve(Received { link, packet }, LINKS),
                    }
                }
                send_handshake(&mut door, link, &mut link_out).await;
                // A tag takes long: yields to the command line.
                yield_now().await;
            }
        }
    }
}

/// Sends the pending handshakes of a link.
async fn send_handshake(door: &mut Door, link: usize, link_out: &mut LinkOut) {
    let Some(Guarded { guard, channel }) = door.guarded(link) else { return };
    while let Some(handshake) = guard.handshake(now_ms()) {
        link_out.send(link, *channel, handshake).await;
    }
}

/// Sends a packet; drops it before the handshake is complete.
async fn send(door: &mut Door, link: usize, packet: &Packet, link_out: &mut LinkOut) {
    let bytes = packet.to_bytes();
    let mut sealed = [0; MAX_PAYLOAD_BYTES];
    let content = match door {
        Door::Open => Some(bytes.as_slice()),
        Door::Blocked => None,
        Door::Guarded(guards) => {
            guards.get_mut(link).and_then(|guarded| guarded.guard.seal(&bytes, &mut sealed))
        }
    };
    if let Some(content) = content {
        link_out.send(link, packet.channel, content).await;
    }
}

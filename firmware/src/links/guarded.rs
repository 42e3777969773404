//! Packets between the links and the tick, authenticated: sealed on their way out, opened on their way in.
//!
//! One task for all of it. Both ways need the guard, and to share it between tasks would mask the tick's interrupt for
//! as long as a tag takes.

use boards::{Board as _, LinkIn as _, LinkOut as _, MAX_CARRIED_BYTES, Selected};
use dimsart_core::envelope::MAX_CONTENT_BYTES;
use dimsart_core::{Packet, PacketError};
use dimsart_link::auth::{Guard, Key, Line, Profile};
use embassy_executor::SendSpawner;
use embassy_futures::select::{Either3, select3};
use embassy_futures::yield_now;
use firmware::{Kept, KeptKey};

use super::{LISTENING, LinkIn, LinkOut, Outgoing, Received, listened_to};
use crate::handover::{Giver, Taker};
use crate::key_service::now_ms;
use crate::{entry_points, token};

const LINKS: usize = Selected::SIZES.links;

/// Starts what carries packets. It takes every key that the board is given after the one it has now.
pub(crate) fn start(
    background: SendSpawner,
    (link_in, link_out): (LinkIn, LinkOut),
    (packets_in, packets_out): (Giver<Received>, Taker<Outgoing>),
    (keys, kept): (Taker<Kept>, Kept),
) {
    background.spawn(token(carry(link_in, link_out, packets_in, packets_out, keys, kept)));
}

/// What becomes of what comes and goes.
#[expect(clippy::large_enum_variant, reason = "a board has one, and nowhere else to put it")]
enum Door {
    /// Everything goes through as it is.
    Open,
    /// Nothing goes through.
    Shut,
    Guarded([Guarded; LINKS]),
}

struct Guarded {
    guard: Guard,
    /// What is sent on.
    channel: u16,
}

impl Door {
    fn new(kept: Kept) -> Self {
        match kept {
            Kept::None => Self::Open,
            Kept::Damaged => Self::Shut,
            Kept::Key(KeptKey { key, seed }) => {
                let mut links = 0..;
                Self::Guarded([(); LINKS].map(|()| {
                    let link = links.next().unwrap_or_default();
                    let seed = seed.wrapping_add(link.into());
                    let guard = Guard::new(&Key::new(&key), Line::Link(link), Profile::Full, seed);
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

    /// The packet in what came in; none for a handshake.
    fn open(&mut self, link: usize, content: &[u8]) -> Option<Result<Packet, PacketError>> {
        let channel = listened_to(link);
        // As if nothing that is a packet had come.
        let refused = || entry_points::read(&[], channel);
        match self {
            Self::Open => Some(entry_points::read(content, channel)),
            Self::Shut => Some(refused()),
            Self::Guarded(guards) => {
                let guard = &mut guards.get_mut(link)?.guard;
                guard.listen(channel);
                match guard.take(now_ms(), content, &mut [0; MAX_CONTENT_BYTES]) {
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
    mut packets_in: Giver<Received>,
    mut packets_out: Taker<Outgoing>,
    mut keys: Taker<Kept>,
    kept: Kept,
) {
    let mut door = Door::new(kept);
    let mut buffer = [0; MAX_CARRIED_BYTES];
    loop {
        // Who changes a key waits for it. What goes out comes next: a tick leaves one packet per link, and whoever
        // floods a link brings any number.
        match select3(keys.next(), packets_out.next(), link_in.receive(&LISTENING, &mut buffer)).await {
            Either3::First(kept) => door = Door::new(kept),
            Either3::Second(Outgoing { link, packet }) => {
                if let Some(guarded) = door.guarded(link) {
                    guarded.guard.send_on(packet.channel);
                    guarded.channel = packet.channel;
                }
                shake_hands(&mut door, link, &mut link_out).await;
                send(&mut door, link, &packet, &mut link_out).await;
            }
            Either3::Third((link, length)) => {
                if let Some(packet) = buffer.get(..length).and_then(|content| door.open(link, content)) {
                    match packet {
                        Ok(_) => packets_in.give(Received { link, packet }),
                        // A flood of these must not take the place of what is right.
                        Err(_) => packets_in.give_sparingly(Received { link, packet }, LINKS),
                    }
                }
                shake_hands(&mut door, link, &mut link_out).await;
                // A tag takes long: the command line has its turn.
                yield_now().await;
            }
        }
    }
}

/// Sends the handshakes that are due on a link.
async fn shake_hands(door: &mut Door, link: usize, link_out: &mut LinkOut) {
    let Some(Guarded { guard, channel }) = door.guarded(link) else { return };
    while let Some(handshake) = guard.handshake(now_ms()) {
        link_out.send(link, *channel, handshake).await;
    }
}

/// Sends a packet. It is lost while the other side has not answered.
async fn send(door: &mut Door, link: usize, packet: &Packet, link_out: &mut LinkOut) {
    let bytes = packet.to_bytes();
    let mut sealed = [0; MAX_CARRIED_BYTES];
    let content = match door {
        Door::Open => Some(bytes.as_slice()),
        Door::Shut => None,
        Door::Guarded(guards) => {
            guards.get_mut(link).and_then(|guarded| guarded.guard.seal(&bytes, &mut sealed))
        }
    };
    if let Some(content) = content {
        link_out.send(link, packet.channel, content).await;
    }
}

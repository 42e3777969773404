//! Encodes and decodes packets for `cargo xtask bench`, which counts instructions of `counted_encode` and
//! `counted_decode`.
//!
//! `CARRIER PROTECTION PACKETS`, with carrier `datagram`, `uart`, `can_fd` or `can` and protection `crc` or `auth`.
//! Prints the bytes of the packet's words and the bytes on the carrier.
#![expect(clippy::expect_used, reason = "a benchmark: errors end it")]

use dimsart_core::Packet;
use dimsart_core::envelope::MAX_CONTENT_BYTES;
use dimsart_link::auth::{Key, KeyDomain, Opener, Profile, Sealer};
use dimsart_link::carrier::stream::{MAX_FRAME_BYTES, StreamReceiver};
use dimsart_link::carrier::{can, can_fd, stream};

/// Table 1 at 3 DoF: a wave and its two counters per axis.
const WORDS: usize = 9;
const CHANNEL: u16 = 17;
const KEY: [u8; 16] = *b"a key to measure";

/// One end of each kind; frames are concatenated.
struct Ends {
    carrier: String,
    auth: Option<(Sealer, Opener)>,
    stream: StreamReceiver,
    can: can::Assembler,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [carrier, protection, packets] = arguments.as_slice() else {
        eprintln!("usage: see the head of examples/frame_cost.rs");
        std::process::exit(2);
    };
    let mut ends = Ends {
        carrier: carrier.clone(),
        auth: (protection == "auth").then(introduced),
        stream: StreamReceiver::new(),
        can: can::Assembler::new(),
    };
    let mut wire = Vec::with_capacity(MAX_FRAME_BYTES);
    // Arbitrary bits, like waves and wrapping counters.
    let mut word = 1_u32;
    for number in 1..=packets.parse::<u16>().expect("a whole number up to 65535") {
        let words = (0..WORDS).map(|_| {
            word = word.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            word
        });
        let packet = Packet {
            channel: CHANNEL,
            counter: number,
            echo: number,
            content: 0x1234,
            words: words.collect(),
        };
        wire.clear();
        counted_encode(&mut ends, &packet, &mut wire);
        let received = counted_decode(&mut ends, &wire);
        assert!(received.as_ref() == Some(&packet), "{received:?} instead of {packet:?}");
    }
    println!("{} {}", 4 * WORDS, wire.len());
}

/// An associated sealer and opener.
fn introduced() -> (Sealer, Opener) {
    let (key, line) = (Key::new(&KEY), KeyDomain::Link(0));
    let mut sealer = Sealer::new(&key, line, Profile::Full, CHANNEL, 1);
    let mut opener = Opener::new(&key, line, Profile::Full, CHANNEL, 2);
    let mut out = [0; MAX_CONTENT_BYTES];
    for _ in 0..2 {
        while let Some(handshake) = sealer.handshake() {
            let _ = opener.open(handshake, &mut out);
        }
        while let Some(handshake) = opener.handshake() {
            sealer.receive(handshake);
        }
    }
    (sealer, opener)
}

#[inline(never)]
fn counted_encode(ends: &mut Ends, packet: &Packet, wire: &mut Vec<u8>) {
    let plain = packet.to_bytes();
    let mut sealed = [0; MAX_CONTENT_BYTES];
    let content = match &mut ends.auth {
        Some((sealer, _)) => sealer.seal(&plain, &mut sealed).expect("introduced"),
        None => plain.as_slice(),
    };
    match ends.carrier.as_str() {
        "uart" => wire.extend_from_slice(
            stream::encode(content, &mut [0; MAX_FRAME_BYTES]).expect("fits into the buffer"),
        ),
        "can_fd" => wire.extend_from_slice(&can_fd::pack(content).expect("fits into a frame")),
        "can" => {
            can::frames(content, CHANNEL).expect("a packet").for_each(|frame| wire.extend_from_slice(&frame));
        }
        _ => wire.extend_from_slice(content),
    }
}

#[inline(never)]
fn counted_decode(ends: &mut Ends, wire: &[u8]) -> Option<Packet> {
    let Ends { carrier, auth, stream, can } = ends;
    match carrier.as_str() {
        "uart" => {
            let (last, others) = wire.split_last()?;
            others.iter().for_each(|byte| assert!(stream.push(*byte).is_none(), "an early frame"));
            opened(auth, stream.push(*last)?)
        }
        "can_fd" => opened(auth, can_fd::unpack(wire)?),
        "can" => {
            // Three frames have two bytes of the header each.
            let (heads, others) = wire.split_at_checked(3 * can::MAX_DATA_BYTES)?;
            let mut packet = None;
            for frame in heads.chunks(can::MAX_DATA_BYTES).chain(others.chunks(can::MAX_DATA_BYTES - 2)) {
                if let Some(content) = can.push(frame, CHANNEL) {
                    packet = opened(auth, content);
                }
            }
            packet
        }
        _ => opened(auth, wire),
    }
}

fn opened(auth: &mut Option<(Sealer, Opener)>, content: &[u8]) -> Option<Packet> {
    let mut plain = [0; MAX_CONTENT_BYTES];
    let content = match auth {
        Some((_, opener)) => opener.open(content, &mut plain).ok()??,
        None => content,
    };
    Packet::from_bytes(content, CHANNEL).ok()
}

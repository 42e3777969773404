//! Fuzzes classic CAN frames: noise, then a packet with lost, duplicate, corrupt or reordered frames. Every output is a
//! valid packet, one that was sent unless frames were corrupted, and the next complete packet is received.
#![no_main]

use dimsart_core::Packet;
use dimsart_link::carrier::can::{Assembler, MAX_DATA_BYTES, MAX_WORDS, frames};
use libfuzzer_sys::fuzz_target;

const CHANNEL: u16 = 0x123;

fn packet(counter: u16, bytes: &[u8]) -> Packet {
    let words =
        bytes.chunks_exact(4).take(MAX_WORDS).map(|word| u32::from_le_bytes(word.try_into().unwrap()));
    Packet { channel: CHANNEL, counter, echo: 5, content: 6, words: words.collect() }
}

fuzz_target!(|bytes: &[u8]| {
    let Some((&[count, low, high], rest)) = bytes.split_first_chunk::<3>() else { return };
    let mut assembler = Assembler::new();
    let (noise, rest) = rest.split_at(usize::from(count).min(rest.len()));
    for frame in noise.chunks(MAX_DATA_BYTES) {
        if let Some(content) = assembler.push(frame, CHANNEL) {
            // Corrupt frames can pass the CRC-8 by chance: the result is valid, but not a packet that was sent.
            assert!(
                Packet::from_bytes(content, CHANNEL).is_ok_and(|packet| packet.words.len() <= MAX_WORDS)
                    || content.get(1..3) == Some(&[0, 0])
            );
        }
    }
    let counter = u16::from_le_bytes([low, high]).max(1);
    let sent = packet(counter, rest).to_bytes();
    let own: Vec<_> = frames(&sent, CHANNEL).unwrap().collect();
    let mut mixed = Assembler::new();
    for action in rest {
        let Some(frame) = own.get(usize::from(action & 0xF)) else { continue };
        let channel = if action & 0x20 == 0 { CHANNEL } else { CHANNEL + 1 };
        if let Some(content) = mixed.push(frame, channel) {
            assert_eq!(content, sent.as_slice());
        }
        let mut changed = frame.clone();
        let place = usize::from(action >> 5) % changed.len();
        changed[place] ^= 1 << (action & 7);
        if action & 0x10 != 0 {
            let dropped = mixed.dropped();
            assert!(mixed.push(&changed, CHANNEL).is_none());
            assert_eq!(mixed.dropped(), dropped + 1, "one wrong bit is found");
        }
    }
    // Then the packet's frames in order.
    for assembler in [&mut assembler, &mut mixed] {
        let found =
            own.iter().filter(|frame| assembler.push(frame, CHANNEL) == Some(sent.as_slice())).count();
        assert_eq!(found, 1, "the next whole packet comes");
    }
});

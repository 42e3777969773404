//! Damaged frames of classic CAN, detected by their CRC-8 alone; the bus's own CRC is ignored.

use dimsart_core::Packet;
use dimsart_link::carrier::can::{Assembler, frames};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::assert_share;
use test_requirements::length;

const CHANNEL: u16 = 0x123;

/// Three frames of 8 bytes.
fn packet() -> Vec<Vec<u8>> {
    let words = [0x0123_4567, 0x89AB_CDEF, 0x7654_3210].into_iter().collect();
    let packet = Packet { channel: CHANNEL, counter: 0xABCD, echo: 5, content: 6, words };
    frames(&packet.to_bytes(), CHANNEL).unwrap().map(|frame| frame.to_vec()).collect()
}

/// Returns whether a frame is accepted as the one after these.
fn is_taken(before: &[Vec<u8>], frame: &[u8]) -> bool {
    let mut assembler = Assembler::new();
    for frame in before {
        assert!(assembler.push(frame, CHANNEL).is_none());
    }
    assembler.push(frame, CHANNEL);
    assembler.dropped() == 0
}

/// Except those that change the counter: it also changes the covered but unsent byte, so that the CRC sees
/// two bursts, 1 in 256 of which it misses. The bus's own CRC detects all bursts up to 15 bits.
#[test]
fn every_burst_of_eight_bits_is_found() {
    let packet = packet();
    for (place, frame) in packet.iter().enumerate() {
        assert!(is_taken(&packet[..place], frame));
        let (mut bursts, mut missed) = (0_u32, 0_u32);
        // In transmission order: high bit of a byte first.
        for start in 0..=56 {
            for pattern in (1..=255_u64).filter(|pattern| start == 56 || pattern >> 7 == 1) {
                let burst = (pattern << 56 >> start).to_be_bytes();
                let damaged: Vec<u8> = frame.iter().zip(burst).map(|(byte, wrong)| byte ^ wrong).collect();
                let is_missed = is_taken(&packet[..place], &damaged);
                let changes_counter = burst[1] & 0xF != 0;
                assert!(!is_missed || changes_counter, "frame {place}, bit {start}, {pattern:#x}");
                bursts += u32::from(changes_counter);
                missed += u32::from(is_missed);
            }
        }
        println!("frame {place}: {missed} missed of {bursts} that change the counter");
        assert!(missed <= bursts / 100, "frame {place}: {missed} of {bursts}");
    }
}

/// Eight bits pass 1/256 of random bytes; use CAN FD for more protection.
#[test]
fn random_bytes_pass_a_crc_8_as_often_as_they_have_to() {
    let packet = packet();
    let trials = length(1_000_000, 100_000_000);
    let mut random = Pcg64Mcg::seed_from_u64(4);
    let mut passed = 0;
    for _ in 0..trials {
        let mut damaged = packet[1].clone();
        // The frame index is kept; otherwise the frame would be refused for it.
        damaged[0] = random.next_u64().to_le_bytes()[0];
        random.fill_bytes(&mut damaged[2..]);
        passed += u64::from(is_taken(&packet[..1], &damaged));
    }
    assert_share(passed, trials, 1.0 / 256.0);
}

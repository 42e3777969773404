//! A UART that drops and inserts bytes: every undamaged frame is received, and no other.

use dimsart_core::Packet;
use dimsart_link::carrier::stream::{MAX_FRAME_BYTES, StreamReceiver, encode};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::happens;
use test_requirements::length;

/// A packet of Table 1 for 3 axes, whose words contain its number; every third one is all zeros, the worst
/// case for COBS.
fn packet(number: u64, random: &mut Pcg64Mcg) -> Packet {
    let [low, high, ..] = number.to_le_bytes();
    let mut word = || if number.is_multiple_of(3) { 0 } else { random.next_u32() };
    let words = (0..9).map(|_| word()).collect();
    Packet { channel: 0, counter: u16::from_le_bytes([low, high]).max(1), echo: 0, content: 9, words }
}

fn run(dropped: f64, inserted: f64, frames: u64, seed: u64) {
    let what = format!("{dropped} dropped, {inserted} inserted, seed {seed}");
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut receiver = StreamReceiver::new();
    let (mut touched, mut taken_though_touched) = (0_u64, 0_u64);
    // A frame without its last zero is ended by the first zero of the next frame.
    let mut late: Option<Packet> = None;
    for number in 0..frames {
        let packet = packet(number, &mut random);
        let mut buffer = [0; MAX_FRAME_BYTES];
        let (mut is_touched, mut taken) = (false, 0);
        let content = packet.to_bytes();
        let frame = encode(&content, &mut buffer).unwrap();
        let mut take = |byte| {
            if let Some(content) = receiver.push(byte)
                && let Ok(found) = Packet::from_bytes(content, 0)
            {
                if late.take_if(|late| *late == found).is_some() {
                    taken_though_touched += 1;
                } else {
                    assert_eq!(found, packet, "{what}: frame {number}");
                    taken += 1;
                }
            }
        };
        for byte in frame {
            if happens(&mut random, dropped) {
                is_touched = true;
            } else {
                take(*byte);
            }
            if happens(&mut random, inserted) {
                is_touched = true;
                let [noise, ..] = random.next_u32().to_le_bytes();
                take(noise);
            }
        }
        assert!(taken <= 1, "{what}: frame {number} received {taken} times");
        assert!(is_touched || taken == 1, "{what}: undamaged frame {number} not received");
        late = (taken == 0).then_some(packet);
        touched += u64::from(is_touched);
        taken_though_touched += u64::from(is_touched && taken == 1);
    }
    println!(
        "{what}: of {frames} frames {touched} touched, {taken_though_touched} of them taken all the same"
    );
    assert!(touched > 0);
}

/// The frame after a damaged one is always received: resynchronisation within one frame. 10^6 frames in the
/// long run.
#[test]
fn every_frame_that_came_whole_is_taken_whatever_came_before_it() {
    let frames = length(100_000, 1_000_000) / 9;
    for (seed, rate) in (200..).step_by(10).zip([1e-4, 1e-3, 1e-2]) {
        run(rate, 0.0, frames, seed);
        run(0.0, rate, frames, seed + 1);
        run(rate, rate, frames, seed + 2);
    }
}

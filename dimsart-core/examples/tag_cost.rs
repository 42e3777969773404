//! Seals and opens packets, to have the instructions of `counted_seal` and `counted_open` counted.
//!
//! `valgrind --tool=callgrind --callgrind-out-file=/dev/null --toggle-collect='*counted_seal*' tag_cost 1000`
#![expect(clippy::expect_used, reason = "a program that measures: a set-up that fails ends it")]

use dimsart_core::Packet;
use dimsart_core::auth::{Guard, Key, Profile};
use dimsart_core::envelope::MAX_CONTENT_BYTES;

type Buffer = [u8; MAX_CONTENT_BYTES];

#[inline(never)]
fn counted_seal<'o>(guard: &mut Guard, content: &[u8], out: &'o mut Buffer) -> Option<&'o [u8]> {
    guard.seal(content, out)
}

#[inline(never)]
fn counted_open(guard: &mut Guard, content: &[u8], out: &mut Buffer) -> bool {
    matches!(guard.take(0, content, out), Ok(Some(_)))
}

fn main() {
    let packets: u16 = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(1000);
    let key = Key::new(&[7; 16]);
    let mut sender = Guard::new(&key, Profile::Full, 1);
    let mut receiver = Guard::new(&key, Profile::Full, 2);
    let challenge = receiver.handshake(0).expect("of a new opener").to_vec();
    sender.take(0, &challenge, &mut []).expect("a challenge");
    while let Some(handshake) = sender.handshake(0) {
        // Its own challenge waits for no answer here.
        let _ = receiver.take(0, handshake, &mut []);
    }
    let mut taken = 0;
    for counter in 1..=packets {
        // As Table 1 sends them for 3 axes.
        let words = (0..9).map(|word| u32::from(counter) + word).collect();
        let packet = Packet { channel: 0, counter, echo: 1, content: 2, words };
        let mut sealed = [0; MAX_CONTENT_BYTES];
        let sealed = counted_seal(&mut sender, &packet.to_bytes(), &mut sealed).expect("challenged");
        taken += u16::from(counted_open(&mut receiver, sealed, &mut [0; MAX_CONTENT_BYTES]));
    }
    assert_eq!(taken, packets);
    println!("{taken} packets of {} bytes and a tag of 12", Packet::default().to_bytes().len() + 36);
}

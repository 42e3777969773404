//! Authenticated contents and requests: nothing is taken that was not sealed with the key.
#![no_main]

use dimsart_core::auth::{Key, Opener, Profile};
use dimsart_core::envelope::MAX_CONTENT_BYTES;
use dimsart_core::protocol::{Gate, MAX_FRAME_BYTES, Taken};
use libfuzzer_sys::fuzz_target;

const CHANNEL: u16 = 0;

fuzz_target!(|bytes: &[u8]| {
    let mut out = [0; MAX_CONTENT_BYTES];
    for profile in [Profile::Full, Profile::Short] {
        let mut opener = Opener::new(Key::new(&[7; 16]), profile, CHANNEL, 1);
        // One of the bytes is how long the pieces are, as a line would bring them.
        let Some((length, rest)) = bytes.split_first() else { return };
        for (piece, now_ms) in rest.chunks(usize::from(*length).max(1)).zip((0..).step_by(50)) {
            assert!(!matches!(opener.open(now_ms, piece, &mut out), Ok(Some(_))));
            let _ = opener.challenge(now_ms);
        }
    }
    let mut gate = Gate::locked(Key::new(&[7; 16]), 1);
    let Some((length, rest)) = bytes.split_first() else { return };
    for (piece, now_ms) in rest.chunks(usize::from(*length).max(1)).zip((0..).step_by(50)) {
        // As if the checksum had been right, which no fuzzer finds by chance.
        let taken = gate.take(now_ms, piece);
        assert!(!matches!(taken, Taken::Request(_, request) if request.needs_key()));
        let _ = gate.challenge(now_ms, &mut [0; MAX_FRAME_BYTES]);
    }
});

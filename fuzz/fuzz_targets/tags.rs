//! Fuzzes authentication: only contents and requests sealed with the key are accepted.
#![no_main]

use dimsart_core::envelope::MAX_CONTENT_BYTES;
use dimsart_link::auth::{Key, KeyDomain, Opener, Profile, SecureChannel};
use dimsart_link::protocol::{AccessControl, AccessOutcome, MAX_FRAME_BYTES};
use libfuzzer_sys::fuzz_target;

const CHANNEL: u16 = 0;

fuzz_target!(|bytes: &[u8]| {
    let mut out = [0; MAX_CONTENT_BYTES];
    let key = Key::new(&[7; 16]);
    // The first byte is the length of the pieces.
    let Some((length, rest)) = bytes.split_first() else { return };
    let pieces = || rest.chunks(usize::from(*length).max(1));
    for profile in [Profile::Full, Profile::Short] {
        let mut opener = Opener::new(&key, KeyDomain::Link(0), profile, CHANNEL, 1);
        let mut guard = SecureChannel::new(&key, KeyDomain::Link(0), profile, 1);
        for (piece, now_ms) in pieces().zip(0..) {
            assert!(!matches!(opener.open(piece, &mut out), Ok(Some(_))));
            while opener.handshake().is_some() {}
            assert!(!matches!(guard.open(now_ms, piece, &mut out), Ok(Some(_))));
            while guard.handshake(now_ms).is_some() {}
            assert!(!guard.has_session());
        }
    }
    let mut gate = AccessControl::locked(&key, 1);
    for piece in pieces() {
        // Bypasses the checksum, which a fuzzer does not find by chance.
        let taken = gate.check(piece);
        assert!(!matches!(taken, AccessOutcome::Request(_, request) if request.needs_key()));
        let _ = gate.handshake(&mut [0; MAX_FRAME_BYTES]);
    }
});

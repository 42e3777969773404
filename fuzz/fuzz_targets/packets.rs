//! Fuzzes packets: rejected ones have no effect; accepted ones encode to the same bytes.
#![no_main]

use dimsart_core::Packet;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(packet) = Packet::from_bytes(bytes, 0) {
        assert_eq!(packet.to_bytes().as_slice(), bytes);
    }
});

//! Fuzzes CAN FD frames: unpacking returns a valid range or nothing, and inverts packing.
#![no_main]

use dimsart_link::carrier::can_fd::{MAX_CONTENT_BYTES, MAX_DATA_BYTES, pack, unpack};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Some(content) = unpack(bytes) {
        assert_eq!(bytes.get(1..=content.len()), Some(content));
    }
    match pack(bytes) {
        Some(data) => assert!(data.len() <= MAX_DATA_BYTES && unpack(&data) == Some(bytes)),
        None => assert!(bytes.len() > MAX_CONTENT_BYTES),
    }
});

//! Fuzzes a UART: the receiver finds the next valid frame after any bytes, and every content fits a frame.
#![no_main]

use dimsart_core::envelope::MAX_CONTENT_BYTES;
use dimsart_link::carrier::stream::{MAX_FRAME_BYTES, StreamReceiver, encode};
use libfuzzer_sys::fuzz_target;

const NEXT: &[u8] = &[3, 1, 0, 0, 7];

fuzz_target!(|bytes: &[u8]| {
    let mut receiver = StreamReceiver::new();
    let mut zeros = 0;
    let mut ended = 0;
    for byte in bytes {
        zeros += usize::from(*byte == 0);
        if let Some(content) = receiver.push(*byte) {
            assert!(content.len() <= MAX_CONTENT_BYTES);
            ended += 1;
        }
    }
    // Only a zero ends a frame, valid or not.
    let dropped = receiver.dropped();
    assert!(ended + dropped.damaged as usize + dropped.too_long as usize <= zeros);

    let mut frame = [0; MAX_FRAME_BYTES];
    let own = bytes.get(..bytes.len().min(MAX_CONTENT_BYTES)).unwrap();
    for content in [NEXT, own].into_iter().filter(|content| !content.is_empty()) {
        let mut found = 0;
        for byte in encode(content, &mut frame).unwrap() {
            if let Some(taken) = receiver.push(*byte) {
                // The frame's first zero ends any partial frame.
                found += usize::from(taken == content);
            }
        }
        assert!(found >= 1, "the next good frame is found");
    }
});

//! Acceptance filters.

use crate::desk::{Desk, Frame, PLAIN, RXF0S, RXF1S, Setup, extended, standard};

const REST_REJECTED: u32 = 0b1010 << 2;

/// Receiving FIFO of each frame: 0, 1 or none.
fn places(filters: u32, words: &[(u32, u32)], frames: &[Frame<'_>]) -> Vec<Option<u8>> {
    let mut desk = Desk::joined(2, Setup { filters, ..PLAIN });
    for (offset, word) in words {
        desk.set_ram(1, *offset, *word);
    }
    let mut levels = [0, 0];
    let mut place = |(buffer, frame): (u32, &Frame<'_>)| {
        desk.send(0, buffer % 3, *frame);
        desk.run_us(150.0);
        let now = [RXF0S, RXF1S].map(|register| desk.read(1, register) & 0xF);
        let found = (0u8..).zip(now.iter().zip(levels)).find(|(_, (now, before))| **now != *before);
        levels = now;
        found.map(|(number, _)| number)
    };
    (0..).zip(frames).map(&mut place).collect()
}

#[test]
fn standard_filters_are_a_range_a_pair_or_a_mask() {
    let filter =
        |kind: u32, action: u32, first: u32, second: u32| kind << 30 | action << 27 | first << 16 | second;
    let words = [
        (0x0, filter(0, 3, 0x105, 0x105)),
        (0x4, filter(0, 1, 0x100, 0x10F)),
        (0x8, filter(1, 2, 0x200, 0x2FF)),
        (0xC, filter(2, 2, 0x300, 0x7F0)),
        (0x10, filter(3, 1, 0x000, 0x7FF)),
        (0x14, filter(0, 0, 0x000, 0x7FF)),
    ];
    let identifiers = [0x100, 0x10F, 0x105, 0x200, 0x201, 0x2FF, 0x30F, 0x310];
    let frames = identifiers.map(|identifier| standard(identifier, &[]));
    let filters = 6 << 16 | REST_REJECTED;
    let found = places(filters, &words, &frames);
    assert_eq!(found, [Some(0), Some(0), None, Some(1), None, Some(1), Some(1), None]);
    // A shorter filter list ends earlier.
    assert_eq!(places(1 << 16 | REST_REJECTED, &words, &frames[..1]), [None]);
}

#[test]
fn extended_filters_ignore_standard_frames() {
    let words = [(0x70, 1 << 29), (0x74, 3 << 30 | 0x1FFF_FFFF)];
    let frames = [extended(0x1234_5678, &[]), standard(0x12, &[])];
    assert_eq!(places(8 << 24 | REST_REJECTED, &words, &frames), [Some(0), None]);
    // Non-matching standard frames go to FIFO 1.
    assert_eq!(places(0b01_10 << 2, &words, &frames), [None, Some(1)]);
}

#[test]
fn remote_frames_can_be_rejected() {
    let remote = Frame { first: 1 << 29 | 5 << 18, ..standard(5, &[]) };
    assert_eq!(places(0, &[], &[remote]), [Some(0)]);
    assert_eq!(places(0b10, &[], &[remote, standard(5, &[])]), [None, Some(0)]);
}

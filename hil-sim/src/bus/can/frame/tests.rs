use super::*;
use proptest::prelude::{any, prop_assert, proptest};

fn classic(identifier: Identifier, data: &[u8]) -> CanFrame {
    CanFrame::new(identifier, Format::Classic, data).unwrap()
}

fn identifier(number: u32) -> Identifier {
    if number & 1 == 0 {
        Identifier::Standard(u16::try_from(number >> 1 & 0x7FF).unwrap())
    } else {
        Identifier::Extended(number >> 3)
    }
}

/// (55 + 10 s) and (80 + 10 s) bits with the space behind the frame: Davis et al. 2007, equations 1 and 2.
#[test]
fn the_longest_classic_frames_are_those_of_the_literature() {
    for bytes in 0_u32..=8 {
        for (identifier, base) in [(Identifier::Standard(0), 55), (Identifier::Extended(0), 80)] {
            let most = CanFrame::max_wire_bits(identifier, Format::Classic, bytes as usize).sum();
            assert_eq!(most + INTERFRAME_BITS, base + 10 * bytes);
        }
    }
}

/// 32 nominal bits with the space behind the frame, as Bordoloi and Samii 2014 count; their 28 fast bits besides
/// 10 a byte lack what ISO 11898-1:2015 added: the stuff count and one fixed stuff bit.
#[test]
fn the_longest_fd_frames_are_as_the_standard_counts_them() {
    let bits = |bytes| CanFrame::max_wire_bits(Identifier::Standard(0), Format::Fd, bytes);
    assert_eq!(bits(8).head + bits(8).tail + INTERFRAME_BITS, 32);
    // ESI, length code, 2 stuff bits; stuff count, CRC and their stuff bits; CRC delimiter.
    assert_eq!([0, 8, 16].map(|bytes| bits(bytes).fast), [0, 80, 160].map(|data| 7 + data + 27 + 1));
    assert_eq!([20, 64].map(|bytes| bits(bytes).fast), [200, 640].map(|data| 7 + data + 32 + 1));
}

/// 111 bits of 8 bytes without a stuff bit, with the space behind: alternating bits need none but in the CRC.
#[test]
fn stuff_bits_are_those_of_the_very_bits() {
    let frame = classic(Identifier::Standard(0x555), &[0x55; 8]);
    let (bits, _) = frame.bits();
    assert_eq!(bits.len() + 15 + 13, 111);
    let least = frame.wire_bits().sum() + INTERFRAME_BITS;
    assert!((111..=114).contains(&least), "{least}");
    assert_eq!(stuffed(&[false; 17], 17), 17 + 3);
    // A stuff bit begins a run of its own.
    assert_eq!(stuffed(&[false, false, false, false, false, true, true, true, true], 9), 9 + 2);
}

/// The catalogue's check value: the CRC of "123456789" is 0x059E.
#[test]
fn the_crc_does_not_see_leading_zeros() {
    let mut bits = vec![false; 3];
    b"123456789".iter().for_each(|byte| push(&mut bits, u32::from(*byte), 8));
    assert_eq!(crc_15(&bits), 0x059E);
}

#[test]
fn arbitration_goes_bit_by_bit() {
    let ordered = [
        Identifier::Standard(1),
        Identifier::Extended(1 << 18),
        Identifier::Extended((1 << 18) + 1),
        Identifier::Standard(2),
        Identifier::Standard(0x7FF),
        Identifier::Extended(0x1FFF_FFFF),
    ];
    assert!(ordered.is_sorted());
}

#[test]
fn no_frame_has_a_length_that_does_not_exist() {
    let any = Identifier::Standard(1);
    assert_eq!(CanFrame::new(any, Format::Classic, &[0; 9]), None);
    assert_eq!(CanFrame::new(any, Format::Fd, &[0; 9]), None);
    assert!(CanFrame::new(any, Format::Fd, &[0; 64]).is_some());
}

/// The worst pattern: five equal bits, then four of the other value by turns, stuff bits going on with them.
#[test]
fn the_longest_can_be_reached_but_for_the_crc() {
    for bytes in 1..=8 {
        // Identifier 0 and the length code leave a run that the data takes up.
        let patterns = [0x0F, 0xF0, 0x1E, 0xE1, 0x3C, 0xC3, 0x78, 0x87];
        let frames = (0..=255)
            .flat_map(|first| patterns.map(|rest| [first, rest, rest, rest, rest, rest, rest, rest]));
        let best = frames
            .map(|data| classic(Identifier::Standard(0), &data[..bytes]).wire_bits().sum())
            .max()
            .unwrap();
        let most = CanFrame::max_wire_bits(Identifier::Standard(0), Format::Classic, bytes).sum();
        // The CRC's own bits, at most three stuff bits, cannot be chosen; the length code ends a run early.
        assert!(best + 4 >= most, "{bytes} bytes: {best} of {most}");
    }
}

proptest! {
    #[test]
    fn no_frame_is_longer_than_the_longest(number in any::<u32>(), data in any::<[u8; 64]>(), code in 0_usize..16,
        repeated in any::<bool>())
    {
        let format = if code > 8 || number & 2 == 0 { Format::Fd } else { Format::Classic };
        let bytes = if format == Format::Fd { FD_LENGTHS[code] } else { code };
        let data = if repeated { [data[0]; 64] } else { data };
        let frame = CanFrame::new(identifier(number), format, &data[..bytes]).unwrap();
        let (bits, most) = (frame.wire_bits(), CanFrame::max_wire_bits(identifier(number), format, bytes));
        prop_assert!(bits.head <= most.head && bits.sum() <= most.sum() && bits.tail == most.tail, "{bits:?} {most:?}");
    }
}

//! The first two words of a CAN FD frame in the message RAM of an STM32G4 or another `M_CAN` controller
//! (RM0440, FDCAN, "FDCAN Rx FIFO element", "FDCAN Tx buffer element"): identifier, and length with format.

/// Words of an element in the message RAM: these two and 64 bytes.
pub const WORDS: usize = 18;
/// Maximum length of a frame, bytes.
pub const MAX_BYTES: usize = 64;

/// 29-bit identifier.
const EXTENDED: u32 = 1 << 30;
const REMOTE: u32 = 1 << 29;
/// CAN FD frame with bit rate switching.
const FD: u32 = 1 << 21;
const FAST: u32 = 1 << 20;
/// Position of the length code.
const LENGTH: u32 = 16;
const STANDARD_ID: u32 = 18;

/// Lengths of a CAN FD frame by code.
const LENGTHS: [u8; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64];

/// Encodes a frame with a 29-bit identifier and bit rate switching; `None` for an invalid length.
#[must_use]
pub fn encode_header(identifier: u32, length: usize) -> Option<[u32; 2]> {
    let code = (0..).zip(LENGTHS).find(|(_, known)| usize::from(*known) == length);
    let (code, _): (u32, _) = code?;
    Some([identifier & 0x1FFF_FFFF | EXTENDED, FD | FAST | code << LENGTH])
}

/// Decodes identifier and length in bytes of a received frame; `None` for a remote request.
#[must_use]
pub fn decode_header([first, second]: [u32; 2]) -> Option<(u32, usize)> {
    let identifier = match first & EXTENDED {
        0 => first >> STANDARD_ID & 0x7FF,
        _ => first & 0x1FFF_FFFF,
    };
    let code = second >> LENGTH & 15;
    // A classic frame has at most 8 bytes, whatever its code.
    let code = if second & FD == 0 { code.min(8) } else { code };
    let length = (0..).zip(LENGTHS).find(|(place, _): &(u32, u8)| *place == code);
    (first & REMOTE == 0).then_some(())?;
    length.map(|(_, length)| (identifier, length.into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From the figures of RM0440: XTD bit 30, RTR bit 29; FDF bit 21, BRS bit 20, DLC from bit 16.
    #[test]
    fn words_are_as_the_manual_draws_them() {
        assert_eq!(encode_header(0x8001, 32), Some([0x4000_8001, 0x003D_0000]));
        assert_eq!(encode_header(0x1FFF_FFFF, 0), Some([0x5FFF_FFFF, 0x0030_0000]));
        // A reply with a standard identifier, filter 2, a time stamp, error passive.
        assert_eq!(decode_header([0x8400_0000, 0x023C_1234]), Some((0x100, 24)));
        assert_eq!(decode_header([0x4000_1000, 0x003C_0000]), Some((0x1000, 24)));
        assert_eq!(decode_header([0x6000_1000, 0x0000_0000]), None, "a remote request");
        assert_eq!(decode_header([0x0004_0000, 0x000F_0000]), Some((1, 8)), "a classic frame");
    }

    #[test]
    fn what_is_sent_is_what_comes_in() {
        for length in 0..=MAX_BYTES + 1 {
            let is_one = LENGTHS.iter().any(|known| usize::from(*known) == length);
            assert_eq!(encode_header(0x123, length).is_some(), is_one, "{length}");
            if let Some(words) = encode_header(0x123, length) {
                assert_eq!(decode_header(words), Some((0x123, length)));
            }
        }
    }
}

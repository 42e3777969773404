//! Fields of an encoding.

use super::Register;

/// A 16-bit encoding, or a 32-bit encoding with its first halfword on top.
#[derive(Clone, Copy)]
pub(super) struct Bits(pub(super) u32);

impl Bits {
    /// `width` bits from bit `low`; `width` is 1 to 31.
    pub(super) fn number(self, low: u32, width: u32) -> u32 {
        (self.0 >> low) & ((1 << width) - 1)
    }

    /// Like [`number`](Self::number), for at most 8 bits.
    pub(super) fn byte(self, low: u32, width: u32) -> u8 {
        let [byte, ..] = self.number(low, width).to_le_bytes();
        byte
    }

    /// A four-bit register number.
    pub(super) fn register(self, low: u32) -> Register {
        self.byte(low, 4)
    }

    /// The lower halfword.
    pub(super) fn half(self) -> u16 {
        let [low, high, ..] = self.0.to_le_bytes();
        u16::from_le_bytes([low, high])
    }

    /// One bit.
    pub(super) fn is_set(self, bit: u32) -> bool {
        self.number(bit, 1) == 1
    }

    /// The field as a signed number.
    pub(super) fn signed(self, low: u32, width: u32) -> i32 {
        sign_extend(self.number(low, width), width)
    }
}

/// Sign-extends `value` of `width` bits.
pub(super) fn sign_extend(value: u32, width: u32) -> i32 {
    let unused = 32 - width;
    (value << unused).cast_signed() >> unused
}

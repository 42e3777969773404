//! Conversions between single precision and integers or fixed-point numbers.

use crate::instruction::FloatConvert;

/// The conversion function of the word and the number of fraction bits, and that number.
///
/// Values out of range saturate and NaN becomes 0, like Rust's `as`. Conversion to fixed point rounds toward
/// zero, conversion from fixed point to nearest; a double holds the scaled number exactly.
#[expect(clippy::cast_possible_truncation, reason = "saturates or rounds, like the instruction")]
pub(super) fn convert(kind: FloatConvert) -> (fn([u32; 3]) -> u32, u8) {
    match kind {
        FloatConvert::FromUnsigned => (|[m, ..]| (m as f32).to_bits(), 0),
        FloatConvert::FromSigned => (|[m, ..]| (m.cast_signed() as f32).to_bits(), 0),
        FloatConvert::ToUnsigned => (|[m, ..]| f32::from_bits(m) as u32, 0),
        FloatConvert::ToSigned => (|[m, ..]| (f32::from_bits(m) as i32).cast_unsigned(), 0),
        FloatConvert::ToUnsignedRounded => (|[m, ..]| f32::from_bits(m).round_ties_even() as u32, 0),
        FloatConvert::ToSignedRounded => {
            (|[m, ..]| (f32::from_bits(m).round_ties_even() as i32).cast_unsigned(), 0)
        }
        FloatConvert::FromFixedUnsigned(bits) => {
            (|[m, bits, _]| ((f64::from(m) / scale(bits)) as f32).to_bits(), bits)
        }
        FloatConvert::FromFixedSigned(bits) => {
            (|[m, bits, _]| ((f64::from(m.cast_signed()) / scale(bits)) as f32).to_bits(), bits)
        }
        FloatConvert::ToFixedUnsigned(bits) => {
            (|[m, bits, _]| (f64::from(f32::from_bits(m)) * scale(bits)) as u32, bits)
        }
        FloatConvert::ToFixedSigned(bits) => {
            (|[m, bits, _]| ((f64::from(f32::from_bits(m)) * scale(bits)) as i32).cast_unsigned(), bits)
        }
    }
}

/// `2^bits`, exact for 0 to 32 bits.
fn scale(bits: u32) -> f64 {
    (1_u64 << bits.min(32)) as f64
}

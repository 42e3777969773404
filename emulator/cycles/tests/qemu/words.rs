//! Words for operands: numbers, bit patterns and floats, many of them edge cases.

use rand_core::Rng;

/// NaNs of both kinds and signs, infinities, zeros, and the smallest and largest float of each kind.
const FLOATS: &[u32] = &[
    0x7FC0_0000,
    0xFFC0_0001,
    0x7FA0_0001,
    0xFF80_1234,
    0x7F80_0001,
    0xFFFF_FFFF,
    0x7F80_0000,
    0xFF80_0000,
    0x0000_0000,
    0x8000_0000,
    0x0000_0001,
    0x8000_0001,
    0x007F_FFFF,
    0x807F_FFFF,
    0x0080_0000,
    0x8080_0000,
    0x7F7F_FFFF,
    0xFF7F_FFFF,
    0x3F80_0000,
    0xBF80_0000,
    0x3F7F_FFFF,
    0x3F80_0001,
    0x3F00_0000,
    0x3FC0_0000,
    0x4F00_0000,
    0xCF00_0000,
    0x4F80_0000,
    0x4EFF_FFFF,
    0x4B00_0001,
    0x4B7F_FFFF,
    0x4B80_0000,
    0x3300_0000,
];
const NUMBERS: &[u32] = &[0, 1, 2, 31, 32, 33, 64, 127, 128, 255, 256, 0x7FFF, 0x8000, 0xFFFF, 0x1_0000];

/// This many words, as bytes; occasionally several consecutive special floats.
pub(crate) fn words(random: &mut impl Rng, count: usize) -> Vec<u8> {
    let mut odd = 0_u32;
    let words = (0..count).map(|_| {
        odd = odd.saturating_sub(1);
        if random.next_u32().is_multiple_of(32) {
            odd = random.next_u32() % 24;
        }
        if odd > 0 { one_of(random, FLOATS) } else { word(random) }
    });
    words.flat_map(u32::to_le_bytes).collect()
}

fn one_of(random: &mut impl Rng, words: &[u32]) -> u32 {
    words[random.next_u32() as usize % words.len()]
}

fn word(random: &mut impl Rng) -> u32 {
    let bits = random.next_u32();
    match random.next_u32() % 10 {
        0 => one_of(random, FLOATS),
        1 => one_of(random, NUMBERS),
        2 => one_of(random, NUMBERS).wrapping_neg(),
        3 => 0x8000_0000_u32.wrapping_add(one_of(random, NUMBERS)).wrapping_sub(bits & 1),
        // Floats of similar size, so that sums are rounded.
        4 | 5 => bits & 0x807F_FFFF | (120 + (random.next_u32() & 15)) << 23,
        // Tiny floats, whose products and quotients are denormal.
        6 => bits & 0x807F_FFFF | (random.next_u32() % 70) << 23,
        // Lanes with edge values.
        7 => u32::from_le_bytes(
            bits.to_le_bytes().map(|byte| [0, 1, 0x7F, 0x80, 0x81, 0xFF, 0xFE, byte][usize::from(byte & 7)]),
        ),
        _ => bits,
    }
}

//! Encodings of the instructions at the start of programs, as halfwords.

/// `MOVW` and `MOVT`: loads a number into a register (R0 to R12 or LR).
pub(crate) fn constant(register: u16, value: u32) -> [u16; 4] {
    let [a, b, c, d] = value.to_le_bytes();
    let of = |operation: u16, half: u16| {
        let first = operation | (half >> 12) | ((half >> 11) & 1) << 10;
        [first, ((half >> 8) & 7) << 12 | register << 8 | (half & 0xFF)]
    };
    let [low, high] = [of(0xF240, u16::from_le_bytes([a, b])), of(0xF2C0, u16::from_le_bytes([c, d]))];
    [low[0], low[1], high[0], high[1]]
}

/// Enables the float unit; overwrites R0 and R1.
pub(crate) fn float_unit_on() -> Vec<u16> {
    let mut code = [constant(0, 0xE000_ED88), constant(1, 0x00F0_0000)].concat();
    code.extend([0x6001, 0xF3BF, 0x8F4F, 0xF3BF, 0x8F6F]); // str r1, [r0]; dsb; isb
    code
}

//! Extensions, bit fields, bit counts, saturation.

use super::Execution;
use crate::domain::Domain;
use crate::instruction::{BitOperation, Extend, Register, Shift};

/// APSR's sticky saturation flag.
pub(super) const Q: u32 = 1 << 27;

impl<D: Domain, M> Execution<'_, D, M> {
    pub(super) fn extend(
        &mut self,
        kind: Extend,
        d: Register,
        n: Option<Register>,
        m: Register,
        rotation: u8,
    ) {
        let word = self.read(m);
        let word = self.shifted(word, Shift::RotateRight, rotation);
        let is_lanes = matches!(kind, Extend::Sxtb16 | Extend::Uxtb16);
        let extended = match kind {
            Extend::Uxtb => self.mask(word, 0xFF),
            Extend::Uxth => self.mask(word, 0xFFFF),
            Extend::Uxtb16 => self.mask(word, 0x00FF_00FF),
            Extend::Sxtb => self.sign_extended(word, 8),
            Extend::Sxth => self.sign_extended(word, 16),
            Extend::Sxtb16 => {
                let zero = self.domain.constant(0);
                // The sign of each lane's lower byte fills the upper byte.
                self.domain.apply([word, zero, zero], |[word, ..]| {
                    (word & 0x00FF_00FF) | (((word >> 7) & 0x0001_0001) * 0xFF00)
                })
            }
        };
        let result = match n.map(|n| self.read(n)) {
            None => extended,
            Some(n) if is_lanes => {
                let zero = self.domain.constant(0);
                self.domain.apply([n, extended, zero], |[n, extended, _]| {
                    let upper = (n & 0xFFFF_0000).wrapping_add(extended & 0xFFFF_0000);
                    upper | (n.wrapping_add(extended) & 0xFFFF)
                })
            }
            Some(n) => self.sum(n, extended),
        };
        self.write(d, result);
    }

    /// Sign-extends the lowest `bits` bits of a word.
    pub(super) fn sign_extended(&mut self, word: D::Word, bits: u8) -> D::Word {
        let left = self.shifted(word, Shift::Left, 32 - bits);
        self.shifted(left, Shift::ArithmeticRight, 32 - bits)
    }

    pub(super) fn extract_field(
        &mut self,
        d: Register,
        n: Register,
        (min_bit, width): (u8, u8),
        is_signed: bool,
    ) {
        let word = self.read(n);
        let field = self.shifted(word, Shift::LogicalRight, min_bit);
        let field =
            if is_signed { self.sign_extended(field, width) } else { self.mask(field, lowest_bits(width)) };
        self.write(d, field);
    }

    pub(super) fn insert_field(&mut self, d: Register, n: Option<Register>, (min_bit, width): (u8, u8)) {
        let field = lowest_bits(width) << min_bit;
        let before = self.read(d);
        let around = self.mask(before, !field);
        let result = match n {
            None => around,
            Some(n) => {
                let inserted = self.read(n);
                let inserted = self.shifted(inserted, Shift::Left, min_bit);
                let inserted = self.mask(inserted, field);
                self.domain.or(around, inserted)
            }
        };
        self.write(d, result);
    }

    pub(super) fn bits(&mut self, kind: BitOperation, d: Register, m: Register) {
        let (m, zero) = (self.read(m), self.domain.constant(0));
        let words = [m, zero, zero];
        let result = match kind {
            BitOperation::Clz => self.domain.apply_below(words, 32, |[m, ..]| m.leading_zeros()),
            BitOperation::Rbit => self.domain.apply(words, |[m, ..]| m.reverse_bits()),
            BitOperation::Rev => self.domain.apply(words, |[m, ..]| m.swap_bytes()),
            BitOperation::Rev16 => self.domain.apply(words, |[m, ..]| m.swap_bytes().rotate_left(16)),
            BitOperation::Revsh => {
                let turned = self.domain.apply(words, |[m, ..]| m.swap_bytes().rotate_left(16));
                self.sign_extended(turned, 16)
            }
        };
        self.write(d, result);
    }

    pub(super) fn saturate(
        &mut self,
        d: Register,
        (bits, is_signed): (u8, bool),
        n: Register,
        (shift, amount): (Shift, u8),
    ) {
        let word = self.read(n);
        let word = self.shifted(word, shift, amount);
        let words = [word, self.domain.constant(u32::from(bits)), self.domain.constant(0)];
        let result = if is_signed {
            self.set_q(words, |words| if saturated_signed(words) == words[0] { 0 } else { Q });
            self.domain.apply(words, saturated_signed)
        } else {
            self.set_q(words, |words| if saturated_unsigned(words) == words[0] { 0 } else { Q });
            self.domain.apply_below(words, lowest_bits(bits), saturated_unsigned)
        };
        self.write(d, result);
    }

    /// Sets Q if the result of `function` has it set.
    pub(super) fn set_q(&mut self, words: [D::Word; 3], function: fn([u32; 3]) -> u32) {
        let q = self.domain.apply_below(words, Q, function);
        self.registers.dsp_flags = self.domain.or(self.registers.dsp_flags, q);
    }

    pub(super) fn pack(&mut self, d: Register, n: Register, (m, amount): (Register, u8), top_first: bool) {
        let n = self.read(n);
        let m = self.read(m);
        let shift = if top_first { Shift::ArithmeticRight } else { Shift::Left };
        let m = self.shifted(m, shift, amount);
        let (top, bottom) = if top_first { (n, m) } else { (m, n) };
        let (top, bottom) = (self.mask(top, 0xFFFF_0000), self.mask(bottom, 0xFFFF));
        let result = self.domain.or(top, bottom);
        self.write(d, result);
    }
}

/// A mask of the lowest `bits` bits, 0 to 32.
fn lowest_bits(bits: u8) -> u32 {
    u32::MAX.checked_shr(32_u32.saturating_sub(u32::from(bits))).unwrap_or(0)
}

/// `bits` from 1 to 32.
fn saturated_signed([word, bits, _]: [u32; 3]) -> u32 {
    let greatest = (1_i64 << bits.saturating_sub(1).min(31)) - 1;
    let value = i64::from(word.cast_signed()).clamp(-greatest - 1, greatest);
    // The clamp keeps the value within 32 bits.
    i32::try_from(value).unwrap_or(0).cast_unsigned()
}

/// `bits` from 0 to 31.
fn saturated_unsigned([word, bits, _]: [u32; 3]) -> u32 {
    let greatest = (1_u32 << bits.min(31)) - 1;
    word.cast_signed().max(0).cast_unsigned().min(greatest)
}

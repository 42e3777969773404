//! Operations on lanes of 8 or 16 bits, and saturating sums.

use super::Execution;
use super::bits::Q;
use crate::domain::Domain;
use crate::instruction::{Parallel, Register};

type Function = fn([u32; 3]) -> u32;

/// APSR's GE flags, one per byte.
const GE: u32 = 0x000F_0000;

impl<D: Domain, M> Execution<'_, D, M> {
    pub(super) fn parallel(&mut self, kind: Parallel, d: Register, n: Register, m: Register) {
        let (n, m) = (self.read(n), self.read(m));
        let words = [n, m, self.registers.dsp_flags];
        if let Some(greater_or_equal) = greater_or_equal(kind) {
            let flags = self.domain.apply_below(words, GE, greater_or_equal);
            let others = self.mask(self.registers.dsp_flags, !GE);
            self.registers.dsp_flags = self.domain.or(others, flags);
        }
        if let Some(saturated) = saturated(kind) {
            self.set_q(words, saturated);
        }
        let result = self.domain.apply(words, value(kind));
        self.write(d, result);
    }
}

/// The result. The 32-bit sums have the operand order of the assembler: `QSUB d, m, n` is `m - n`, `QDSUB d,
/// m, n` is `m - 2 n`.
fn value(kind: Parallel) -> Function {
    match kind {
        Parallel::Uadd8 => |w| bytes(w, |n, m| n + m),
        Parallel::Usub8 => |w| bytes(w, |n, m| n - m),
        Parallel::Uqadd8 => |w| bytes(w, |n, m| (n + m).min(0xFF)),
        Parallel::Uqsub8 => |w| bytes(w, |n, m| (n - m).max(0)),
        Parallel::Sadd8 => |w| signed_bytes(w, |n, m| n + m),
        Parallel::Ssub8 => |w| signed_bytes(w, |n, m| n - m),
        Parallel::Qadd8 => |w| signed_bytes(w, |n, m| (n + m).clamp(-0x80, 0x7F)),
        Parallel::Qsub8 => |w| signed_bytes(w, |n, m| (n - m).clamp(-0x80, 0x7F)),
        Parallel::Uadd16 => |w| halves(w, |n, m| n + m),
        Parallel::Usub16 => |w| halves(w, |n, m| n - m),
        Parallel::Uqadd16 => |w| halves(w, |n, m| (n + m).min(0xFFFF)),
        Parallel::Uqsub16 => |w| halves(w, |n, m| (n - m).max(0)),
        Parallel::Sadd16 => |w| signed_halves(w, |n, m| n + m),
        Parallel::Ssub16 => |w| signed_halves(w, |n, m| n - m),
        Parallel::Qadd16 => |w| signed_halves(w, |n, m| (n + m).clamp(-0x8000, 0x7FFF)),
        Parallel::Qsub16 => |w| signed_halves(w, |n, m| (n - m).clamp(-0x8000, 0x7FFF)),
        Parallel::Qadd => |[n, m, _]| n.cast_signed().saturating_add(m.cast_signed()).cast_unsigned(),
        Parallel::Qsub => |[n, m, _]| m.cast_signed().saturating_sub(n.cast_signed()).cast_unsigned(),
        Parallel::Qdadd => |[n, m, _]| m.cast_signed().saturating_add(doubled(n)).cast_unsigned(),
        Parallel::Qdsub => |[n, m, _]| m.cast_signed().saturating_sub(doubled(n)).cast_unsigned(),
        Parallel::Sel => |[n, m, flags]| {
            let chosen = spread(flags);
            (n & chosen) | (m & !chosen)
        },
    }
}

/// GE flags of an operation that sets them: carry of an unsigned sum, no borrow of an unsigned difference,
/// non-negative signed result.
fn greater_or_equal(kind: Parallel) -> Option<Function> {
    Some(match kind {
        Parallel::Uadd8 => |w| gathered(bytes(w, |n, m| -i32::from(n + m > 0xFF))),
        Parallel::Usub8 => |w| gathered(bytes(w, |n, m| -i32::from(n >= m))),
        Parallel::Sadd8 => |w| gathered(signed_bytes(w, |n, m| -i32::from(n + m >= 0))),
        Parallel::Ssub8 => |w| gathered(signed_bytes(w, |n, m| -i32::from(n >= m))),
        Parallel::Uadd16 => |w| gathered(halves(w, |n, m| -i32::from(n + m > 0xFFFF))),
        Parallel::Usub16 => |w| gathered(halves(w, |n, m| -i32::from(n >= m))),
        Parallel::Sadd16 => |w| gathered(signed_halves(w, |n, m| -i32::from(n + m >= 0))),
        Parallel::Ssub16 => |w| gathered(signed_halves(w, |n, m| -i32::from(n >= m))),
        _ => return None,
    })
}

/// Q flag of a 32-bit sum that saturates.
fn saturated(kind: Parallel) -> Option<Function> {
    Some(match kind {
        Parallel::Qadd => |[n, m, _]| q(n.cast_signed().checked_add(m.cast_signed())),
        Parallel::Qsub => |[n, m, _]| q(m.cast_signed().checked_sub(n.cast_signed())),
        Parallel::Qdadd => {
            |[n, m, _]| q(n.cast_signed().checked_mul(2).and_then(|n| m.cast_signed().checked_add(n)))
        }
        Parallel::Qdsub => {
            |[n, m, _]| q(n.cast_signed().checked_mul(2).and_then(|n| m.cast_signed().checked_sub(n)))
        }
        _ => return None,
    })
}

fn q(exact: Option<i32>) -> u32 {
    if exact.is_some() { 0 } else { Q }
}

fn doubled(word: u32) -> i32 {
    word.cast_signed().saturating_mul(2)
}

/// For each pair of unsigned bytes: the lowest byte of `function`'s result.
#[inline]
fn bytes([n, m, _]: [u32; 3], function: impl Fn(i32, i32) -> i32) -> u32 {
    let (n, m) = (n.to_le_bytes().map(i32::from), m.to_le_bytes().map(i32::from));
    u32::from_le_bytes(lanes(n, m, function).map(|[lowest, ..]| lowest))
}

/// Like [`bytes`], signed.
#[inline]
fn signed_bytes([n, m, _]: [u32; 3], function: impl Fn(i32, i32) -> i32) -> u32 {
    let (n, m) = (n.to_le_bytes().map(|lane| i32::from(lane.cast_signed())), m.to_le_bytes());
    u32::from_le_bytes(
        lanes(n, m.map(|lane| i32::from(lane.cast_signed())), function).map(|[lowest, ..]| lowest),
    )
}

/// Like [`bytes`], with halfwords.
#[inline]
fn halves([n, m, _]: [u32; 3], function: impl Fn(i32, i32) -> i32) -> u32 {
    let split = |word: u32| [word & 0xFFFF, word >> 16].map(u32::cast_signed);
    joined(lanes(split(n), split(m), function))
}

/// Like [`halves`], signed.
#[inline]
fn signed_halves([n, m, _]: [u32; 3], function: impl Fn(i32, i32) -> i32) -> u32 {
    let split = |word: u32| [word << 16, word].map(|upper| upper.cast_signed() >> 16);
    joined(lanes(split(n), split(m), function))
}

#[inline]
fn lanes<const N: usize>(n: [i32; N], m: [i32; N], function: impl Fn(i32, i32) -> i32) -> [[u8; 4]; N] {
    let mut pairs = n.into_iter().zip(m);
    core::array::from_fn(|_| pairs.next().map_or(0, |(n, m)| function(n, m)).to_le_bytes())
}

fn joined([[a, b, ..], [c, d, ..]]: [[u8; 4]; 2]) -> u32 {
    u32::from_le_bytes([a, b, c, d])
}

/// GE flags from a word whose bytes are all ones or zero.
fn gathered(lanes: u32) -> u32 {
    (0..4).map(|lane| ((lanes >> (8 * lane)) & 1) << (16 + lane)).sum()
}

/// The inverse of [`gathered`].
fn spread(flags: u32) -> u32 {
    (0..4).map(|lane| (((flags >> (16 + lane)) & 1) * 0xFF) << (8 * lane)).sum()
}

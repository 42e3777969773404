//! Single-precision arithmetic, bit-exact with the FPv4-SP in its default mode.
//!
//! The host's arithmetic differs only in its NaN results, which are not defined there. This file selects the
//! NaN (DDI 0403E A2.5.5, `FPProcessNaNs`).

use crate::instruction::FloatArithmetic;

const SIGN: u32 = 0x8000_0000;
const QUIET: u32 = 0x0040_0000;
const INFINITY: u32 = 0x7F80_0000;
/// Result of an invalid operation.
const DEFAULT_NAN: u32 = 0x7FC0_0000;

/// The function of `[n, m, d]` that an instruction writes to `d`.
pub(super) fn arithmetic(operator: FloatArithmetic) -> fn([u32; 3]) -> u32 {
    match operator {
        FloatArithmetic::Vadd => |[n, m, _]| sum(n, m),
        FloatArithmetic::Vsub => |[n, m, _]| of_two(n, m, |n, m| n - m),
        FloatArithmetic::Vmul => |[n, m, _]| product(n, m),
        FloatArithmetic::Vnmul => |[n, m, _]| product(n, m) ^ SIGN,
        FloatArithmetic::Vdiv => |[n, m, _]| of_two(n, m, |n, m| n / m),
        // Rounded after the product and after the sum.
        FloatArithmetic::Vmla => |[n, m, d]| sum(d, product(n, m)),
        FloatArithmetic::Vmls => |[n, m, d]| sum(d, product(n, m) ^ SIGN),
        FloatArithmetic::Vnmla => |[n, m, d]| sum(d ^ SIGN, product(n, m) ^ SIGN),
        FloatArithmetic::Vnmls => |[n, m, d]| sum(d ^ SIGN, product(n, m)),
        // Rounded once.
        FloatArithmetic::Vfma => |[n, m, d]| fused(d, n, m),
        FloatArithmetic::Vfms => |[n, m, d]| fused(d, n ^ SIGN, m),
        FloatArithmetic::Vfnma => |[n, m, d]| fused(d ^ SIGN, n ^ SIGN, m),
        FloatArithmetic::Vfnms => |[n, m, d]| fused(d ^ SIGN, n, m),
    }
}

fn sum(n: u32, m: u32) -> u32 {
    of_two(n, m, |n, m| n + m)
}

fn product(n: u32, m: u32) -> u32 {
    of_two(n, m, |n, m| n * m)
}

#[inline]
fn of_two(n: u32, m: u32, function: impl Fn(f32, f32) -> f32) -> u32 {
    let result = function(f32::from_bits(n), f32::from_bits(m));
    if result.is_nan() { nan_of([n, m]).unwrap_or(DEFAULT_NAN) } else { result.to_bits() }
}

/// `addend + n m`, rounded once.
fn fused(addend: u32, n: u32, m: u32) -> u32 {
    let [a, b, c] = [n, m, addend].map(f32::from_bits);
    let result = a.mul_add(b, c);
    if !result.is_nan() {
        return result.to_bits();
    }
    let is = |n: u32, magnitude: u32| n & !SIGN == magnitude;
    let no_product = (is(n, INFINITY) && is(m, 0)) || (is(n, 0) && is(m, INFINITY));
    // An invalid product has priority over a quiet NaN addend.
    if no_product && !is_signalling(addend) {
        return DEFAULT_NAN;
    }
    nan_of([addend, n, m]).unwrap_or(DEFAULT_NAN)
}

/// `VSQRT` of the first word.
pub(super) fn square_root([m, ..]: [u32; 3]) -> u32 {
    let result = f32::from_bits(m).sqrt();
    if result.is_nan() { nan_of([m]).unwrap_or(DEFAULT_NAN) } else { result.to_bits() }
}

/// `VCMP` of the first word with the second: N, Z, C, V in bits 31 to 28.
pub(super) fn compared([d, m, _]: [u32; 3]) -> u32 {
    match f32::from_bits(d).partial_cmp(&f32::from_bits(m)) {
        Some(core::cmp::Ordering::Less) => 0x8000_0000,
        Some(core::cmp::Ordering::Equal) => 0x6000_0000,
        Some(core::cmp::Ordering::Greater) => 0x2000_0000,
        None => 0x3000_0000,
    }
}

/// The NaN that an operation propagates: the first signalling operand, made quiet, or else the first quiet
/// operand.
fn nan_of<const N: usize>(operands: [u32; N]) -> Option<u32> {
    let signalling = operands.into_iter().find(|operand| is_signalling(*operand));
    let quiet = || operands.into_iter().find(|operand| f32::from_bits(*operand).is_nan());
    signalling.map(|operand| operand | QUIET).or_else(quiet)
}

fn is_signalling(word: u32) -> bool {
    f32::from_bits(word).is_nan() && word & QUIET == 0
}

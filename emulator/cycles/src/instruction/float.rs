//! Encodings of the floating-point unit FPv4-SP (A6.4 to A6.7): coprocessors 10 and 11.

use super::arithmetic::is_plain;
use super::bits::Bits;
use super::{FloatArithmetic, FloatConvert, FloatRegister, FloatUnary, Operation, PC, Register, SP};

pub(super) fn decode(code: Bits) -> Option<Operation> {
    if code.is_set(28) || code.byte(9, 3) != 0b101 {
        return None;
    }
    match (code.is_set(25), code.is_set(4)) {
        (false, _) if code.byte(21, 4) == 0b0010 => pair(code),
        (false, _) if code.is_set(24) && !code.is_set(21) => load_or_store(code),
        (false, _) => multiple(code),
        (true, _) if code.is_set(24) => None,
        (true, true) => transfer(code),
        (true, false) if code.is_set(8) => None,
        (true, false) => processing(code),
    }
}

/// A single-precision register: four bits and the lowest bit.
fn single(code: Bits, high: u32, lowest: u32) -> FloatRegister {
    code.byte(high, 4) << 1 | code.byte(lowest, 1)
}

/// The first half of a double-precision register; there are 16.
fn double(code: Bits, low: u32, highest: u32) -> Option<FloatRegister> {
    (!code.is_set(highest)).then_some(code.byte(low, 4) << 1)
}

/// `VMOV` of two core registers.
fn pair(code: Bits) -> Option<Operation> {
    if code.byte(4, 4) & 0b1101 != 1 {
        return None;
    }
    let (t, t2) = (code.register(12), code.register(16));
    let s = if code.is_set(8) { double(code, 0, 5)? } else { single(code, 0, 5) };
    let is_load = code.is_set(20);
    if s == 31 || !is_plain(t) || !is_plain(t2) || (is_load && t == t2) {
        return None;
    }
    Some(if is_load {
        Operation::FloatPairToCore { t, t2, m: s }
    } else {
        Operation::FloatPairFromCore { d: s, t, t2 }
    })
}

/// `VLDR`, `VSTR`.
fn load_or_store(code: Bits) -> Option<Operation> {
    let is_double = code.is_set(8);
    let d = if is_double { double(code, 12, 22)? } else { single(code, 12, 22) };
    let base = code.register(16);
    let bytes = code.number(0, 8).cast_signed() * 4;
    let offset = if code.is_set(23) { bytes } else { -bytes };
    if code.is_set(20) {
        return Some(Operation::FloatLoad { d, is_double, base, offset });
    }
    (base != PC).then_some(Operation::FloatStore { d, is_double, base, offset })
}

/// `VLDM`, `VSTM`.
fn multiple(code: Bits) -> Option<Operation> {
    let n: Register = code.register(16);
    let (down, writes_back) = match code.byte(21, 4) & 0b1101 {
        0b0100 => (false, false),
        0b0101 => (false, true),
        0b1001 => (true, true),
        _ => return None,
    };
    let count = code.byte(0, 8);
    let is_double = code.is_set(8);
    let d = if is_double { double(code, 12, 22)? } else { single(code, 12, 22) };
    let is_allowed = n != PC && count > 0 && count <= 32 - d && !(is_double && count % 2 == 1);
    is_allowed.then_some(if code.is_set(20) {
        Operation::FloatLoadMultiple { n, d, count, writes_back, down }
    } else {
        Operation::FloatStoreMultiple { n, d, count, writes_back, down }
    })
}

/// `VMOV` of a core register, `VMRS`, `VMSR`.
fn transfer(code: Bits) -> Option<Operation> {
    let t = code.register(12);
    let is_read = code.is_set(20);
    let is_status = code.byte(21, 3) == 7 && code.byte(16, 4) == 1 && !code.is_set(8);
    if code.number(0, 4) != 0 || code.number(5, 2) != 0 {
        return None;
    }
    if is_status && !code.is_set(7) {
        return match (t, is_read) {
            (SP, _) | (PC, false) => None,
            (_, true) => Some(Operation::FloatStatusRead { t }),
            (_, false) => Some(Operation::FloatStatusWrite { t }),
        };
    }
    // Half of a double-precision register is a single-precision register.
    let s = match (code.byte(21, 3), code.is_set(8)) {
        (0, false) => single(code, 16, 7),
        (half @ (0 | 1), true) => double(code, 16, 7)? | half,
        _ => return None,
    };
    is_plain(t).then_some(if is_read {
        Operation::FloatToCore { t, m: s }
    } else {
        Operation::FloatFromCore { d: s, t }
    })
}

/// Arithmetic of single precision (A6.4).
fn processing(code: Bits) -> Option<Operation> {
    let d = single(code, 12, 22);
    let second = code.is_set(6);
    let of = |first, other| if second { other } else { first };
    let operator = match (code.is_set(23), code.byte(20, 2)) {
        (false, 0) => of(FloatArithmetic::Vmla, FloatArithmetic::Vmls),
        (false, 1) => of(FloatArithmetic::Vnmls, FloatArithmetic::Vnmla),
        (false, 2) => of(FloatArithmetic::Vmul, FloatArithmetic::Vnmul),
        (false, _) => of(FloatArithmetic::Vadd, FloatArithmetic::Vsub),
        (true, 0) if second => return None,
        (true, 0) => FloatArithmetic::Vdiv,
        (true, 1) => of(FloatArithmetic::Vfnms, FloatArithmetic::Vfnma),
        (true, 2) => of(FloatArithmetic::Vfma, FloatArithmetic::Vfms),
        (true, _) if second => return of_one(code, d),
        (true, _) => return immediate(code, d),
    };
    Some(Operation::Float { operator, d, n: single(code, 16, 7), m: single(code, 0, 5) })
}

/// `VMOV` of an immediate: `VFPExpandImm` (A6.4.1).
fn immediate(code: Bits, d: FloatRegister) -> Option<Operation> {
    let number = code.number(16, 4) << 4 | code.number(0, 4);
    let exponent = if number & 0x40 == 0 { 0x4000_0000 } else { 0x3E00_0000 };
    let bits = (number & 0x80) << 24 | exponent | (number & 0x3F) << 19;
    (!code.is_set(5) && !code.is_set(7)).then_some(Operation::FloatImmediate { d, bits })
}

/// Operations with one source: moves, square root, comparison, conversion. Half precision is not modelled.
fn of_one(code: Bits, d: FloatRegister) -> Option<Operation> {
    let m = single(code, 0, 5);
    let upper = code.is_set(7);
    let unary = |operator| Operation::FloatUnary { operator, d, m };
    let convert = |kind| Operation::FloatConvert { kind, d, m };
    Some(match (code.byte(16, 4), upper) {
        (0, false) => unary(FloatUnary::Vmov),
        (0, true) => unary(FloatUnary::Vabs),
        (1, false) => unary(FloatUnary::Vneg),
        (1, true) => unary(FloatUnary::Vsqrt),
        (4, quiet_signals) => Operation::FloatCompare { d, m: Some(m), quiet_signals },
        (5, quiet_signals) if code.number(0, 4) == 0 && !code.is_set(5) => {
            Operation::FloatCompare { d, m: None, quiet_signals }
        }
        (8, false) => convert(FloatConvert::FromUnsigned),
        (8, true) => convert(FloatConvert::FromSigned),
        (12, false) => convert(FloatConvert::ToUnsignedRounded),
        (12, true) => convert(FloatConvert::ToUnsigned),
        (13, false) => convert(FloatConvert::ToSignedRounded),
        (13, true) => convert(FloatConvert::ToSigned),
        // 32-bit fixed point, in place.
        (kind @ (10 | 11 | 14 | 15), true) => {
            let bits = 32 - (code.byte(0, 4) << 1 | code.byte(5, 1));
            let kind = match kind {
                10 => FloatConvert::FromFixedSigned(bits),
                11 => FloatConvert::FromFixedUnsigned(bits),
                14 => FloatConvert::ToFixedSigned(bits),
                _ => FloatConvert::ToFixedUnsigned(bits),
            };
            Operation::FloatConvert { kind, d, m: d }
        }
        _ => return None,
    })
}

//! 32-bit loads and stores of one register (A5.3.7 to A5.3.10).

use super::arithmetic::is_plain;
use super::bits::Bits;
use super::{Address, AddressMode, Offset, Operation, PC, SP, Width};

pub(super) fn decode(code: Bits) -> Option<Operation> {
    let is_load = code.is_set(20);
    let is_signed = code.is_set(24);
    let width = match code.byte(21, 2) {
        0 => Width::Byte,
        1 => Width::Half,
        2 if !is_signed => Width::Word,
        _ => return None,
    };
    let address = address(code, is_load)?;
    let t = code.register(12);
    let (base, is_written) = (address.base, address.mode != AddressMode::Offset);
    if is_written && (base == t || base == PC) {
        return None;
    }
    if !is_load {
        let is_allowed = !is_signed && base != PC && (is_plain(t) || (t == SP && width == Width::Word));
        return is_allowed.then_some(Operation::Store { t, address, width });
    }
    match width {
        Width::Word => {}
        // `PLD`, `PLI`.
        Width::Byte if t == PC && !is_written => return Some(Operation::Hint),
        Width::Byte | Width::Half if !is_plain(t) => return None,
        Width::Byte | Width::Half => {}
    }
    Some(Operation::Load { t, address, width, is_signed })
}

fn address(code: Bits, is_load: bool) -> Option<Address> {
    let base = code.register(16);
    let low = |width| code.number(0, width).cast_signed();
    if base == PC && is_load {
        let offset = if code.is_set(23) { low(12) } else { -low(12) };
        return Some(Address { base, offset: Offset::Immediate(offset), mode: AddressMode::Offset });
    }
    if code.is_set(23) {
        return Some(Address { base, offset: Offset::Immediate(low(12)), mode: AddressMode::Offset });
    }
    if !code.is_set(11) {
        let register = code.register(0);
        return (code.number(6, 5) == 0 && is_plain(register)).then_some(Address {
            base,
            offset: Offset::Register(register, code.byte(4, 2)),
            mode: AddressMode::Offset,
        });
    }
    let mode = match (code.is_set(10), code.is_set(9), code.is_set(8)) {
        (true, false, false) => AddressMode::Offset,
        (true, _, true) => AddressMode::PreIndexed,
        (false, _, true) => AddressMode::PostIndexed,
        // Unprivileged accesses, and undefined encodings.
        (true, true, false) | (false, _, false) => return None,
    };
    let offset = if code.is_set(9) { low(8) } else { -low(8) };
    Some(Address { base, offset: Offset::Immediate(offset), mode })
}

//! 32-bit loads and stores of several registers, exclusive accesses, table branches (A5.3.5, A5.3.6).

use super::arithmetic::is_plain;
use super::bits::Bits;
use super::{Address, AddressMode, LR, Offset, Operation, PC, SP, Width};

/// `LDM`, `STM`.
pub(super) fn registers(code: Bits) -> Option<Operation> {
    let down = match code.byte(23, 2) {
        0b01 => false,
        0b10 => true,
        _ => return None,
    };
    let writes_back = code.is_set(21);
    let n = code.register(16);
    let registers = code.half();
    let has = |register| registers >> register & 1 == 1;
    if n == PC || registers.count_ones() < 2 || has(SP) || (writes_back && has(n)) {
        return None;
    }
    if code.is_set(20) {
        let is_allowed = !(has(PC) && has(LR));
        return is_allowed.then_some(Operation::LoadMultiple { n, registers, writes_back, down });
    }
    (!has(PC)).then_some(Operation::StoreMultiple { n, registers, writes_back, down })
}

/// `LDRD`, `STRD`; without indexing and write-back, exclusive accesses and table branches.
pub(super) fn pair_or_exclusive(code: Bits) -> Option<Operation> {
    let (indexed, writes_back) = (code.is_set(24), code.is_set(21));
    let mode = match (indexed, writes_back) {
        (false, false) if code.is_set(23) => return narrow_exclusive_or_table(code),
        (false, false) => return exclusive(code),
        (true, false) => AddressMode::Offset,
        (true, true) => AddressMode::PreIndexed,
        (false, true) => AddressMode::PostIndexed,
    };
    let (base, t, t2) = (code.register(16), code.register(12), code.register(8));
    let is_load = code.is_set(20);
    if !is_plain(t) || !is_plain(t2) || (writes_back && (base == t || base == t2 || base == PC)) {
        return None;
    }
    let bytes = code.number(0, 8).cast_signed() * 4;
    let offset = Offset::Immediate(if code.is_set(23) { bytes } else { -bytes });
    let address = Address { base, offset, mode };
    if is_load {
        return (t != t2).then_some(Operation::LoadPair { t, t2, address });
    }
    (base != PC).then_some(Operation::StorePair { t, t2, address })
}

/// `LDREX`, `STREX`.
fn exclusive(code: Bits) -> Option<Operation> {
    let (n, t, d) = (code.register(16), code.register(12), code.register(8));
    let offset = code.number(0, 8) * 4;
    if !is_plain(t) || n == PC {
        return None;
    }
    if code.is_set(20) {
        return (d == PC).then_some(Operation::LoadExclusive { t, n, offset, width: Width::Word });
    }
    let is_allowed = is_plain(d) && d != n && d != t;
    is_allowed.then_some(Operation::StoreExclusive { d, t, n, offset, width: Width::Word })
}

/// `LDREXB`, `STREXB`, `LDREXH`, `STREXH`, `TBB`, `TBH`.
fn narrow_exclusive_or_table(code: Bits) -> Option<Operation> {
    let (n, t, d) = (code.register(16), code.register(12), code.register(0));
    let is_load = code.is_set(20);
    let kind = code.byte(4, 4);
    if is_load && kind < 2 {
        let m = code.register(0);
        let is_allowed = n != SP && is_plain(m) && code.byte(8, 8) == 0xF0;
        return is_allowed.then_some(Operation::TableBranch { n, m, half: kind == 1 });
    }
    let width = match kind {
        4 => Width::Byte,
        5 => Width::Half,
        _ => return None,
    };
    if !is_plain(t) || n == PC || code.byte(8, 4) != 0xF {
        return None;
    }
    if is_load {
        return (d == PC).then_some(Operation::LoadExclusive { t, n, offset: 0, width });
    }
    let is_allowed = is_plain(d) && d != n && d != t;
    is_allowed.then_some(Operation::StoreExclusive { d, t, n, offset: 0, width })
}

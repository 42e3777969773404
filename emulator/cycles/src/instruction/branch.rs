//! 32-bit branches and system control (A5.3.4).

use super::arithmetic::is_plain;
use super::bits::{Bits, sign_extend};
use super::narrow::{hint, relative};
use super::{Condition, Operation};

/// The operation, with its own condition if it is a conditional branch.
pub(super) fn decode(code: Bits, address: u32) -> Option<(Condition, Operation)> {
    let operation = match (code.is_set(14), code.is_set(12)) {
        (true, true) => Operation::BranchLink { target: relative(address, far(code)) },
        (false, true) => Operation::Branch { target: relative(address, far(code)) },
        (true, false) => return None,
        (false, false) if code.byte(23, 3) != 0b111 => {
            let target = relative(address, near(code));
            return Some((Condition::from_bits(code.byte(22, 4))?, Operation::Branch { target }));
        }
        (false, false) => control(code)?,
    };
    Some((Condition::Always, operation))
}

/// A 25-bit offset; its bits 23 and 22 are the XNOR of the encoded bit and the sign bit.
fn far(code: Bits) -> i32 {
    let sign = code.number(26, 1);
    let turned = |bit| (code.number(bit, 1) ^ sign) ^ 1;
    let offset = sign << 24 | turned(13) << 23 | turned(11) << 22 | code.number(16, 10) << 12;
    sign_extend(offset | code.number(0, 11) << 1, 25)
}

/// A 21-bit offset.
fn near(code: Bits) -> i32 {
    let offset = code.number(26, 1) << 20 | code.number(11, 1) << 19 | code.number(13, 1) << 18;
    sign_extend(offset | code.number(16, 6) << 12 | code.number(0, 11) << 1, 21)
}

/// `UDF.W`; keeps 8 bits of its number.
fn undefined(code: Bits) -> Option<Operation> {
    let number = code.number(16, 4) << 12 | code.number(0, 12);
    u8::try_from(number).ok().map(Operation::Undefined)
}

fn control(code: Bits) -> Option<Operation> {
    match code.number(16, 11) {
        top if top >> 4 == 0b111_1111 && code.is_set(13) => undefined(code),
        0b011_1010_1111 if code.number(8, 6) == 0 => Some(hint(code.byte(0, 8))),
        0b011_1011_1111 if code.number(8, 6) == 0b00_1111 => match (code.byte(4, 4), code.byte(0, 4)) {
            (2, 15) => Some(Operation::ClearExclusive),
            (4..=6, _) => Some(Operation::Barrier),
            _ => None,
        },
        0b011_1110_1111 if !code.is_set(13) => {
            let d = code.register(8);
            let special = code.byte(0, 8);
            (is_plain(d) && is_special(special)).then_some(Operation::ReadSpecial { d, special })
        }
        // Writes all flags of the program status, but not GE (mask 10).
        top if top >> 4 == 0b011_1000 && code.number(8, 6) == 0b00_1000 => {
            let n = code.register(16);
            let special = code.byte(0, 8);
            (is_plain(n) && is_special(special)).then_some(Operation::WriteSpecial { n, special })
        }
        _ => None,
    }
}

/// Special registers by number (B5.1.1).
fn is_special(number: u8) -> bool {
    matches!(number, 0..=3 | 5..=9 | 16..=20)
}

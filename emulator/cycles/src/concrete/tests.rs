//! Operators on known words, against wider arithmetic.

use proptest::prelude::*;

use super::{Concrete, Flags};
use crate::domain::Domain;
use crate::instruction::{Condition, Shift};

/// Words, many of them edge cases.
fn word() -> impl Strategy<Value = u32> {
    let edges = prop::sample::select(vec![0, 1, 2, 0x7FFF_FFFF, 0x8000_0000, 0x8000_0001, u32::MAX]);
    prop_oneof![edges, any::<u32>()]
}

/// Flags of a sum of three numbers, from the exact unsigned and signed result.
fn flags_of_sum(unsigned: u64, signed: i64) -> Flags {
    let result = unsigned & 0xFFFF_FFFF;
    Flags {
        negative: result >= 0x8000_0000,
        zero: result == 0,
        carry: unsigned > 0xFFFF_FFFF,
        overflow: i32::try_from(signed).is_err(),
    }
}

fn signed(word: u32) -> i64 {
    i64::from(word.cast_signed())
}

proptest! {
    #[test]
    fn a_sum_has_the_flags_of_the_exact_sum(a in word(), b in word(), carry: bool) {
        let (sum, flags) = Concrete.add(a, b, carry);
        prop_assert_eq!(sum, a.wrapping_add(b).wrapping_add(u32::from(carry)));
        let exact = u64::from(a) + u64::from(b) + u64::from(carry);
        prop_assert_eq!(flags, flags_of_sum(exact, signed(a) + signed(b) + i64::from(carry)));
    }

    #[test]
    fn a_difference_has_the_flags_of_the_exact_difference(a in word(), b in word(), carry: bool) {
        let (difference, flags) = Concrete.subtract(a, b, carry);
        let borrow = u32::from(!carry);
        prop_assert_eq!(difference, a.wrapping_sub(b).wrapping_sub(borrow));
        // C is set when there is no borrow.
        prop_assert_eq!(flags.carry, u64::from(a) >= u64::from(b) + u64::from(borrow));
        prop_assert_eq!(flags.overflow, i32::try_from(signed(a) - signed(b) - i64::from(borrow)).is_err());
        prop_assert_eq!((flags.zero, flags.negative), (difference == 0, difference >> 31 == 1));
    }

    #[test]
    fn conditions_match_the_order_of_the_numbers(a in word(), b in word()) {
        let (_, flags) = Concrete.subtract(a, b, true);
        let (sa, sb) = (signed(a), signed(b));
        for (condition, expected) in [
            (Condition::Equal, a == b),
            (Condition::NotEqual, a != b),
            (Condition::CarrySet, a >= b),
            (Condition::CarryClear, a < b),
            (Condition::Higher, a > b),
            (Condition::LowerOrSame, a <= b),
            (Condition::GreaterOrEqual, sa >= sb),
            (Condition::Less, sa < sb),
            (Condition::Greater, sa > sb),
            (Condition::LessOrEqual, sa <= sb),
            (Condition::Always, true),
        ] {
            prop_assert_eq!(Concrete.holds(condition, flags), expected, "{:?}", condition);
        }
    }

    #[test]
    fn a_shift_equals_repeated_shifts_by_one_bit(a in word(), amount in 0..256_u32, carry: bool) {
        for (kind, by_one) in [
            (Shift::Left, (|a| (a << 1, a >> 31 == 1)) as fn(u32) -> (u32, bool)),
            (Shift::LogicalRight, |a| (a >> 1, a & 1 == 1)),
            (Shift::ArithmeticRight, |a| (a >> 1 | a & 0x8000_0000, a & 1 == 1)),
            (Shift::RotateRight, |a| (a.rotate_right(1), a & 1 == 1)),
        ] {
            let expected = (0..amount).fold((a, carry), |(a, _), _| by_one(a));
            // Only the low byte counts.
            prop_assert_eq!(Concrete.shift(kind, a, amount | 0xABCD_0000, carry), expected, "{:?}", kind);
        }
        let expected = (a >> 1 | u32::from(carry) << 31, a & 1 == 1);
        prop_assert_eq!(Concrete.shift(Shift::RotateExtended, a, amount, carry), expected);
    }

    #[test]
    fn logic_is_bitwise(a in word(), b in word()) {
        for bit in 0..32 {
            let of = |word: u32| word >> bit & 1 == 1;
            prop_assert_eq!(of(Concrete.and(a, b)), of(a) && of(b));
            prop_assert_eq!(of(Concrete.or(a, b)), of(a) || of(b));
            prop_assert_eq!(of(Concrete.exclusive_or(a, b)), of(a) != of(b));
            prop_assert_eq!(of(Concrete.not(a)), !of(a));
        }
    }

    #[test]
    fn products_and_quotients_match_64_bit_arithmetic(a in word(), b in word()) {
        let product = u64::from(a) * u64::from(b);
        prop_assert_eq!(u64::from(Concrete.multiply(a, b)), product & 0xFFFF_FFFF);
        let quotient = Concrete.divide_unsigned(a, b);
        match b {
            0 => prop_assert_eq!(quotient, 0),
            _ => prop_assert!(u64::from(quotient) * u64::from(b) <= a.into() && a - quotient * b < b),
        }
    }

    #[test]
    fn flags_are_the_upper_bits_of_a_word(word in word()) {
        let flags = Concrete.flags_from(word);
        prop_assert_eq!(Concrete.flags_word(flags), word & 0xF000_0000);
        prop_assert_eq!(Concrete.carry(flags), word >> 29 & 1 == 1);
        let after = Concrete.flags_of(word, !flags.carry, flags);
        prop_assert_eq!(after.overflow, flags.overflow);
        prop_assert_eq!((after.negative, after.zero, after.carry), (word >> 31 == 1, word == 0, !flags.carry));
    }
}

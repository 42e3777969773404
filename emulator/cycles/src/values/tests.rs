//! Operations on sets of values, against the same operations on their members.

use proptest::prelude::*;

use super::{Values, shifted};
use crate::instruction::Shift;

/// A set of values and one of its members.
pub(crate) fn values() -> impl Strategy<Value = (Values, u32)> {
    let number = prop_oneof![0_u32..40, any::<u32>(), (0_u32..20).prop_map(|n| u32::MAX - n), Just(1 << 31)];
    let step = prop_oneof![Just(1_u32), 2_u32..20, (0_u32..31).prop_map(|power| 1 << power)];
    let set = proptest::collection::vec(number.clone(), 1..8);
    let range = (number, step, 0_u32..200).prop_map(|(low, step, count)| {
        let high = low.saturating_add(step.saturating_mul(count));
        Values::stepped(low, high, step)
    });
    let values = prop_oneof![
        set.prop_map(|numbers| Values::collect(numbers.into_iter())),
        range,
        Just(Values::ALL),
        (any::<u32>(), any::<u32>()).prop_map(|(a, b)| Values::between(a, b)),
    ];
    (values, any::<u32>()).prop_map(|(values, choice)| {
        let place = u64::from(choice) % values.count();
        let member = match values.single() {
            Some(number) => number,
            None if values.count() <= 8 => values.iter().nth(usize::try_from(place).unwrap()).unwrap(),
            None => values.low() + u32::try_from(place).unwrap() * values.step(),
        };
        (values, member)
    })
}

proptest! {
    #[test]
    fn members_are_counted_and_found((values, member) in values()) {
        prop_assert!(values.contains(member) && (values.low()..=values.high()).contains(&member));
        prop_assert_eq!(values.count() == 1, values.single().is_some());
        prop_assert!(values.count() > 500 || values.iter().count() as u64 == values.count());
    }

    #[test]
    fn results_cover_the_results_of_members((a, x) in values(), (b, y) in values()) {
        prop_assert!(a.add(&b).contains(x.wrapping_add(y)));
        prop_assert!(a.subtract(&b).contains(x.wrapping_sub(y)));
        prop_assert!(a.multiply(&b).contains(x.wrapping_mul(y)));
        prop_assert!(a.divide(&b).contains(x.checked_div(y).unwrap_or(0)));
        prop_assert!(a.and(&b).contains(x & y));
        prop_assert!(a.or(&b).contains(x | y));
        prop_assert!(a.exclusive_or(&b).contains(x ^ y));
        for shift in [Shift::Left, Shift::LogicalRight, Shift::ArithmeticRight, Shift::RotateRight] {
            let (amount, bits) = (b.and(&Values::one(63)), y & 63);
            prop_assert!(a.shift(shift, &amount).unwrap().contains(shifted(shift, x, bits)), "{shift:?}");
            let amount = Values::one(bits);
            prop_assert!(a.shift(shift, &amount).unwrap().contains(shifted(shift, x, bits)), "{shift:?}");
        }
    }

    #[test]
    fn sets_cover_their_members((a, x) in values(), (b, y) in values(), c in any::<u32>()) {
        let both = a.union(&b);
        prop_assert!(both.contains(x) && both.contains(y));
        prop_assert!(!b.contains(x) || a.intersection(&b).unwrap().contains(x));
        prop_assert_eq!(a.reaches(x.min(c), x.max(c)), a.limit(x.min(c), x.max(c)).is_some());
        prop_assert_eq!(a.limit(c, u32::MAX).is_some_and(|above| above.contains(x)), x >= c);
        prop_assert_eq!(a.limit(0, c).is_some_and(|below| below.contains(x)), x <= c);
        prop_assert!(a.retain(|number| number == x).unwrap().contains(x));
    }
}

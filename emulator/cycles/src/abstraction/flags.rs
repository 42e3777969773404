//! The flags N, Z, C and V: their possible states and the comparison that set them.

use super::{Abstract, Word};
use crate::instruction::Condition;
use crate::values::Values;

/// The possible states of the flags (16 in total), and the operation that set them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Flags {
    /// One bit per state, indexed by NZCV as a number; never 0.
    pub(super) possible: u16,
    pub(super) source: Source,
}

/// The operation that set the flags.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    Unknown,
    /// `a - b`.
    Difference(Word, Word),
    /// `a + b`.
    Sum(Word, Word),
    /// N and Z belong to this word.
    Result(Word),
}

const N: u16 = 8;
const Z: u16 = 4;
const C: u16 = 2;
const V: u16 = 1;
/// Toggling this bit maps signed order to unsigned order.
const SIGN: u32 = 1 << 31;

/// Whether a condition holds for these flags.
fn holds(condition: Condition, nzcv: u16) -> bool {
    let [n, z, c, v] = [N, Z, C, V].map(|flag| nzcv & flag != 0);
    match condition {
        Condition::Equal => z,
        Condition::NotEqual => !z,
        Condition::CarrySet => c,
        Condition::CarryClear => !c,
        Condition::Minus => n,
        Condition::Plus => !n,
        Condition::Overflow => v,
        Condition::NoOverflow => !v,
        Condition::Higher => c && !z,
        Condition::LowerOrSame => !c || z,
        Condition::GreaterOrEqual => n == v,
        Condition::Less => n != v,
        Condition::Greater => !z && n == v,
        Condition::LessOrEqual => z || n != v,
        Condition::Always => true,
    }
}

/// The opposite condition; `None` for `Always`.
fn inverse(condition: Condition) -> Option<Condition> {
    Some(match condition {
        Condition::Equal => Condition::NotEqual,
        Condition::NotEqual => Condition::Equal,
        Condition::CarrySet => Condition::CarryClear,
        Condition::CarryClear => Condition::CarrySet,
        Condition::Minus => Condition::Plus,
        Condition::Plus => Condition::Minus,
        Condition::Overflow => Condition::NoOverflow,
        Condition::NoOverflow => Condition::Overflow,
        Condition::Higher => Condition::LowerOrSame,
        Condition::LowerOrSame => Condition::Higher,
        Condition::GreaterOrEqual => Condition::Less,
        Condition::Less => Condition::GreaterOrEqual,
        Condition::Greater => Condition::LessOrEqual,
        Condition::LessOrEqual => Condition::Greater,
        Condition::Always => return None,
    })
}

/// Flag states that satisfy a predicate.
fn states(holds: impl Fn(u16) -> bool) -> u16 {
    (0..16).filter(|nzcv| holds(*nzcv)).fold(0, |states, nzcv| states | 1 << nzcv)
}

/// N and Z flags of a result.
fn sign_and_zero(result: u32) -> u16 {
    (if result >> 31 == 1 { N } else { 0 }) | (if result == 0 { Z } else { 0 })
}

/// Flags of the sum of two numbers and a carry.
fn flags_of_sum(a: u32, b: u32, carry: bool) -> u16 {
    let result = a.wrapping_add(b).wrapping_add(u32::from(carry));
    let carries = u64::from(a) + u64::from(b) + u64::from(carry) > u64::from(u32::MAX);
    let overflows = (a ^ result) & (b ^ result) & SIGN != 0;
    sign_and_zero(result) | (if carries { C } else { 0 }) | (if overflows { V } else { 0 })
}

/// Flag states whose N and Z match a possible result.
fn states_of(result: &Values) -> u16 {
    states(|nzcv| match (nzcv & N != 0, nzcv & Z != 0) {
        (true, true) => false,
        (true, false) => result.high() >= SIGN,
        (false, true) => result.contains(0),
        (false, false) => result.reaches(1, SIGN - 1),
    })
}

/// Possible order of two words, from their minimum and maximum.
#[derive(Clone, Copy)]
struct Order {
    can_be_less: bool,
    can_be_greater: bool,
}

impl Order {
    fn of((a_low, a_high): (u32, u32), (b_low, b_high): (u32, u32)) -> Self {
        Self { can_be_less: a_low < b_high, can_be_greater: a_high > b_low }
    }
}

/// Minimum and maximum in signed order, with the sign bit toggled.
fn signed_ends(values: &Values) -> (u32, u32) {
    let (low, high) = (values.low() ^ SIGN, values.high() ^ SIGN);
    if low <= high { (low, high) } else { (0, u32::MAX) }
}

impl Flags {
    /// Flags from bits 31 to 28 of a word.
    pub(super) fn from_bits(values: &Values) -> Self {
        let is_possible = |nzcv: u16| {
            let low = u32::from(nzcv) << 28;
            values.reaches(low, low | 0x0FFF_FFFF)
        };
        let possible = states(is_possible);
        Self { possible: if possible == 0 { u16::MAX } else { possible }, source: Source::Unknown }
    }

    /// All possible states, as bits 31 to 28 of a word.
    pub(super) fn bits(self) -> Values {
        Values::collect((0..16).filter(|nzcv| self.possible & 1 << nzcv != 0).map(|nzcv| nzcv << 28))
    }

    /// Whether a condition holds, if known.
    pub(super) fn decide(self, condition: Condition) -> Option<bool> {
        let meets = states(|nzcv| holds(condition, nzcv));
        match (self.possible & meets, self.possible & !meets) {
            (0, _) => Some(false),
            (_, 0) => Some(true),
            _ => None,
        }
    }

    /// Flags of a bitwise operation.
    pub(super) fn of_result(result: Word, values: &Values, carry: Option<bool>, before: Self) -> Self {
        let overflow = states(|nzcv| before.possible & states(|other| other & V == nzcv & V) != 0);
        let carry = states(|nzcv| carry.is_none_or(|carry| carry == (nzcv & C != 0)));
        Self { possible: states_of(values) & overflow & carry, source: Source::Result(result) }.or_any()
    }

    /// Replaces an empty set of states with all states. The set is empty only on an unreachable path.
    fn or_any(self) -> Self {
        if self.possible == 0 { Self { possible: u16::MAX, ..self } } else { self }
    }
}

impl Abstract {
    /// Flags of `a + b + carry`, which is `result`.
    pub(super) fn flags_of_sum(&self, a: Word, b: Word, carry: Option<bool>, result: &Values) -> Flags {
        let (x, y) = (self.values(a), self.values(b));
        let carry_in = carry.map_or_else(|| Values::between(0, 1), |carry| Values::one(u32::from(carry)));
        let tried = Values::map([x, y, carry_in], |[x, y, carry]| u32::from(flags_of_sum(x, y, carry != 0)));
        let source = if carry == Some(false) { Source::Sum(a, b) } else { Source::Unknown };
        if let Some(tried) = tried {
            return Flags { possible: states(|nzcv| tried.contains(u32::from(nzcv))), source }.or_any();
        }
        let ends = |low: bool| {
            let end = |values: &Values| u64::from(if low { values.low() } else { values.high() });
            end(&x) + end(&y) + end(&carry_in) > u64::from(u32::MAX)
        };
        let (always, sometimes) = (ends(true), ends(false));
        let carries = states(|nzcv| if nzcv & C != 0 { sometimes } else { !always });
        Flags { possible: states_of(result) & carries, source }.or_any()
    }

    /// Flags of `a - b`, which is `result`.
    pub(super) fn flags_of_difference(&mut self, a: Word, b: Word, result: &Values) -> Flags {
        let source = Source::Difference(a, b);
        let (x, y) = (self.values(a), self.values(b));
        match (x.single(), y.single()) {
            (None, Some(limit)) | (Some(limit), None) => {
                self.thresholds.extend([limit.saturating_sub(1), limit, limit.saturating_add(1)]);
            }
            _ => {}
        }
        let none = Values::one(0);
        if let Some(tried) = Values::map([x, y, none], |[x, y, _]| u32::from(flags_of_sum(x, !y, true))) {
            return Flags { possible: states(|nzcv| tried.contains(u32::from(nzcv))), source }.or_any();
        }
        let unsigned = Order::of((x.low(), x.high()), (y.low(), y.high()));
        let signed = Order::of(signed_ends(&x), signed_ends(&y));
        let can_be_equal = x.intersection(&y).is_some() && result.contains(0);
        let ordered = states(|nzcv| {
            if nzcv & Z != 0 {
                return can_be_equal && nzcv == Z | C;
            }
            let is_less = (nzcv & N != 0) != (nzcv & V != 0);
            (if nzcv & C != 0 { unsigned.can_be_greater } else { unsigned.can_be_less })
                && (if is_less { signed.can_be_less } else { signed.can_be_greater })
        });
        Flags { possible: ordered & states_of(result), source }.or_any()
    }

    /// Assumes that a condition holds or fails. Returns the remaining flags, or `None` if this is impossible.
    pub(crate) fn assume(&mut self, condition: Condition, flags: Flags, truth: bool) -> Option<Flags> {
        let possible = flags.possible & states(|nzcv| holds(condition, nzcv) == truth);
        if possible == 0 {
            return None;
        }
        let Some(condition) = (if truth { Some(condition) } else { inverse(condition) }) else {
            return Some(flags);
        };
        let is_possible = match flags.source {
            Source::Unknown => true,
            Source::Result(word) => self.assume_result(condition, word),
            Source::Sum(a, b) => self.assume_sum(condition, (a, b)) && self.assume_sum(condition, (b, a)),
            Source::Difference(a, b) => self.assume_difference(condition, a, b),
        };
        is_possible.then_some(Flags { possible, ..flags })
    }

    fn assume_result(&mut self, condition: Condition, word: Word) -> bool {
        match condition {
            Condition::Equal => self.narrow(word, &Values::one(0)),
            Condition::NotEqual => self.within(word, 1, u32::MAX),
            Condition::Minus => self.within(word, SIGN, u32::MAX),
            Condition::Plus => self.within(word, 0, SIGN - 1),
            _ => true,
        }
    }

    fn assume_sum(&mut self, condition: Condition, (a, b): (Word, Word)) -> bool {
        let b = self.values(b);
        match condition {
            Condition::Equal => self.narrow(a, &Values::one(0).subtract(&b)),
            Condition::NotEqual => match b.single() {
                Some(number) => self.differ(a, Word::constant(number.wrapping_neg())),
                None => true,
            },
            Condition::CarrySet => {
                match u32::MAX.checked_sub(b.high()).and_then(|most| most.checked_add(1)) {
                    Some(least) => self.within(a, least, u32::MAX),
                    // Adding 0 never carries.
                    None => false,
                }
            }
            Condition::CarryClear => self.within(a, 0, u32::MAX - b.low()),
            _ => true,
        }
    }

    fn assume_difference(&mut self, condition: Condition, a: Word, b: Word) -> bool {
        match condition {
            Condition::Equal => {
                let (x, y) = (self.values(a), self.values(b));
                self.narrow(a, &y) && self.narrow(b, &x)
            }
            Condition::NotEqual => self.differ(a, b) && self.differ(b, a),
            Condition::CarrySet => self.order(b, a, false, 0),
            Condition::CarryClear => self.order(a, b, true, 0),
            Condition::Higher => self.order(b, a, true, 0),
            Condition::LowerOrSame => self.order(a, b, false, 0),
            Condition::GreaterOrEqual => self.order(b, a, false, SIGN),
            Condition::Less => self.order(a, b, true, SIGN),
            Condition::Greater => self.order(b, a, true, SIGN),
            Condition::LessOrEqual => self.order(a, b, false, SIGN),
            // The sign of `a - 0` is the sign of `a`.
            Condition::Minus | Condition::Plus if self.values(b).single() == Some(0) => {
                self.assume_result(condition, a)
            }
            _ => true,
        }
    }

    /// Assumes that `a` and `b` differ.
    fn differ(&mut self, a: Word, b: Word) -> bool {
        let (x, Some(number)) = (self.values(a), self.values(b).single()) else { return true };
        let others = if x.low() == number {
            x.limit(number.saturating_add(1), u32::MAX)
        } else if x.high() == number {
            x.limit(0, number.saturating_sub(1))
        } else {
            x.retain(|member| member != number)
        };
        match others {
            Some(_) if x.single() == Some(number) => false,
            Some(others) => self.narrow(a, &others),
            None => false,
        }
    }

    /// Assumes that `a` is at most `b`, or less than `b` if `is_strict`. Compares both with the bits of
    /// `turned` toggled.
    fn order(&mut self, a: Word, b: Word, is_strict: bool, turned: u32) -> bool {
        let ends = |values: Values| {
            if turned == 0 { (values.low(), values.high()) } else { signed_ends(&values) }
        };
        let (_, most) = ends(self.values(b));
        let Some(most) = most.checked_sub(u32::from(is_strict)) else { return false };
        let (least, highest) = ends(self.values(a));
        if least > most || !self.within_turned(a, least, most.min(highest), turned) {
            return false;
        }
        let (least, _) = ends(self.values(a));
        let Some(least) = least.checked_add(u32::from(is_strict)) else { return false };
        let (lowest, most) = ends(self.values(b));
        least <= most && self.within_turned(b, least.max(lowest), most, turned)
    }

    fn within_turned(&mut self, word: Word, low: u32, high: u32, turned: u32) -> bool {
        let (low, high) = (low ^ turned, high ^ turned);
        // A signed interval around 0 is two unsigned intervals.
        if low <= high {
            return self.within(word, low, high);
        }
        let values = self.values(word);
        match (values.limit(low, u32::MAX), values.limit(0, high)) {
            (None, None) => false,
            (Some(upper), Some(lower)) => self.narrow(word, &upper.union(&lower)),
            (Some(part), None) | (None, Some(part)) => self.narrow(word, &part),
        }
    }

    fn within(&mut self, word: Word, low: u32, high: u32) -> bool {
        match self.values(word).limit(low, high) {
            Some(values) => self.narrow(word, &values),
            None => false,
        }
    }
}

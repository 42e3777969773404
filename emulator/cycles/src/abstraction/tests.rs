//! Partially known words against known words: after all operations and facts, the true number is still
//! possible.

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};

use super::{Abstract, AbstractMemory, Region, Word};
use crate::concrete::Concrete;
use crate::domain::Domain;
use crate::instruction::{Condition, Shift, Width};
use crate::state::Memory;
use crate::values::Values;
use crate::values::tests::values;

#[derive(Debug, Clone)]
enum Step {
    Add,
    Subtract,
    And,
    Or,
    ExclusiveOr,
    Not,
    Multiply,
    Divide,
    Shift(Shift, u32),
    AndNumber(u32),
    AddNumber(u32),
    Apply,
    /// Adds the fact whether a condition holds for the flags of a difference, a sum or a result.
    Learn(Condition, u8),
    Store(u32, Width),
    Load(u32, Width),
    StoreSomewhere(Width),
    LoadSomewhere(Width),
}

const CONDITIONS: [Condition; 14] = [
    Condition::Equal,
    Condition::NotEqual,
    Condition::CarrySet,
    Condition::CarryClear,
    Condition::Minus,
    Condition::Plus,
    Condition::Overflow,
    Condition::NoOverflow,
    Condition::Higher,
    Condition::LowerOrSame,
    Condition::GreaterOrEqual,
    Condition::Less,
    Condition::Greater,
    Condition::LessOrEqual,
];
const RAM: u32 = 0x2000_0000;

fn step() -> impl Strategy<Value = Step> {
    let shift = select(vec![Shift::Left, Shift::LogicalRight, Shift::ArithmeticRight, Shift::RotateRight]);
    let mask = prop_oneof![select(vec![0xFF, 0xFFFF, 0xFF00, 0xFFFF_0000, 3, !3, 0x8000_0000]), any::<u32>()];
    let width = || select(vec![Width::Byte, Width::Half, Width::Word]);
    prop_oneof![
        2 => select(vec![Step::Add, Step::Subtract, Step::And, Step::Or, Step::ExclusiveOr, Step::Not]),
        1 => select(vec![Step::Multiply, Step::Divide, Step::Apply]),
        1 => (shift, prop_oneof![0_u32..33, select(vec![8, 16, 24])]).prop_map(|(shift, by)| Step::Shift(shift, by)),
        1 => mask.prop_map(Step::AndNumber),
        1 => any::<u32>().prop_map(Step::AddNumber),
        4 => (select(CONDITIONS.to_vec()), 0_u8..3).prop_map(|(condition, kind)| Step::Learn(condition, kind)),
        1 => (0_u32..13, width()).prop_map(|(address, width)| Step::Store(RAM + address, width)),
        2 => (0_u32..13, width()).prop_map(|(address, width)| Step::Load(RAM + address, width)),
        1 => width().prop_map(Step::StoreSomewhere),
        1 => width().prop_map(Step::LoadSomewhere),
    ]
}

/// The domain and memory, with the true number of every word.
struct Both {
    domain: Abstract,
    memory: AbstractMemory,
    bytes: [u8; 16],
    words: Vec<(Word, u32)>,
}

fn mix([a, b, c]: [u32; 3]) -> u32 {
    a.rotate_left(7) ^ b ^ c
}

fn width_bytes(width: Width) -> usize {
    width.bytes().into()
}

impl Both {
    fn push(&mut self, word: Word, number: u32) {
        self.words.push((word, number));
    }

    fn step(&mut self, step: &Step, (a, x): (Word, u32), (b, y): (Word, u32)) {
        let domain = &mut self.domain;
        let (yes, no) = (domain.bit(true), domain.bit(false));
        let zero = domain.constant(0);
        let result = match step {
            Step::Add => (domain.add(a, b, no).0, x.wrapping_add(y)),
            Step::Subtract => (domain.subtract(a, b, yes).0, x.wrapping_sub(y)),
            Step::And => (domain.and(a, b), x & y),
            Step::Or => (domain.or(a, b), x | y),
            Step::ExclusiveOr => (domain.exclusive_or(a, b), x ^ y),
            Step::Not => (domain.not(a), !x),
            Step::Multiply => (domain.multiply(a, b), x.wrapping_mul(y)),
            Step::Divide => (domain.divide_unsigned(a, b), x.checked_div(y).unwrap_or(0)),
            Step::Apply => (domain.apply([a, b, zero], mix), mix([x, y, 0])),
            Step::Shift(shift, by) => {
                let amount = domain.constant(*by);
                let (concrete, carry) = Concrete.shift(*shift, x, *by, false);
                let (word, bit) = domain.shift(*shift, a, amount, no);
                assert!(domain.known_bit(bit).is_none_or(|known| known == carry));
                (word, concrete)
            }
            Step::AndNumber(number) => {
                let mask = domain.constant(*number);
                (domain.and(a, mask), x & number)
            }
            Step::AddNumber(number) => {
                let number_word = domain.constant(*number);
                (domain.add(a, number_word, no).0, x.wrapping_add(*number))
            }
            Step::Learn(condition, kind) => {
                let any = domain.flags_from(a);
                let any_concrete = Concrete.flags_from(x);
                let (flags, concrete) = match kind {
                    0 => (domain.subtract(a, b, yes).1, Concrete.subtract(x, y, true).1),
                    1 => (domain.add(a, b, no).1, Concrete.add(x, y, false).1),
                    _ => (domain.flags_of(a, no, any), Concrete.flags_of(x, false, any_concrete)),
                };
                let truth = Concrete.holds(*condition, concrete);
                let bit = domain.holds(*condition, flags);
                assert!(domain.known_bit(bit).is_none_or(|known| known == truth), "{condition:?}");
                let left = domain.assume(*condition, flags, truth).expect("it is true");
                assert_ne!(domain.holds(*condition, left), super::Bit::Known(!truth));
                return;
            }
            Step::Store(address, width) => {
                let place = domain.constant(*address);
                self.store(place, *address, *width, (a, x));
                return;
            }
            Step::Load(address, width) => {
                let place = domain.constant(*address);
                self.load(place, *address, *width);
                return;
            }
            Step::StoreSomewhere(width) => {
                let (place, address) = self.somewhere((b, y));
                self.store(place, address, *width, (a, x));
                return;
            }
            Step::LoadSomewhere(width) => {
                let (place, address) = self.somewhere((b, y));
                self.load(place, address, *width);
                return;
            }
        };
        self.push(result.0, result.1);
    }

    /// An address from the low bits of a word.
    fn somewhere(&mut self, (word, number): (Word, u32)) -> (Word, u32) {
        let (mask, base, no) = (self.domain.constant(7), self.domain.constant(RAM), self.domain.bit(false));
        let offset = self.domain.and(word, mask);
        (self.domain.add(offset, base, no).0, RAM + (number & 7))
    }

    fn store(&mut self, place: Word, address: u32, width: Width, (word, number): (Word, u32)) {
        self.memory.store(&mut self.domain, place, width, word).unwrap();
        let (at, bytes) = ((address - RAM) as usize, width_bytes(width));
        self.bytes[at..at + bytes].copy_from_slice(&number.to_le_bytes()[..bytes]);
    }

    fn load(&mut self, place: Word, address: u32, width: Width) {
        let word = self.memory.load(&mut self.domain, place, width).unwrap();
        let at = (address - RAM) as usize;
        let mut bytes = [0; 4];
        bytes[..width_bytes(width)].copy_from_slice(&self.bytes[at..at + width_bytes(width)]);
        self.push(word, u32::from_le_bytes(bytes));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, ..ProptestConfig::default() })]

    #[test]
    fn true_numbers_remain_possible(
        inputs in vec(values(), 1..4),
        steps in vec((step(), any::<Index>(), any::<Index>()), 1..25),
    ) {
        let mut domain = Abstract::default();
        let words = inputs.iter().map(|(values, number)| (domain.unknown(*values), *number)).collect();
        let region = Region { address: RAM, bytes: std::rc::Rc::new(vec![0; 16]) };
        let memory = AbstractMemory::new(Vec::new(), &[region]);
        let mut both = Both { domain, memory, bytes: [0; 16], words };
        for (step, a, b) in &steps {
            let (a, b) = (*a.get(&both.words), *b.get(&both.words));
            both.step(step, a, b);
            for (word, number) in &both.words {
                let values = both.domain.values(*word);
                prop_assert!(values.contains(*number), "{number:#x} not in {values:x?} after {step:?}");
            }
        }
    }
}

#[test]
fn a_known_index_makes_the_element_address_known() {
    let mut domain = Abstract::default();
    let number = domain.unknown(Values::ALL);
    let no_carry = domain.bit(false);
    // Base + 4 (n + 4 n): compilers multiply by 20 this way.
    let by = |domain: &mut Abstract, word, bits| {
        let bits = domain.constant(bits);
        domain.shift(Shift::Left, word, bits, no_carry).0
    };
    let fourfold = by(&mut domain, number, 2);
    let (fivefold, _) = domain.add(number, fourfold, no_carry);
    let offset = by(&mut domain, fivefold, 2);
    let base = domain.constant(RAM);
    let (address, _) = domain.add(base, offset, no_carry);
    assert_eq!(domain.values(address), Values::stepped(0, u32::MAX, 4));
    assert!(domain.narrow(number, &Values::between(0, 7)));
    assert_eq!(domain.values(address), Values::stepped(RAM, RAM + 140, 20));
}

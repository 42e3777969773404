//! Registers as words with names: which bits they have, and what they are after a reset.

use std::sync::LazyLock;

use super::Part;
use super::violation::Access;

/// Every register.
static TABLE: LazyLock<Vec<Facts>> =
    LazyLock::new(|| include_str!("registers.txt").lines().filter_map(Facts::read).collect());
/// Bytes between the first registers of two peripherals.
const BLOCK_BYTES: u32 = 0x400;

/// What is known of a register.
#[derive(Debug)]
struct Facts {
    /// Of its peripheral.
    class: &'static str,
    name: &'static str,
    offset: u32,
    /// Bits that exist.
    mask: u32,
    reset: u32,
    /// The chips that have it so; none where all do.
    family: Option<&'static str>,
}

impl Facts {
    fn read(line: &'static str) -> Option<Self> {
        let mut fields = line.split_whitespace();
        let class = fields.next().filter(|class| !class.starts_with('#'))?;
        let name = fields.next()?;
        let mut number = || u32::from_str_radix(fields.next()?.strip_prefix("0x")?, 16).ok();
        let (offset, mask, reset) = (number()?, number()?, number()?);
        Some(Self { class, name, offset, mask, reset, family: fields.next() })
    }
}

/// Sets what a register has in a list that is as long as it has to be.
fn set_at<T: Clone + Default>(list: &mut Vec<T>, offset: u32, value: T) {
    let Some(place) = place(offset) else { return };
    if list.len() <= place {
        list.resize(place + 1, T::default());
    }
    if let Some(entry) = list.get_mut(place) {
        *entry = value;
    }
}

/// The registers of a peripheral, which hold what is written; models add what else happens.
#[derive(Debug, Clone)]
pub(super) struct Registers {
    peripheral: String,
    /// By [`place`].
    facts: Vec<Option<&'static Facts>>,
    values: Vec<u32>,
}

/// Index of a register; none for an address that is not a word's.
fn place(offset: u32) -> Option<usize> {
    usize::try_from(offset / 4).ok().filter(|_| offset.is_multiple_of(4))
}

impl Registers {
    /// Those of a class, for a peripheral of this name, after a reset.
    pub(super) fn new(part: Part, class: &str, peripheral: &str) -> Self {
        let mine = TABLE.iter().filter(|facts| {
            facts.class == class && facts.family.is_none_or(|family| family == part.family())
        });
        let mut facts = Vec::new();
        for known in mine {
            set_at(&mut facts, known.offset, Some(known));
        }
        let mut registers = Self { peripheral: peripheral.to_owned(), facts, values: Vec::new() };
        registers.reset();
        registers
    }

    pub(super) fn reset(&mut self) {
        self.values = self.facts.iter().map(|facts| facts.map_or(0, |facts| facts.reset)).collect();
    }

    fn facts(&self, offset: u32) -> Option<&'static Facts> {
        place(offset).and_then(|place| *self.facts.get(place)?)
    }

    /// `PERIPHERAL_REGISTER`.
    pub(super) fn name(&self, offset: u32) -> String {
        match self.facts(offset) {
            Some(facts) => format!("{}_{}", self.peripheral, facts.name),
            None => format!("{} at {:#05x}", self.peripheral, offset % BLOCK_BYTES),
        }
    }

    /// What a register holds; 0 where there is none.
    pub(super) fn get(&self, offset: u32) -> u32 {
        place(offset).and_then(|place| self.values.get(place)).copied().unwrap_or(0)
    }

    /// Bits of a register, shifted down.
    pub(super) fn bits(&self, offset: u32, first: u32, width: u32) -> u32 {
        self.get(offset) >> first & ((1u32 << width) - 1)
    }

    /// Whether a bit is set.
    pub(super) fn has(&self, offset: u32, bit: u32) -> bool {
        self.get(offset) >> bit & 1 == 1
    }

    /// Sets a register by hardware.
    pub(super) fn set(&mut self, offset: u32, value: u32) {
        set_at(&mut self.values, offset, value);
    }

    /// Sets or clears a bit by hardware.
    pub(super) fn set_bit(&mut self, offset: u32, bit: u32, value: bool) {
        let others = self.get(offset) & !(1 << bit);
        self.set(offset, others | u32::from(value) << bit);
    }

    /// A program's read.
    pub(super) fn read(&self, offset: u32, access: &mut Access<'_>) -> u32 {
        if self.facts(offset).is_none() {
            access.violates(format!("{} is read, which is no register", self.name(offset)));
        }
        self.get(offset)
    }

    /// A program's write. Bits that a register does not have are a violation when they change.
    pub(super) fn write(&mut self, offset: u32, value: u32, access: &mut Access<'_>) {
        let Some(facts) = self.facts(offset) else {
            access.violates(format!("{} is written, which is no register", self.name(offset)));
            return;
        };
        let reserved = (value ^ facts.reset) & !facts.mask;
        if reserved != 0 {
            access.violates(format!(
                "{} gets {value:#010x}: bits {reserved:#010x} are reserved",
                self.name(offset)
            ));
        }
        let kept = facts.reset & !facts.mask;
        self.set(offset, value & facts.mask | kept);
    }
}

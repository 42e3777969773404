//! Registers as words with names: which bits they have, and what they are after a reset.

use std::collections::BTreeMap;
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

/// The registers of a peripheral, which hold what is written; models add what else happens.
#[derive(Debug, Clone)]
pub(super) struct Registers {
    peripheral: String,
    facts: BTreeMap<u32, &'static Facts>,
    values: BTreeMap<u32, u32>,
}

impl Registers {
    /// Those of a class, for a peripheral of this name, after a reset.
    pub(super) fn new(part: Part, class: &str, peripheral: &str) -> Self {
        let mine = TABLE.iter().filter(|facts| {
            facts.class == class && facts.family.is_none_or(|family| family == part.family())
        });
        let facts = mine.map(|facts| (facts.offset, facts)).collect();
        let mut registers = Self { peripheral: peripheral.to_owned(), facts, values: BTreeMap::new() };
        registers.reset();
        registers
    }

    pub(super) fn reset(&mut self) {
        self.values = self.facts.iter().map(|(offset, facts)| (*offset, facts.reset)).collect();
    }

    /// `PERIPHERAL_REGISTER`.
    pub(super) fn name(&self, offset: u32) -> String {
        match self.facts.get(&offset) {
            Some(facts) => format!("{}_{}", self.peripheral, facts.name),
            None => format!("{} at {:#05x}", self.peripheral, offset % BLOCK_BYTES),
        }
    }

    /// What a register holds; 0 where there is none.
    pub(super) fn get(&self, offset: u32) -> u32 {
        self.values.get(&offset).copied().unwrap_or(0)
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
        self.values.insert(offset, value);
    }

    /// Sets or clears a bit by hardware.
    pub(super) fn set_bit(&mut self, offset: u32, bit: u32, value: bool) {
        let others = self.get(offset) & !(1 << bit);
        self.set(offset, others | u32::from(value) << bit);
    }

    /// A program's read.
    pub(super) fn read(&self, offset: u32, access: &mut Access<'_>) -> u32 {
        if !self.facts.contains_key(&offset) {
            access.violates(format!("{} is read, which is no register", self.name(offset)));
        }
        self.get(offset)
    }

    /// A program's write. Bits that a register does not have are a violation when they change.
    pub(super) fn write(&mut self, offset: u32, value: u32, access: &mut Access<'_>) {
        let Some(facts) = self.facts.get(&offset) else {
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

//! Named registers, with their existing bits and reset values.

use std::sync::LazyLock;

use super::ChipModel;
use super::violation::Access;

/// All registers.
static TABLE: LazyLock<Vec<Facts>> =
    LazyLock::new(|| include_str!("registers.txt").lines().filter_map(Facts::read).collect());
/// Size of a peripheral's address range.
const BLOCK_BYTES: u32 = 0x400;

/// Description of a register.
#[derive(Debug)]
struct Facts {
    /// Class of its peripheral.
    class: &'static str,
    name: &'static str,
    offset: u32,
    /// Existing bits.
    mask: u32,
    reset: u32,
    /// Chip with this description; `None`: all chips.
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

/// Sets the entry of a register in a list, which grows if needed.
fn set_at<T: Clone + Default>(list: &mut Vec<T>, offset: u32, value: T) {
    let Some(place) = place(offset) else { return };
    if list.len() <= place {
        list.resize(place + 1, T::default());
    }
    if let Some(entry) = list.get_mut(place) {
        *entry = value;
    }
}

/// Registers of a peripheral. They store written values; the models add side effects.
#[derive(Debug, Clone)]
pub(super) struct Registers {
    peripheral: String,
    /// Indexed by [`place`].
    facts: Vec<Option<&'static Facts>>,
    values: Vec<u32>,
}

/// Index of a register; `None` for an unaligned offset.
fn place(offset: u32) -> Option<usize> {
    usize::try_from(offset / 4).ok().filter(|_| offset.is_multiple_of(4))
}

impl Registers {
    /// Returns the registers of a class with their reset values, for a peripheral with this name.
    pub(super) fn new(part: ChipModel, class: &str, peripheral: &str) -> Self {
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

    /// Value of a register; 0 if the register does not exist.
    pub(super) fn get(&self, offset: u32) -> u32 {
        place(offset).and_then(|place| self.values.get(place)).copied().unwrap_or(0)
    }

    /// Value of a bit field.
    pub(super) fn bits(&self, offset: u32, first: u32, width: u32) -> u32 {
        self.get(offset) >> first & ((1u32 << width) - 1)
    }

    /// Whether a bit is set.
    pub(super) fn has(&self, offset: u32, bit: u32) -> bool {
        self.get(offset) >> bit & 1 == 1
    }

    /// Sets a register as the hardware does.
    pub(super) fn set(&mut self, offset: u32, value: u32) {
        set_at(&mut self.values, offset, value);
    }

    /// Sets or clears a bit as the hardware does.
    pub(super) fn set_bit(&mut self, offset: u32, bit: u32, value: bool) {
        let others = self.get(offset) & !(1 << bit);
        self.set(offset, others | u32::from(value) << bit);
    }

    /// Read by the program.
    pub(super) fn read(&self, offset: u32, access: &mut Access<'_>) -> u32 {
        if self.facts(offset).is_none() {
            access.violates(format!("read of {}: no such register", self.name(offset)));
        }
        self.get(offset)
    }

    /// Write by the program. A change of reserved bits is a violation.
    pub(super) fn write(&mut self, offset: u32, value: u32, access: &mut Access<'_>) {
        let Some(facts) = self.facts(offset) else {
            access.violates(format!("write to {}: no such register", self.name(offset)));
            return;
        };
        let reserved = (value ^ facts.reset) & !facts.mask;
        if reserved != 0 {
            access.violates(format!(
                "{} is set to {value:#010x}: bits {reserved:#010x} are reserved",
                self.name(offset)
            ));
        }
        let kept = facts.reset & !facts.mask;
        self.set(offset, value & facts.mask | kept);
    }
}

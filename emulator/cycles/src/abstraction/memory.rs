//! Memory of partially known words.

mod part;
mod settle;

use std::rc::Rc;

use super::symbol::Slot;
use super::{Abstract, Word};
use crate::instruction::Width;
use crate::state::{AccessError, Memory};
use crate::timing::Access;
use crate::values::Values;

/// Words of a page, the unit that is copied when a path changes a word.
const PAGE_WORDS: usize = 32;
/// Maximum number of possible locations of one access.
const MAX_PLACES: u64 = 16_384;

/// Four bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Cell {
    Whole(Word),
    Parts(Rc<[Slot; 4]>),
}

pub(super) type Page = [Cell; PAGE_WORDS];

/// A piece of memory with its initial contents.
#[derive(Debug, Clone)]
pub(crate) struct Region {
    /// Address of the first byte, divisible by 4.
    pub(crate) address: u32,
    /// Contents.
    pub(crate) bytes: Rc<Vec<u8>>,
}

/// A region that the program writes to.
#[derive(Debug, Clone)]
pub(super) struct Pages {
    pub(super) address: u32,
    pub(super) bytes: u32,
    pub(super) pages: Vec<Rc<Page>>,
}

/// All memory that a program can read and write. Cheap to clone: unchanged pages are shared.
#[derive(Debug, Clone)]
pub(crate) struct AbstractMemory {
    fixed: Rc<Vec<Region>>,
    pub(super) regions: Rc<Vec<Pages>>,
    /// Start of the first access since this was last cleared.
    pub(crate) first_access: Option<Access>,
}

/// Bytes of an access of this width.
fn bytes(width: Width) -> u8 {
    match width {
        Width::Byte => 1,
        Width::Half => 2,
        Width::Word => 4,
    }
}

impl AbstractMemory {
    /// Constant memory, and writable memory with its initial contents.
    pub(crate) fn new(fixed: Vec<Region>, written: &[Region]) -> Self {
        let pages = |region: &Region| {
            let words: Vec<u32> = region
                .bytes
                .chunks(4)
                .map(|bytes| {
                    (0..).zip(bytes).fold(0, |word, (place, byte)| word | u32::from(*byte) << (8 * place))
                })
                .collect();
            let pages = words.chunks(PAGE_WORDS).map(|words| {
                let word = |place| Word::constant(words.get(place).copied().unwrap_or(0));
                Rc::new(std::array::from_fn(|place| Cell::Whole(word(place))))
            });
            let bytes = u32::try_from(region.bytes.len()).unwrap_or(u32::MAX);
            Pages { address: region.address, bytes, pages: pages.collect() }
        };
        Self {
            fixed: Rc::new(fixed),
            regions: Rc::new(written.iter().map(pages).collect()),
            first_access: None,
        }
    }

    /// Every writable word: address and contents, read as a word.
    pub(crate) fn words(&self, domain: &mut Abstract) -> Vec<(u32, Word)> {
        let mut words = Vec::new();
        for region in self.regions.iter() {
            let cells = region.pages.iter().flat_map(|page| page.iter());
            for (address, cell) in
                (region.address..region.address.saturating_add(region.bytes)).step_by(4).zip(cells)
            {
                words.push((address, domain.whole(cell)));
            }
        }
        words
    }

    fn cell(&self, address: u32) -> Option<&Cell> {
        let region =
            self.regions.iter().find(|region| is_within(region.address, region.bytes, address, 1))?;
        let word = usize::try_from((address - region.address) / 4).ok()?;
        region.pages.get(word / PAGE_WORDS)?.get(word % PAGE_WORDS)
    }

    fn cell_mut(&mut self, address: u32) -> Option<&mut Cell> {
        let place =
            self.regions.iter().position(|region| is_within(region.address, region.bytes, address, 1))?;
        let region = Rc::make_mut(&mut self.regions).get_mut(place)?;
        let word = usize::try_from((address - region.address) / 4).ok()?;
        Rc::make_mut(region.pages.get_mut(word / PAGE_WORDS)?).get_mut(word % PAGE_WORDS)
    }

    /// A byte of writable memory.
    fn slot(&self, address: u32) -> Option<Slot> {
        let byte = u8::try_from(address % 4).unwrap_or(0);
        Some(match self.cell(address)? {
            Cell::Whole(word) => Slot { word: *word, byte },
            Cell::Parts(slots) => *slots.get(usize::from(byte))?,
        })
    }

    fn fixed_bytes(&self, address: u32, bytes: u8) -> Option<&[u8]> {
        self.fixed.iter().find_map(|region| {
            let start = usize::try_from(address.checked_sub(region.address)?).ok()?;
            region.bytes.get(start..start.checked_add(usize::from(bytes))?)
        })
    }

    fn load_at(&mut self, domain: &mut Abstract, address: u32, bytes: u8) -> Result<Word, AccessError> {
        if let Some(bytes) = self.fixed_bytes(address, bytes) {
            let number = bytes.iter().rev().fold(0, |number, byte| number << 8 | u32::from(*byte));
            return Ok(Word::constant(number));
        }
        let unmapped = AccessError::Unmapped { address };
        if address.is_multiple_of(4)
            && bytes == 4
            && let Some(Cell::Whole(word)) = self.cell(address)
            && *word != Word::ANYTHING
        {
            return Ok(*word);
        }
        let mut slots = [Slot { word: Word::constant(0), byte: 0 }; 4];
        for (slot, place) in slots.iter_mut().take(usize::from(bytes)).zip(0..) {
            let address = address.checked_add(place).ok_or(unmapped)?;
            let mut found = self.slot(address).ok_or(unmapped)?;
            if found.word == Word::ANYTHING {
                // From here on, this is a separate value.
                let value = domain.unknown(Values::ALL);
                self.give_name(address, value);
                found = self.slot(address).ok_or(unmapped)?;
            }
            *slot = found;
        }
        Ok(domain.combine(&slots, bytes))
    }

    /// Assigns the symbol `value` to the unknown byte at `address`, or to its whole word if that is unknown
    /// too.
    fn give_name(&mut self, address: u32, value: Word) {
        match self.cell_mut(address) {
            Some(Cell::Whole(word)) => *word = value,
            Some(Cell::Parts(slots)) => {
                let place = usize::try_from(address % 4).unwrap_or(0);
                if let Some(slot) = Rc::make_mut(slots).get_mut(place) {
                    slot.word = value;
                }
            }
            None => {}
        }
    }

    /// Checks that `bytes` at `address` are writable.
    fn check_store(&self, address: u32, bytes: u8) -> Result<(), AccessError> {
        let is_writable = |region: &Pages| is_within(region.address, region.bytes, address, u32::from(bytes));
        if self.regions.iter().any(is_writable) {
            Ok(())
        } else if self.fixed_bytes(address, bytes).is_some() {
            Err(AccessError::ReadOnly { address })
        } else {
            Err(AccessError::Unmapped { address })
        }
    }

    fn store_at(&mut self, domain: &mut Abstract, address: u32, bytes: u8, value: Word) {
        if bytes == 4 && address.is_multiple_of(4) {
            if let Some(cell) = self.cell_mut(address) {
                *cell = Cell::Whole(value);
            }
            return;
        }
        // The stored value has only these bytes.
        let value = domain.part(value, 0, bytes);
        for byte in 0..bytes {
            let Some(cell) = self.cell_mut(address.wrapping_add(byte.into())) else { return };
            let mut slots = slots_of(cell);
            let place = usize::try_from(address.wrapping_add(byte.into()) % 4).unwrap_or(0);
            if let Some(slot) = slots.get_mut(place) {
                *slot = Slot { word: value, byte };
            }
            *cell = cell_of(slots);
        }
    }

    /// A store that may or may not change this location: it then holds the old value or `value`.
    fn store_perhaps(
        &mut self,
        domain: &mut Abstract,
        address: u32,
        bytes: u8,
        value: Word,
    ) -> Result<(), AccessError> {
        if bytes == 4
            && matches!(self.cell(address), Some(Cell::Whole(Word::ANYTHING)))
            && address.is_multiple_of(4)
        {
            return Ok(());
        }
        let before = self.load_at(domain, address, bytes)?;
        if before != value {
            let values = domain.values(before).union(&domain.values(value));
            let either = if values == Values::ALL { Word::ANYTHING } else { domain.unknown(values) };
            self.store_at(domain, address, bytes, either);
        }
        Ok(())
    }

    /// Whether one region contains all these addresses.
    fn holds_all(&self, places: &Values, bytes: u8) -> bool {
        let (low, length) = (places.low(), places.high() - places.low());
        let Some(length) = length.checked_add(bytes.into()) else { return false };
        let is_written =
            self.regions.iter().any(|region| is_within(region.address, region.bytes, low, length));
        is_written
            || self.fixed.iter().any(|region| {
                let bytes = u32::try_from(region.bytes.len()).unwrap_or(u32::MAX);
                is_within(region.address, bytes, low, length)
            })
    }
}

/// Whether a region contains `length` bytes from `address`.
fn is_within(start: u32, bytes: u32, address: u32, length: u32) -> bool {
    address.checked_sub(start).and_then(|from| from.checked_add(length)).is_some_and(|end| end <= bytes)
}

pub(super) fn slots_of(cell: &Cell) -> [Slot; 4] {
    match cell {
        Cell::Whole(word) => [0, 1, 2, 3].map(|byte| Slot { word: *word, byte }),
        Cell::Parts(slots) => **slots,
    }
}

pub(super) fn cell_of(slots: [Slot; 4]) -> Cell {
    let [first, ..] = slots;
    let is_whole = (0..).zip(slots).all(|(byte, slot)| slot == Slot { word: first.word, byte });
    if is_whole { Cell::Whole(first.word) } else { Cell::Parts(Rc::new(slots)) }
}

/// Addresses in the form of the timing model.
fn access(places: &Values) -> Access {
    let bits = places.low() | places.step();
    let alignment = if bits.is_multiple_of(4) { 4 } else { 2 - (bits % 2) as u8 };
    Access { min_address: places.low(), max_address: places.high(), alignment }
}

fn unknown(places: &Values) -> AccessError {
    AccessError::Unknown { lowest: places.low(), highest: places.high() }
}

impl Memory<Abstract> for AbstractMemory {
    fn load(&mut self, domain: &mut Abstract, address: Word, width: Width) -> Result<Word, AccessError> {
        let bytes = bytes(width);
        let places = domain.values(address);
        self.first_access = self.first_access.or(Some(access(&places)));
        if let Some(address) = places.single() {
            return self.load_at(domain, address, bytes);
        }
        if places.count() > MAX_PLACES {
            if !self.holds_all(&places, bytes) {
                return Err(unknown(&places));
            }
            let any = domain.unknown(Values::ALL);
            return Ok(domain.part(any, 0, bytes));
        }
        let mut all: Option<(Word, Values)> = None;
        for place in places.iter() {
            let word = self.load_at(domain, place, bytes).map_err(|_| unknown(&places))?;
            let values = domain.values(word);
            all = Some(match all {
                None => (word, values),
                Some((one, before)) if one == word => (one, before),
                Some((_, before)) => (Word::ANYTHING, before.union(&values)),
            });
        }
        Ok(match all {
            Some((Word::ANYTHING, values)) => domain.unknown(values),
            Some((word, _)) => word,
            None => domain.unknown(Values::ALL),
        })
    }

    fn store(
        &mut self,
        domain: &mut Abstract,
        address: Word,
        width: Width,
        value: Word,
    ) -> Result<(), AccessError> {
        let bytes = bytes(width);
        let places = domain.values(address);
        self.first_access = self.first_access.or(Some(access(&places)));
        if let Some(address) = places.single() {
            self.check_store(address, bytes)?;
            self.store_at(domain, address, bytes, value);
            return Ok(());
        }
        if places.count() > MAX_PLACES || places.iter().any(|place| self.check_store(place, bytes).is_err()) {
            return Err(unknown(&places));
        }
        let value = domain.part(value, 0, bytes);
        places.iter().try_for_each(|place| self.store_perhaps(domain, place, bytes, value))
    }
}

//! Data Base: all signals of a scheme, in slots of a fixed number.

pub(crate) mod checked_words;
pub(crate) mod data;
pub(crate) mod frame;
pub(crate) mod handle;
pub(crate) mod storage;

pub(crate) use checked_words::CheckedWords;
pub(crate) use data::{Data, Dof, Inputs, Outputs};
pub(crate) use frame::{Frame, FrameError};
pub(crate) use handle::{Input, Memory, Output, Signal};
pub(crate) use storage::{Block, List, Storage, StorageError};

use core::cell::Cell;

use crate::device::DeviceDescriptor;
use crate::limits::MAX_SLOTS;
use crate::online::Programs;
use crate::packet::LinkPort;
use crate::signal::{DataType, TypeRef};

/// A signal in the Data Base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entry {
    /// The signal.
    pub signal: TypeRef,
    /// Its type.
    pub data_type: &'static DataType,
}

/// Signals, module memories and link mailboxes, in [provided](crate::ControllerMemory) words and slots.
///
/// Memory is allocated and freed only when a module is created, deleted, plugged in or unplugged. A signal
/// exists as long as a port uses it.
#[derive(Debug)]
pub struct DataBase {
    entries: &'static mut [Option<Entry>],
    links: &'static mut [LinkPort],
    programs: Programs,
    revision: u32,
    is_limited: bool,
    storage: Storage,
}

impl DataBase {
    pub(crate) fn new(
        entries: &'static mut [Option<Entry>],
        links: &'static mut [LinkPort],
        programs: Programs,
        storage: Storage,
    ) -> Self {
        Self { entries, links, programs, revision: 0, is_limited: false, storage }
    }

    /// Frees all slots.
    pub(crate) fn clear(&mut self) {
        self.storage.clear();
        self.entries.fill(None);
        self.links.fill_with(LinkPort::new);
        self.revision = self.revision.wrapping_add(1);
    }

    /// Resets programs and revision.
    pub(crate) fn forget(&mut self) {
        self.programs.clear();
        self.revision = 0;
        self.is_limited = false;
    }

    /// Returns every signal with its slot.
    pub fn signals(&self) -> impl Iterator<Item = (u8, Entry)> + Clone + '_ {
        (0..).zip(self.entries.iter()).filter_map(|(slot, entry)| entry.map(|entry| (slot, entry)))
    }

    /// Returns the slot of a signal, if it exists.
    #[must_use]
    #[inline(never)]
    pub fn slot(&self, signal: TypeRef) -> Option<u8> {
        self.signals().find(|(_, entry)| entry.signal == signal).map(|(slot, _)| slot)
    }

    /// Returns the words of a slot; empty for a free slot.
    #[must_use]
    pub fn words(&self, slot: u8) -> &[u32] {
        self.storage.words(self.storage.block(slot)).unwrap_or_default()
    }

    pub(crate) fn overwrite(&mut self, slot: u8, words: impl IntoIterator<Item = u32>) {
        let block = self.storage.block(slot);
        for (target, word) in self.storage.words_mut(block).into_iter().flatten().zip(words) {
            *target = word;
        }
    }

    /// Returns the words of every signal, in the order of [`signals`](Self::signals).
    pub fn all_words(&self) -> impl Iterator<Item = u32> + '_ {
        self.signals().flat_map(|(slot, _)| self.words(slot).iter().copied())
    }

    /// Returns a counter that increases whenever signals are added or removed, which may move words.
    #[must_use]
    pub fn revision(&self) -> u32 {
        self.revision
    }

    /// Returns the number of free words.
    #[must_use]
    pub fn free_words(&self) -> usize {
        self.storage.free_words()
    }

    /// Returns the number of used slots, by signals and memories.
    #[must_use]
    pub fn used_slots(&self) -> usize {
        self.storage.used_slots()
    }

    pub(crate) fn storage(&self) -> &Storage {
        &self.storage
    }

    pub(crate) fn storage_mut(&mut self) -> &mut Storage {
        &mut self.storage
    }

    pub(crate) fn programs(&self) -> &Programs {
        &self.programs
    }

    pub(crate) fn programs_mut(&mut self) -> &mut Programs {
        &mut self.programs
    }

    pub(crate) fn links(&self) -> &[LinkPort] {
        self.links
    }

    /// Returns the slot of a signal; creates the signal if it does not exist.
    pub(crate) fn insert(
        &mut self,
        data_type: &'static DataType,
        signal: TypeRef,
        dof: usize,
    ) -> Result<u8, StorageError> {
        if let Some(slot) = self.slot(signal) {
            return Ok(slot);
        }
        let slot = self.take(data_type.shape.words(dof))?;
        if let Some(entry) = self.entries.get_mut(usize::from(slot)) {
            *entry = Some(Entry { signal, data_type });
        }
        Ok(slot)
    }

    /// Allocates memory without a name.
    pub(crate) fn take(&mut self, words: usize) -> Result<u8, StorageError> {
        let slot = self.storage.take(words)?;
        self.revision = self.revision.wrapping_add(1);
        Ok(slot)
    }

    /// Frees every slot that is not in `used` (one bit each); returns whether any was freed.
    pub(crate) fn keep_only(&mut self, used: u64) -> bool {
        let revision = self.revision;
        let slots = u8::try_from(self.entries.len()).unwrap_or(u8::MAX);
        for slot in (0..slots).filter(|slot| used & bit(*slot) == 0) {
            if self.storage.is_taken(slot) {
                self.storage.give_back(slot);
                self.revision = self.revision.wrapping_add(1);
            }
            if let Some(entry) = self.entries.get_mut(usize::from(slot)) {
                *entry = None;
            }
        }
        revision != self.revision
    }

    /// Returns the signal in a slot; none for a free slot or a memory.
    pub fn entry(&self, slot: u8) -> Option<&Entry> {
        self.entries.get(usize::from(slot))?.as_ref()
    }

    /// Zeroes the words of signals and memories, but not the modules' configuration and state.
    pub(crate) fn zero_signals(&mut self) {
        self.storage.zero_blocks();
    }

    /// Returns the words of a module's configuration or state.
    pub(crate) fn own(&mut self, block: Block) -> &[Cell<u32>] {
        Cell::from_mut(self.storage.words_mut(block).unwrap_or_default()).as_slice_of_cells()
    }

    /// Sets whether the device got less than the scheme commanded in the last tick.
    pub(crate) fn set_limited(&mut self, is_limited: bool) {
        self.is_limited = is_limited;
    }

    /// Returns the view of the Data Base for the modules in a tick.
    pub(crate) fn view<'a>(&'a mut self, device: &'a DeviceDescriptor, dof: Dof) -> Data<'a> {
        let words = Cell::from_mut(&mut *self.storage.words).as_slice_of_cells();
        Data::new(words, self.links, &self.programs, device, dof, self.is_limited)
    }
}

/// Returns a slot as one of 64 bits.
pub(crate) fn bit(slot: u8) -> u64 {
    const { assert!(MAX_SLOTS <= 64, "a set of slots is 64 bits") };
    1_u64.checked_shl(u32::from(slot)).unwrap_or(0)
}

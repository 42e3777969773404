//! Memory for the stack analysis: saved registers and constants.

use std::collections::BTreeMap;

use super::origin::{Origins, Word};
use crate::image::Image;
use crate::instruction::Width;
use crate::state::{AccessError, Memory};

const WORD_BYTES: i32 = 4;

/// Words saved on the stack, by their distance from the stack pointer at the function's start. A write
/// through an unknown pointer does not change them: a program that overwrites its saved registers is already
/// broken.
#[derive(Debug, Clone)]
pub(super) struct Slots<'a> {
    pub(super) image: &'a Image,
    pub(super) saved: BTreeMap<i32, Word>,
}

impl Slots<'_> {
    /// Keeps the entries that are equal in both. Returns whether this one changed.
    pub(super) fn join(&mut self, other: &Self) -> bool {
        let before = self.saved.len();
        self.saved.retain(|place, word| other.saved.get(place) == Some(word));
        self.saved.len() != before
    }

    /// A constant word, in memory that no program changes.
    fn constant(&self, address: u32) -> Option<u32> {
        let is_constant = |address| {
            let holds = |start: u32, length: usize| {
                address >= start && usize::try_from(address - start).is_ok_and(|offset| offset < length)
            };
            self.image
                .segments
                .iter()
                .any(|segment| !segment.is_writable && holds(segment.address, segment.bytes.len()))
        };
        let bytes = self.image.bytes(address, 4)?.first_chunk()?;
        is_constant(address).then(|| u32::from_le_bytes(*bytes))
    }
}

impl Memory<Origins> for Slots<'_> {
    fn load(&mut self, _: &mut Origins, address: Word, width: Width) -> Result<Word, AccessError> {
        let word = match address {
            Word::Stack(place) if width == Width::Word => self.saved.get(&place).copied(),
            Word::Constant(address) if width == Width::Word => self.constant(address).map(Word::Constant),
            _ => None,
        };
        Ok(word.unwrap_or(Word::Unknown))
    }

    fn store(
        &mut self,
        _: &mut Origins,
        address: Word,
        width: Width,
        value: Word,
    ) -> Result<(), AccessError> {
        if let Word::Stack(place) = address {
            // Other values may change through pointers, and the analysis does not need them.
            if let (Word::Entry(_), Width::Word) = (value, width) {
                self.saved.insert(place, value);
            } else {
                let end = place
                    + match width {
                        Width::Byte => 1,
                        Width::Half => 2,
                        Width::Word => WORD_BYTES,
                    };
                self.saved.retain(|kept, _| kept + WORD_BYTES <= place || *kept >= end);
            }
        }
        Ok(())
    }
}

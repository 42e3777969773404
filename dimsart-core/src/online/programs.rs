//! Storage of programs, including the one being uploaded.

use serde::{Deserialize, Serialize};

use super::program::{Header, Program, Section};
use super::verify::ProgramError;
use crate::limits::PROGRAM_WORDS;

/// State of a program slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LawReport {
    /// Words of the program; 0 for an empty slot.
    pub words: u8,
    /// Whether a module of the running or pending scheme uses it, plugged in or not.
    pub is_used: bool,
    /// Cycles that it adds to a tick of this device; none if unknown.
    pub cycles: Option<u32>,
}

/// Reason why a program command was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LawRefusal {
    /// The uploaded words are not a valid program.
    Program(ProgramError),
    /// A module uses the stored program.
    InUse,
    /// Program number out of range.
    UnknownNumber,
}

impl core::fmt::Display for LawRefusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Program(error) => write!(f, "invalid law: {error}"),
            Self::InUse => write!(
                f,
                "a module uses the law with this number: choose another number, or `close` the module first"
            ),
            Self::UnknownNumber => {
                write!(f, "law number out of range: use a smaller number, at least 1")
            }
        }
    }
}

impl core::error::Error for LawRefusal {}

/// A program slot.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ProgramSlot {
    words: [u32; PROGRAM_WORDS],
    /// Number of words in use; 0 for an empty slot.
    count: u8,
    header: Header,
}

impl ProgramSlot {
    /// An empty slot, all zero bits.
    pub(crate) const EMPTY: Self = Self { words: [0; PROGRAM_WORDS], count: 0, header: Header::NONE };
}

/// Parts of a program that a tick needs.
#[derive(Debug, Clone, Copy)]
pub struct Code<'a> {
    /// Constants, as bits.
    pub constants: &'a [u32],
    /// Instructions that run once for all axes.
    pub once: &'a [u32],
    /// Instructions of the requested section.
    pub section: &'a [u32],
    /// Number of parameters.
    pub parameters: u8,
    /// Number of states.
    pub states: u8,
    /// Whether the program computes all axes in one go.
    pub is_coupled: bool,
}

/// All programs of a controller and the one being uploaded.
#[derive(Debug)]
pub struct Programs {
    /// The first slot is the upload buffer; the others are numbered from 1.
    places: &'static mut [ProgramSlot],
}

impl Programs {
    pub(crate) fn new(places: &'static mut [ProgramSlot]) -> Self {
        Self { places }
    }

    /// Returns the maximum number of programs.
    #[must_use]
    pub fn capacity(&self) -> usize {
        self.places.len().saturating_sub(1)
    }

    #[inline(always)]
    fn place(&self, number: u32) -> Option<&ProgramSlot> {
        self.places.get(usize::try_from(number).ok()?).filter(|_| number != 0)
    }

    fn place_mut(&mut self, number: u8) -> Option<&mut ProgramSlot> {
        self.places.get_mut(usize::from(number)).filter(|_| number != 0)
    }

    /// Returns the program of this number, from 1.
    #[must_use]
    #[inline(always)]
    pub fn get(&self, number: u32) -> Option<Program<'_>> {
        let place = self.place(number)?;
        let words = place.words.get(..usize::from(place.count)).filter(|words| !words.is_empty())?;
        Some(Program::trusted(words, place.header))
    }

    /// Returns what a tick needs of a program: its constants and the instructions of a section.
    #[must_use]
    #[inline(always)]
    pub fn code(&self, number: u32, section: Section) -> Option<Code<'_>> {
        let place = self.place(number)?;
        let words = place.words.get(..usize::from(place.count)).filter(|words| !words.is_empty())?;
        let (header, part) = (&place.header, |range| words.get(range).unwrap_or_default());
        Some(Code {
            constants: part(header.constants_range()),
            once: part(header.instructions(Section::Once)),
            section: part(header.instructions(section)),
            parameters: header.parameters,
            states: header.states,
            is_coupled: header.is_coupled,
        })
    }

    /// Returns every stored program with its number.
    pub(crate) fn all(&self) -> impl Iterator<Item = (u8, Program<'_>)> {
        let numbers = (0..).zip(self.places.iter());
        numbers.filter_map(|(number, _)| Some((number, self.get(number.into())?)))
    }

    /// Writes uploaded words; words beyond the maximum are dropped.
    pub(crate) fn put(&mut self, place: u8, words: [u32; 2]) {
        let next = self.places.first_mut().map_or(&mut [][..], |next| &mut next.words);
        for (target, word) in next.iter_mut().skip(place.into()).zip(words) {
            *target = word;
        }
    }

    /// Verifies and stores the uploaded program. Nothing changes if the slot is in use with different words
    /// or the program is invalid.
    pub(crate) fn keep(&mut self, number: u8, count: u8, is_used: bool) -> Result<(), LawRefusal> {
        let words = self.places.first().and_then(|next| next.words.get(..usize::from(count)));
        let words = words.ok_or(LawRefusal::Program(ProgramError::Size))?;
        let header = Program::verify(words).map_err(LawRefusal::Program)?.header();
        if self.get(number.into()).is_some_and(|there| there.words() == words) {
            return Ok(());
        }
        if is_used {
            return Err(LawRefusal::InUse);
        }
        let (next, places) = self.places.split_first_mut().ok_or(LawRefusal::UnknownNumber)?;
        let place = usize::from(number).checked_sub(1).and_then(|place| places.get_mut(place));
        let place = place.ok_or(LawRefusal::UnknownNumber)?;
        place.words = next.words;
        (place.count, place.header) = (count, header);
        Ok(())
    }

    /// Empties all slots.
    pub(crate) fn clear(&mut self) {
        self.places.fill(ProgramSlot::EMPTY);
    }

    /// Empties a slot.
    pub(crate) fn remove(&mut self, number: u8) {
        if let Some(place) = self.place_mut(number) {
            place.count = 0;
        }
    }
}

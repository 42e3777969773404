//! The programs that a controller has, and the next one while it comes in.

use serde::{Deserialize, Serialize};

use super::program::{Header, Program, Section};
use super::verify::ProgramError;
use crate::limits::PROGRAM_WORDS;

/// How a place for a program stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LawReport {
    /// Words of the program; 0 for none.
    pub words: u8,
    /// Whether a module has it, plugged in or not, in the scheme that runs or the next one.
    pub is_used: bool,
    /// What it adds to a tick of this device, cycles; none if that is not known.
    pub cycles: Option<u32>,
}

/// Why nothing was done about a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LawRefusal {
    /// What was put is no program.
    Program(ProgramError),
    /// A module has the program that is there.
    InUse,
    /// The controller has no place of this number.
    NoSuchNumber,
}

impl core::fmt::Display for LawRefusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Program(error) => write!(f, "the law was refused: {error}"),
            Self::InUse => write!(
                f,
                "a module has the law of this number: upload this one to another number, or `close` the module first"
            ),
            Self::NoSuchNumber => {
                write!(f, "the controller has no place for a law of this number: use a smaller one, from 1")
            }
        }
    }
}

impl core::error::Error for LawRefusal {}

/// A place for a program.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ProgramSlot {
    words: [u32; PROGRAM_WORDS],
    /// Of these are the program's; 0 for none.
    count: u8,
    header: Header,
}

impl ProgramSlot {
    /// All zero bits.
    pub(crate) const EMPTY: Self = Self { words: [0; PROGRAM_WORDS], count: 0, header: Header::NONE };
}

/// What a tick needs of a program.
#[derive(Debug, Clone, Copy)]
pub struct Code<'a> {
    /// Bits of its constants.
    pub constants: &'a [u32],
    /// Instructions that run once for all axes.
    pub once: &'a [u32],
    /// Instructions of the section.
    pub section: &'a [u32],
    /// Number of parameters.
    pub parameters: u8,
    /// Number of states.
    pub states: u8,
    /// Whether an axis uses values of another one.
    pub is_coupled: bool,
}

/// All programs of a controller, and the words of the next one.
#[derive(Debug)]
pub struct Programs {
    /// The first one is that of the next program; the others are numbered from 1.
    places: &'static mut [ProgramSlot],
}

impl Programs {
    pub(crate) fn new(places: &'static mut [ProgramSlot]) -> Self {
        Self { places }
    }

    /// How many there can be.
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

    /// The program of this number, from 1.
    #[must_use]
    #[inline(always)]
    pub fn get(&self, number: u32) -> Option<Program<'_>> {
        let place = self.place(number)?;
        let words = place.words.get(..usize::from(place.count)).filter(|words| !words.is_empty())?;
        Some(Program::trusted(words, place.header))
    }

    /// What a tick needs of the program of this number: the instructions of a section, with what is before them.
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

    /// Every program that there is, with its number.
    pub(crate) fn all(&self) -> impl Iterator<Item = (u8, Program<'_>)> {
        let numbers = (0..).zip(self.places.iter());
        numbers.filter_map(|(number, _)| Some((number, self.get(number.into())?)))
    }

    /// Puts words of the next program; those beyond the last one are dropped.
    pub(crate) fn put(&mut self, place: u8, words: [u32; 2]) {
        let next = self.places.first_mut().map_or(&mut [][..], |next| &mut next.words);
        for (target, word) in next.iter_mut().skip(place.into()).zip(words) {
            *target = word;
        }
    }

    /// Keeps what was put. Where another program is in use, or these words are none, nothing changes.
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
        let (next, places) = self.places.split_first_mut().ok_or(LawRefusal::NoSuchNumber)?;
        let place = usize::from(number).checked_sub(1).and_then(|place| places.get_mut(place));
        let place = place.ok_or(LawRefusal::NoSuchNumber)?;
        place.words = next.words;
        (place.count, place.header) = (count, header);
        Ok(())
    }

    /// Empties every place.
    pub(crate) fn clear(&mut self) {
        self.places.fill(ProgramSlot::EMPTY);
    }

    /// Empties a place.
    pub(crate) fn remove(&mut self, number: u8) {
        if let Some(place) = self.place_mut(number) {
            place.count = 0;
        }
    }
}

//! The format of a program.
//!
//! ```text
//! word  bits 0 to 7     8 to 15        16 to 23       24 to 31
//!    0  version, 2      inputs         outputs        parameters
//!    1  states          constants      axes           1 if it computes all axes in one go
//!    2  instructions:   once           to begin       of a tick, then bytes of text
//! ```
//! Behind these: of each input and output its signal (type in 16 bits, number in 8); of each parameter its unit and the
//! `f32` words of its smallest, largest and default value; constants, `f32`; the [instructions](super::Instruction);
//! names as text, those of the law, its inputs, outputs and parameters, a line each, filled up with zeros; a CRC-32
//! (AUTOSAR's) of all that as little-endian bytes.
//!
//! The instructions `once` run before the others, once for all axes. Those `to begin` run once for each axis before the
//! law's first tick, those `of a tick` once for each axis in each tick. They find the axis' parameters in the first
//! registers, and in those behind them what is remembered of it. A law that computes all axes in one go runs them once, with
//! those of axis 0, and its device has just so many axes; for any other one `axes` are the fewest that it needs.

use core::ops::Range;

use super::PROGRAM_VERSION;
use super::instruction::{Instruction, Opcode};
use crate::packet::CRC;
use crate::signal::{TypeRef, Unit};

/// Most inputs of a program.
pub const MAX_INPUTS: usize = 6;
/// Most outputs of a program.
pub const MAX_OUTPUTS: usize = 4;
/// Most parameters of a program.
pub const MAX_PARAMETERS: usize = 8;
/// Numbers of the parameters that a program can have.
pub(crate) const PARAMETERS: [u8; MAX_PARAMETERS] = [0, 1, 2, 3, 4, 5, 6, 7];
/// Most that a program remembers of an axis.
pub const MAX_STATES: usize = 8;

/// Words in front of the ports.
const HEADER_WORDS: u16 = 3;
const PARAMETER_WORDS: u16 = 4;

/// How much there is of everything in a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Header {
    /// Signals that are read.
    pub inputs: u8,
    /// Signals that are written.
    pub outputs: u8,
    /// Parameters.
    pub parameters: u8,
    /// Numbers that are remembered of each axis.
    pub states: u8,
    /// Constants.
    pub constants: u8,
    /// The fewest axes that it needs, or just as many if it computes all of them in one go.
    pub axes: u8,
    /// Whether it computes all axes in one go.
    pub is_coupled: bool,
    /// Instructions that run once for all axes.
    pub once: u8,
    /// Instructions to begin.
    pub begin: u8,
    /// Instructions of a tick.
    pub tick: u8,
    /// Bytes of text.
    pub text_bytes: u8,
}

/// A part of a program's instructions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Section {
    /// Before the others, once for all axes.
    Once,
    /// Before the law's first tick.
    Begin,
    /// In each tick.
    Tick,
}

impl Header {
    /// Of no program.
    pub(super) const NONE: Self = Self {
        inputs: 0,
        outputs: 0,
        parameters: 0,
        states: 0,
        constants: 0,
        axes: 0,
        is_coupled: false,
        once: 0,
        begin: 0,
        tick: 0,
        text_bytes: 0,
    };

    /// Its words.
    #[must_use]
    pub fn to_words(self) -> [u32; 3] {
        let Self { inputs, outputs, parameters, states, constants, axes, is_coupled, .. } = self;
        [
            [PROGRAM_VERSION, inputs, outputs, parameters],
            [states, constants, axes, u8::from(is_coupled)],
            [self.once, self.begin, self.tick, self.text_bytes],
        ]
        .map(u32::from_le_bytes)
    }

    /// Of a program's first words, whatever they are; none if there are not so many.
    #[inline(always)]
    pub(super) fn of(words: &[u32]) -> Option<Self> {
        let [_, inputs, outputs, parameters] = words.first()?.to_le_bytes();
        let [states, constants, axes, is_coupled] = words.get(1)?.to_le_bytes();
        let [once, begin, tick, text_bytes] = words.get(2)?.to_le_bytes();
        let is_coupled = is_coupled != 0;
        Some(Self {
            inputs,
            outputs,
            parameters,
            states,
            constants,
            axes,
            is_coupled,
            once,
            begin,
            tick,
            text_bytes,
        })
    }

    #[inline(always)]
    fn ports_end(&self) -> u16 {
        HEADER_WORDS + u16::from(self.inputs) + u16::from(self.outputs)
    }

    #[inline(always)]
    fn constants_start(&self) -> u16 {
        self.ports_end() + PARAMETER_WORDS * u16::from(self.parameters)
    }

    #[inline(always)]
    fn instructions_start(&self) -> u16 {
        self.constants_start() + u16::from(self.constants)
    }

    fn text_start(&self) -> u16 {
        self.instructions_start() + u16::from(self.once) + u16::from(self.begin) + u16::from(self.tick)
    }

    /// Words of the whole program.
    #[must_use]
    pub fn words(&self) -> usize {
        usize::from(self.text_start() + u16::from(self.text_bytes).div_ceil(4) + 1)
    }

    #[inline(always)]
    pub(super) fn constants_range(&self) -> Range<usize> {
        self.constants_start().into()..self.instructions_start().into()
    }

    #[inline(always)]
    pub(super) fn instructions(&self, section: Section) -> Range<usize> {
        let start = self.instructions_start();
        let (start, count) = match section {
            Section::Once => (start, self.once),
            Section::Begin => (start + u16::from(self.once), self.begin),
            Section::Tick => (start + u16::from(self.once) + u16::from(self.begin), self.tick),
        };
        usize::from(start)..usize::from(start + u16::from(count))
    }
}

/// A parameter of a program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LawParameter {
    /// Physical unit.
    pub unit: Unit,
    /// Smallest value.
    pub min: f32,
    /// Largest value.
    pub max: f32,
    /// Value unless a command sets another one.
    pub default: f32,
}

impl LawParameter {
    /// Its words.
    #[must_use]
    pub fn to_words(self) -> [u32; 4] {
        let mut unit = [0; 1];
        // Units are few: one byte.
        let _ = postcard::to_slice(&self.unit, &mut unit);
        [unit[0].into(), self.min.to_bits(), self.max.to_bits(), self.default.to_bits()]
    }
}

/// A program that was verified.
#[derive(Debug, Clone, Copy)]
pub struct Program<'a> {
    words: &'a [u32],
    header: Header,
}

impl<'a> Program<'a> {
    /// Of words that were verified when they were taken.
    #[inline(always)]
    pub(super) fn trusted(words: &'a [u32], header: Header) -> Self {
        Self { words, header }
    }

    /// Of words that are being verified.
    pub(super) fn unverified(words: &'a [u32], header: Header) -> Self {
        Self { words, header }
    }

    /// How much there is of everything.
    #[inline(always)]
    #[must_use]
    pub fn header(&self) -> Header {
        self.header
    }

    /// All of it.
    #[must_use]
    pub fn words(&self) -> &'a [u32] {
        self.words
    }

    /// The signals that are read, and behind them those that are written.
    pub fn ports(&self) -> impl Iterator<Item = TypeRef> + 'a {
        let range = usize::from(HEADER_WORDS)..self.header.ports_end().into();
        self.words.get(range).unwrap_or_default().iter().map(|word| {
            let [id, id_high, number, _] = word.to_le_bytes();
            TypeRef { id: u16::from_le_bytes([id, id_high]), number }
        })
    }

    /// A parameter by its number, from 0; none past the last one.
    #[must_use]
    pub fn parameter(&self, number: u8) -> Option<LawParameter> {
        if number >= self.header.parameters {
            return None;
        }
        let start = usize::from(self.header.ports_end() + PARAMETER_WORDS * u16::from(number));
        let [unit, min, max, default] = *self.words.get(start..)?.first_chunk()?;
        let unit = postcard::from_bytes(&[u8::try_from(unit).ok()?]).ok()?;
        let [min, max, default] = [min, max, default].map(f32::from_bits);
        Some(LawParameter { unit, min, max, default })
    }

    /// Its constants, as bits.
    #[must_use]
    pub fn constants(&self) -> &'a [u32] {
        self.words.get(self.header.constants_range()).unwrap_or_default()
    }

    /// Its instructions.
    #[must_use]
    pub fn instructions(&self, section: Section) -> &'a [u32] {
        self.words.get(self.header.instructions(section)).unwrap_or_default()
    }

    /// What its instructions add to a tick of a device with so many axes, by the cycles of each; those to begin with those
    /// of a tick. None if one's are not known.
    pub fn cycles(&self, dof: usize, of: impl Fn(Opcode) -> Option<u32>) -> Option<u32> {
        let sum = |section| {
            let mut words = self.instructions(section).iter();
            words.try_fold(0_u32, |sum, word| Some(sum.saturating_add(of(Instruction(*word).opcode()?)?)))
        };
        let lanes = if self.header.is_coupled { 1 } else { dof };
        let of_axis = sum(Section::Begin)?.saturating_add(sum(Section::Tick)?);
        // Those that run once do so before those that begin, too.
        let once = sum(Section::Once)?.saturating_mul(2);
        Some(once.saturating_add(of_axis.saturating_mul(u32::try_from(lanes).unwrap_or(u32::MAX))))
    }

    /// Bytes of its names: those of the law, its inputs, outputs and parameters, a line each.
    pub fn text(&self) -> impl Iterator<Item = u8> + 'a {
        let start = usize::from(self.header.text_start());
        let words = self.words.get(start..).unwrap_or_default();
        words.iter().flat_map(|word| word.to_le_bytes()).take(self.header.text_bytes.into())
    }
}

/// The CRC that ends a program with these words in front of it.
#[must_use]
pub fn seal(words: &[u32]) -> u32 {
    let mut digest = CRC.digest();
    words.iter().for_each(|word| digest.update(&word.to_le_bytes()));
    digest.finalize()
}

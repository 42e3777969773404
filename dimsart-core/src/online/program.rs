//! Format of a program.
//!
//! ```text
//! word  bits 0 to 7     8 to 15        16 to 23       24 to 31
//!    0  version, 2      inputs         outputs        parameters
//!    1  states          constants      axes           1 if it computes all axes in one go
//!    2  instructions:   once           to begin       of a tick, then bytes of text
//! ```
//! After these words: for each input and output its signal (type in 16 bits, number in 8); for each parameter
//! its unit and the `f32` words of minimum, maximum and default; constants, `f32`; the
//! [instructions](super::Instruction); text with the names of the law, inputs, outputs and parameters, one
//! per line, padded with zeros; a CRC-32 (AUTOSAR) of all these words as little-endian bytes.
//!
//! The `once` instructions run first, once for all axes. The `to begin` instructions run once per axis before
//! the law's first tick, the `of a tick` instructions once per axis in each tick. Both find the axis'
//! parameters in the first registers, followed by its states. A law that computes all axes in one go runs
//! them once, with the parameters and states of axis 0; its device must have exactly `axes` axes. For other
//! laws `axes` is the minimum.

use core::ops::Range;

use super::PROGRAM_VERSION;
use super::instruction::{Instruction, Opcode};
use crate::packet::CRC;
use crate::signal::{TypeRef, Unit};

/// Maximum number of inputs.
pub const MAX_INPUTS: usize = 6;
/// Maximum number of outputs.
pub const MAX_OUTPUTS: usize = 4;
/// Maximum number of parameters.
pub const MAX_PARAMETERS: usize = 8;
/// Numbers of a program's parameters.
pub(crate) const PARAMETERS: [u8; MAX_PARAMETERS] = [0, 1, 2, 3, 4, 5, 6, 7];
/// Maximum number of states per axis.
pub const MAX_STATES: usize = 8;

/// Words before the ports.
const HEADER_WORDS: u16 = 3;
const PARAMETER_WORDS: u16 = 4;

/// Sizes of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Header {
    /// Inputs.
    pub inputs: u8,
    /// Outputs.
    pub outputs: u8,
    /// Parameters.
    pub parameters: u8,
    /// States per axis.
    pub states: u8,
    /// Constants.
    pub constants: u8,
    /// Minimum number of axes; the exact number if it computes all axes in one go.
    pub axes: u8,
    /// Whether it computes all axes in one go.
    pub is_coupled: bool,
    /// Instructions that run once for all axes.
    pub once: u8,
    /// Instructions before the first tick.
    pub begin: u8,
    /// Instructions in each tick.
    pub tick: u8,
    /// Bytes of text.
    pub text_bytes: u8,
}

/// A part of a program's instructions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Section {
    /// Runs before the others, once for all axes.
    Once,
    /// Runs before the law's first tick.
    Begin,
    /// Runs in each tick.
    Tick,
}

impl Header {
    /// Header of an empty program.
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

    /// Encodes the header.
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

    /// Decodes a program's first words without checks; none if there are too few.
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

    /// Returns the number of words of the whole program.
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
    /// Minimum.
    pub min: f32,
    /// Maximum.
    pub max: f32,
    /// Default.
    pub default: f32,
}

impl LawParameter {
    /// Encodes the parameter.
    #[must_use]
    pub fn to_words(self) -> [u32; 4] {
        let mut unit = [0; 1];
        // A unit is one byte.
        let _ = postcard::to_slice(&self.unit, &mut unit);
        [unit[0].into(), self.min.to_bits(), self.max.to_bits(), self.default.to_bits()]
    }
}

/// A verified program.
#[derive(Debug, Clone, Copy)]
pub struct Program<'a> {
    words: &'a [u32],
    header: Header,
}

impl<'a> Program<'a> {
    /// Creates a program from verified words.
    #[inline(always)]
    pub(super) fn trusted(words: &'a [u32], header: Header) -> Self {
        Self { words, header }
    }

    /// Creates a program from words that are being verified.
    pub(super) fn unverified(words: &'a [u32], header: Header) -> Self {
        Self { words, header }
    }

    /// Returns the sizes.
    #[inline(always)]
    #[must_use]
    pub fn header(&self) -> Header {
        self.header
    }

    /// Returns all words.
    #[must_use]
    pub fn words(&self) -> &'a [u32] {
        self.words
    }

    /// Returns the inputs, followed by the outputs.
    pub fn ports(&self) -> impl Iterator<Item = TypeRef> + 'a {
        let range = usize::from(HEADER_WORDS)..self.header.ports_end().into();
        self.words.get(range).unwrap_or_default().iter().map(|word| {
            let [id, id_high, number, _] = word.to_le_bytes();
            TypeRef { id: u16::from_le_bytes([id, id_high]), number }
        })
    }

    /// Returns a parameter by its number, from 0.
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

    /// Returns the constants, as bits.
    #[must_use]
    pub fn constants(&self) -> &'a [u32] {
        self.words.get(self.header.constants_range()).unwrap_or_default()
    }

    /// Returns the instructions of a section.
    #[must_use]
    pub fn instructions(&self, section: Section) -> &'a [u32] {
        self.words.get(self.header.instructions(section)).unwrap_or_default()
    }

    /// Returns the cycles that its instructions add to a tick of a device with `dof` axes, including those to
    /// begin. None if a cost is unknown.
    pub fn cycles(&self, dof: usize, of: impl Fn(Opcode) -> Option<u32>) -> Option<u32> {
        let sum = |section| {
            let mut words = self.instructions(section).iter();
            words.try_fold(0_u32, |sum, word| Some(sum.saturating_add(of(Instruction(*word).opcode()?)?)))
        };
        let lanes = if self.header.is_coupled { 1 } else { dof };
        let of_axis = sum(Section::Begin)?.saturating_add(sum(Section::Tick)?);
        // The `once` instructions also run before those to begin.
        let once = sum(Section::Once)?.saturating_mul(2);
        Some(once.saturating_add(of_axis.saturating_mul(u32::try_from(lanes).unwrap_or(u32::MAX))))
    }

    /// Returns the bytes of its names: law, inputs, outputs and parameters, one per line.
    pub fn text(&self) -> impl Iterator<Item = u8> + 'a {
        let start = usize::from(self.header.text_start());
        let words = self.words.get(start..).unwrap_or_default();
        words.iter().flat_map(|word| word.to_le_bytes()).take(self.header.text_bytes.into())
    }
}

/// Computes the CRC of a program's words.
#[must_use]
pub fn program_crc(words: &[u32]) -> u32 {
    let mut digest = CRC.digest();
    words.iter().for_each(|word| digest.update(&word.to_le_bytes()));
    digest.finalize()
}

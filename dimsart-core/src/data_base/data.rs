//! The Data Base as a module sees it during a tick.

mod written_out;

use core::cell::Cell;

use crate::data_base::checked_words::CheckedWords;
use crate::data_base::handle::{Grid, Input, Memory, Output, Signal, Single, Vector};
use crate::device::DeviceDescriptor;
use crate::limits::MAX_DOF;
use crate::online::Programs;
use crate::packet::LinkPort;
use crate::signal::{Scalar, Word};

pub use self::written_out::{Inputs, Outputs};

/// Access to the Data Base through handles. Reading never fails: a handle that is not connected
/// reads as zero, and what is written to it is dropped.
#[derive(Debug)]
pub struct Data<'a> {
    words: &'a [Cell<u32>],
    links: &'a [LinkPort],
    programs: &'a Programs,
    device: &'a DeviceDescriptor,
    dof: Dof,
    is_limited: bool,
}

/// Degrees of freedom. The compiler knows how few they can be, and that there is one: loops over axes are short and
/// have a start, no sum with an offset overflows.
#[derive(Debug, Clone, Copy)]
#[repr(u8)]
pub(crate) enum Dof {
    One = 1,
    Two,
    Three,
    Four,
    Five,
    Six,
    Seven,
    Eight,
}

impl Dof {
    const ALL: [Self; MAX_DOF] =
        [Self::One, Self::Two, Self::Three, Self::Four, Self::Five, Self::Six, Self::Seven, Self::Eight];

    /// That of a device.
    pub(crate) fn of(device: &DeviceDescriptor) -> Self {
        Self::ALL.get(device.dof().wrapping_sub(1)).copied().unwrap_or(Self::One)
    }
}

impl<'a> Data<'a> {
    #[inline]
    pub(crate) fn new(
        words: &'a [Cell<u32>],
        links: &'a [LinkPort],
        programs: &'a Programs,
        device: &'a DeviceDescriptor,
        dof: Dof,
        is_limited: bool,
    ) -> Self {
        Self { words, links, programs, device, dof, is_limited }
    }

    /// The device's descriptor: degrees of freedom, sample period.
    #[must_use]
    pub fn device(&self) -> &DeviceDescriptor {
        self.device
    }

    /// The programs that the controller has.
    #[must_use]
    #[inline(always)]
    pub fn programs(&self) -> &'a Programs {
        self.programs
    }

    /// Whether the device got less than it was commanded in the last tick: a module that writes its input finds what it got
    /// in [`last`](Output::last) of its port, and has integrals follow that.
    #[inline(always)]
    #[must_use]
    pub fn is_limited(&self) -> bool {
        self.is_limited
    }

    /// Whether a word of a span is what it cannot be.
    #[inline(always)]
    pub(crate) fn has_wrong(&self, span: &CheckedWords) -> bool {
        span.has_wrong(self.words)
    }

    /// Degrees of freedom: how many axes a vector has.
    #[inline]
    #[must_use]
    pub fn dof(&self) -> usize {
        self.dof as usize
    }

    /// Computes every axis by one law, the way most control laws are written.
    ///
    /// `law` gets the axis and its inputs and returns its outputs: an array of `f32` for an array of at most 8 ports, a
    /// tuple for a tuple of at most 4 ports of any formats. Nothing is computed while one of the ports is not
    /// connected.
    #[inline(always)]
    pub fn map_axes<I: Inputs, O: Outputs>(
        &self,
        inputs: I,
        outputs: O,
        mut law: impl FnMut(usize, I::Values) -> O::Values,
    ) {
        let Some(sources) = inputs.words(self) else { return };
        let Some(sinks) = outputs.words(self) else { return };
        for axis in 0..self.dof() {
            let values = law(axis, I::read(&sources, axis));
            O::write(&sinks, axis, values);
        }
    }

    /// Value of one axis of a vector; the default (zero) beyond the last axis.
    #[inline]
    #[must_use]
    pub fn axis<T: Scalar>(&self, input: Input<Vector<T>>, axis: usize) -> T {
        self.axes(input.block.offset).and_then(|words| words.get(axis)).map_or_else(T::default, read)
    }

    /// Writes one axis of a vector; dropped beyond the last axis.
    #[inline]
    pub fn set_axis<T: Scalar>(&self, output: Output<Vector<T>>, axis: usize, value: T) {
        if let Some(word) = self.axes(output.block.offset).and_then(|words| words.get(axis)) {
            word.set(value.into_word().0);
        }
    }

    /// Value of a scalar.
    #[inline]
    #[must_use]
    pub fn get<T: Scalar>(&self, input: Input<Single<T>>) -> T {
        self.word(input.block.offset, 0).map_or_else(T::default, read)
    }

    /// Writes a scalar.
    #[inline]
    pub fn set<T: Scalar>(&self, output: Output<Single<T>>, value: T) {
        if let Some(word) = self.word(output.block.offset, 0) {
            word.set(value.into_word().0);
        }
    }

    /// Element of a matrix; zero outside it.
    #[inline]
    #[must_use]
    pub fn element<S: Grid>(&self, input: Input<S>, row: usize, column: usize) -> S::Value {
        self.cell(input.block.offset, S::size(self.dof()), row, column).map_or_else(S::Value::default, read)
    }

    /// Writes an element of a matrix; dropped outside it.
    #[inline]
    pub fn set_element<S: Grid>(&self, output: Output<S>, row: usize, column: usize, value: S::Value) {
        if let Some(word) = self.cell(output.block.offset, S::size(self.dof()), row, column) {
            word.set(value.into_word().0);
        }
    }

    /// All words of a signal, for modules that move data without looking at it.
    #[inline]
    #[must_use]
    pub fn words<S: Signal>(&self, input: Input<S>) -> &[Cell<u32>] {
        self.block(input.block.offset, S::words(self.dof(), input.block.words))
    }

    /// All words of a signal to be written.
    #[inline]
    #[must_use]
    pub fn words_out<S: Signal>(&self, output: Output<S>) -> &[Cell<u32>] {
        self.block(output.block.offset, S::words(self.dof(), output.block.words))
    }

    /// A module's own memory; zero when it was plugged in.
    #[inline]
    #[must_use]
    pub fn memory(&self, memory: Memory) -> &[Cell<u32>] {
        let start = usize::from(memory.block.offset);
        self.words.get(start..start + usize::from(memory.block.words)).unwrap_or_default()
    }

    /// The words for one vector at word `position` of a memory; none when it has no room for them there.
    #[inline(always)]
    #[must_use]
    pub fn row(&self, memory: Memory, position: u16) -> Option<&[Cell<u32>]> {
        let end = usize::from(position) + self.dof();
        let start = usize::from(memory.block.offset) + usize::from(position);
        if end > usize::from(memory.block.words) {
            return None;
        }
        self.words.get(start..start + self.dof())
    }

    /// Position of the row after the one at `position`, from the end of the memory back to its start.
    #[inline(always)]
    #[must_use]
    pub fn row_after(&self, memory: Memory, position: u16) -> u16 {
        let next = position.saturating_add(u16::from(self.dof as u8));
        if next < memory.block.words { next } else { 0 }
    }

    /// So many words of a memory from word `position` on, and the position after them, from its end back to its start;
    /// none when it has no room for them there.
    #[must_use]
    pub fn words_at(&self, memory: Memory, position: u16, words: usize) -> Option<(&[Cell<u32>], u16)> {
        let end = usize::from(position) + words;
        let found = self.memory(memory).get(usize::from(position)..end)?;
        let next = u16::try_from(end).ok().filter(|next| *next < memory.block.words);
        Some((found, next.unwrap_or(0)))
    }

    /// The comm edge of link `number`, if there is one.
    #[inline]
    #[must_use]
    pub fn link(&self, number: u32) -> Option<&LinkPort> {
        self.links.get(usize::try_from(number).ok()?)
    }

    /// So many words from a place on, if there are so many.
    #[inline(always)]
    pub(crate) fn range(&self, start: u16, words: usize) -> Option<&'a [Cell<u32>]> {
        let start = usize::from(start);
        self.words.get(start..start + words)
    }

    #[inline(always)]
    fn axes(&self, offset: u16) -> Option<&'a [Cell<u32>]> {
        self.range(offset, self.dof())
    }

    #[inline(always)]
    fn block(&self, offset: u16, words: usize) -> &'a [Cell<u32>] {
        let found = self.words.get(usize::from(offset)..).and_then(|words_behind| words_behind.get(..words));
        found.unwrap_or_default()
    }

    #[inline(always)]
    fn cell(
        &self,
        offset: u16,
        (rows, columns): (usize, usize),
        row: usize,
        column: usize,
    ) -> Option<&'a Cell<u32>> {
        if row >= rows || column >= columns {
            return None;
        }
        self.block(offset, rows * columns).get(row * columns + column)
    }

    #[inline(always)]
    fn word(&self, offset: u16, index: usize) -> Option<&'a Cell<u32>> {
        self.words.get(usize::from(offset) + index)
    }
}

#[inline]
fn read<T: Scalar>(word: &Cell<u32>) -> T {
    T::from_word(Word(word.get()))
}

//! View of the Data Base for a module during a tick.

mod written_out;

use core::cell::Cell;

use crate::data_base::checked_words::CheckedWords;
use crate::data_base::handle::{Input, MatrixSignal, Memory, Output, ScalarSignal, Signal, Vector};
use crate::device::DeviceDescriptor;
use crate::limits::MAX_DOF;
use crate::online::Programs;
use crate::packet::LinkPort;
use crate::signal::{Scalar, Word};

pub use self::written_out::{Inputs, Outputs};

/// Access to the Data Base through handles. Access never fails: an unconnected handle reads zero, and writes
/// to it are dropped.
#[derive(Debug)]
pub struct Data<'a> {
    words: &'a [Cell<u32>],
    links: &'a [LinkPort],
    programs: &'a Programs,
    device: &'a DeviceDescriptor,
    dof: Dof,
    is_limited: bool,
}

/// Degrees of freedom as an enum: the range is known at compile time, so loops over axes are short and sums cannot
/// overflow.
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

    /// Returns the degrees of freedom of a device.
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

    /// Returns the device's descriptor: degrees of freedom, sample period.
    #[must_use]
    pub fn device(&self) -> &DeviceDescriptor {
        self.device
    }

    /// Returns the controller's programs.
    #[must_use]
    #[inline(always)]
    pub fn programs(&self) -> &'a Programs {
        self.programs
    }

    /// Returns whether the device got less than the scheme commanded in the last tick. A module that writes
    /// the device's input then finds the actual value in [`last`](Output::last) of its port, for anti-windup.
    #[inline(always)]
    #[must_use]
    pub fn is_limited(&self) -> bool {
        self.is_limited
    }

    /// Returns whether a word of a span is out of range.
    #[inline(always)]
    pub(crate) fn has_wrong(&self, span: &CheckedWords) -> bool {
        span.has_wrong(self.words)
    }

    /// Returns the degrees of freedom: the number of axes of a vector.
    #[inline]
    #[must_use]
    pub fn dof(&self) -> usize {
        self.dof as usize
    }

    /// Computes every axis by the same law.
    ///
    /// `law` gets the axis and its inputs and returns its outputs: an array of `f32` for an array of at most
    /// 8 ports, a tuple for a tuple of at most 4 ports of any formats. Does nothing if one of the ports is
    /// unconnected.
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

    /// Returns the value of one axis of a vector; the default (zero) beyond the last axis.
    #[inline]
    #[must_use]
    pub fn axis<T: Scalar>(&self, input: Input<Vector<T>>, axis: usize) -> T {
        self.axes(input.block.offset).and_then(|words| words.get(axis)).map_or_else(T::default, read)
    }

    /// Writes one axis of a vector; ignored beyond the last axis.
    #[inline]
    pub fn set_axis<T: Scalar>(&self, output: Output<Vector<T>>, axis: usize, value: T) {
        if let Some(word) = self.axes(output.block.offset).and_then(|words| words.get(axis)) {
            word.set(value.into_word().0);
        }
    }

    /// Returns the value of a scalar.
    #[inline]
    #[must_use]
    pub fn get<T: Scalar>(&self, input: Input<ScalarSignal<T>>) -> T {
        self.word(input.block.offset, 0).map_or_else(T::default, read)
    }

    /// Writes a scalar.
    #[inline]
    pub fn set<T: Scalar>(&self, output: Output<ScalarSignal<T>>, value: T) {
        if let Some(word) = self.word(output.block.offset, 0) {
            word.set(value.into_word().0);
        }
    }

    /// Returns an element of a matrix; zero outside it.
    #[inline]
    #[must_use]
    pub fn element<S: MatrixSignal>(&self, input: Input<S>, row: usize, column: usize) -> S::Value {
        self.cell(input.block.offset, S::size(self.dof()), row, column).map_or_else(S::Value::default, read)
    }

    /// Writes an element of a matrix; ignored outside it.
    #[inline]
    pub fn set_element<S: MatrixSignal>(
        &self,
        output: Output<S>,
        row: usize,
        column: usize,
        value: S::Value,
    ) {
        if let Some(word) = self.cell(output.block.offset, S::size(self.dof()), row, column) {
            word.set(value.into_word().0);
        }
    }

    /// Returns all words of a signal, for modules that copy data.
    #[inline]
    #[must_use]
    pub fn words<S: Signal>(&self, input: Input<S>) -> &[Cell<u32>] {
        self.block(input.block.offset, S::words(self.dof(), input.block.words))
    }

    /// Returns all words of a signal to write.
    #[inline]
    #[must_use]
    pub fn words_out<S: Signal>(&self, output: Output<S>) -> &[Cell<u32>] {
        self.block(output.block.offset, S::words(self.dof(), output.block.words))
    }

    /// Returns a module's own memory; zero when it was plugged in.
    #[inline]
    #[must_use]
    pub fn memory(&self, memory: Memory) -> &[Cell<u32>] {
        let start = usize::from(memory.block.offset);
        self.words.get(start..start + usize::from(memory.block.words)).unwrap_or_default()
    }

    /// Returns the words of one vector at word `position` of a memory; none if they exceed the memory.
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

    /// Returns the position of the row after `position`; wraps at the end of the memory.
    #[inline(always)]
    #[must_use]
    pub fn next_row(&self, memory: Memory, position: u16) -> u16 {
        let next = position.saturating_add(u16::from(self.dof as u8));
        if next < memory.block.words { next } else { 0 }
    }

    /// Returns `words` words of a memory from word `position` on and the position after them, which wraps at
    /// the end; none if they exceed the memory.
    #[must_use]
    pub fn words_at(&self, memory: Memory, position: u16, words: usize) -> Option<(&[Cell<u32>], u16)> {
        let end = usize::from(position) + words;
        let found = self.memory(memory).get(usize::from(position)..end)?;
        let next = u16::try_from(end).ok().filter(|next| *next < memory.block.words);
        Some((found, next.unwrap_or(0)))
    }

    /// Returns the link with this number, if it exists.
    #[inline]
    #[must_use]
    pub fn link(&self, number: u32) -> Option<&LinkPort> {
        self.links.get(usize::try_from(number).ok()?)
    }

    /// Returns `words` words from `start` on, if they exist.
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

//! The stack and its maximum depth.

use std::ops::Range;

use super::Stop;
use super::memory::Regions;

/// Fill byte of the stack before a call.
const PAINT: u8 = 0xA5;

/// The range of the stack and the lowest SP.
#[derive(Debug, Clone)]
pub(super) struct Stack {
    range: Range<u32>,
    lowest: u32,
}

impl Stack {
    pub(super) fn new(range: Range<u32>) -> Self {
        let top = range.end & !7;
        Self { range: range.start..top, lowest: top }
    }

    /// SP of the empty stack.
    pub(super) fn top(&self) -> u32 {
        self.range.end
    }

    pub(super) fn begin(&mut self) {
        self.lowest = self.top();
    }

    /// Records a new SP.
    #[inline]
    pub(super) fn at(&mut self, pointer: u32) -> Result<(), Stop> {
        if pointer < self.lowest {
            self.lowest = pointer;
            if pointer < self.range.start {
                return Err(Stop::StackOverflow { pointer, lowest: self.range.start });
            }
        }
        Ok(())
    }

    /// Starts a measurement of the lowest SP within a call. Returns the lowest SP before it.
    pub(super) fn enter(&mut self, pointer: u32) -> u32 {
        std::mem::replace(&mut self.lowest, pointer)
    }

    /// Resumes the measurement around a call. Returns the bytes of the call.
    pub(super) fn leave(&mut self, pointer: u32, lowest_around: u32) -> u32 {
        let bytes = pointer.saturating_sub(self.lowest);
        self.lowest = self.lowest.min(lowest_around);
        bytes
    }

    pub(super) fn depth_bytes(&self) -> u32 {
        self.top() - self.lowest
    }

    pub(super) fn paint(&self, memory: &mut Regions) {
        if let Some(bytes) = memory.slice_mut(self.range.clone()) {
            bytes.fill(PAINT);
        }
    }

    /// Bytes from the lowest byte that differs from the fill byte.
    pub(super) fn written_bytes(&self, memory: &Regions) -> u32 {
        let bytes = memory.slice(self.range.clone()).unwrap_or_default();
        // Chunks compare faster.
        let painted = bytes.chunks(64).take_while(|chunk| **chunk == [PAINT; 64]).count() * 64;
        let rest = bytes.get(painted..).unwrap_or_default();
        let painted = rest.iter().take_while(|byte| **byte == PAINT).count();
        u32::try_from(rest.len() - painted).unwrap_or(u32::MAX)
    }
}

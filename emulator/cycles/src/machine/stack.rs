//! The stack: how deep it goes.

use std::ops::Range;

use super::Stop;
use super::memory::Regions;

/// Byte that the stack is filled with before a call.
const PAINT: u8 = 0xA5;

/// The stack's place and the lowest SP.
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

    /// SP when nothing is on it.
    pub(super) fn top(&self) -> u32 {
        self.range.end
    }

    pub(super) fn begin(&mut self) {
        self.lowest = self.top();
    }

    /// SP is there.
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

    /// Begins to look for the lowest SP within a call; gives the lowest around it until then.
    pub(super) fn enter(&mut self, pointer: u32) -> u32 {
        std::mem::replace(&mut self.lowest, pointer)
    }

    /// Goes on around a call; gives the bytes that the call took.
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

    /// Bytes from the lowest that is not as it was painted.
    pub(super) fn written_bytes(&self, memory: &Regions) -> u32 {
        let bytes = memory.slice(self.range.clone()).unwrap_or_default();
        // In chunks, which are compared faster.
        let painted = bytes.chunks(64).take_while(|chunk| **chunk == [PAINT; 64]).count() * 64;
        let rest = bytes.get(painted..).unwrap_or_default();
        let painted = rest.iter().take_while(|byte| **byte == PAINT).count();
        u32::try_from(rest.len() - painted).unwrap_or(u32::MAX)
    }
}

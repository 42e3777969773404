//! What a program does that the manual forbids.

use cycles::processor::At;

/// Something that a chip may answer by anything.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Violation {
    /// When, and at which instruction.
    pub at: At,
    /// What, for people.
    pub what: String,
}

/// Where peripherals note violations, and when: one access.
#[derive(Debug)]
pub(super) struct Access<'a> {
    pub(super) at: At,
    pub(super) violations: &'a mut Vec<Violation>,
}

/// More of them are not kept: one in every tick would fill the memory.
const MOST: usize = 1_000;

impl Access<'_> {
    pub(super) fn violates(&mut self, what: impl Into<String>) {
        if self.violations.len() < MOST {
            self.violations.push(Violation { at: self.at, what: what.into() });
        }
    }
}

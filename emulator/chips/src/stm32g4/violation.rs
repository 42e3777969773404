//! Violations of the reference manual by a program.

use cycles::processor::AccessPoint;

/// A violation: the chip's reaction is undefined. Repeated violations at the same instruction are counted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Violation {
    /// Cycle and instruction of the first occurrence.
    pub at: AccessPoint,
    /// Description.
    pub description: String,
    /// Number of occurrences.
    pub count: u64,
}

/// One access, with the list in which peripherals record violations.
#[derive(Debug)]
pub(super) struct Access<'a> {
    pub(super) at: AccessPoint,
    pub(super) violations: &'a mut Vec<Violation>,
}

impl Access<'_> {
    pub(super) fn violates(&mut self, what: impl Into<String>) {
        let what = what.into();
        let known = self.violations.iter_mut();
        let mut known = known.filter(|known| known.at.code == self.at.code && known.description == what);
        match known.next() {
            Some(known) => known.count += 1,
            None => self.violations.push(Violation { at: self.at, description: what, count: 1 }),
        }
    }
}

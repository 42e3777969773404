//! What a program does that the manual forbids.

use cycles::processor::At;

/// Something that a chip may answer by anything. The same one at the same place is counted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Violation {
    /// When it happened first, and at which instruction.
    pub at: At,
    /// What, for people.
    pub what: String,
    /// How often.
    pub count: u64,
}

/// Where peripherals note violations, and when: one access.
#[derive(Debug)]
pub(super) struct Access<'a> {
    pub(super) at: At,
    pub(super) violations: &'a mut Vec<Violation>,
}

impl Access<'_> {
    pub(super) fn violates(&mut self, what: impl Into<String>) {
        let what = what.into();
        let known = self.violations.iter_mut();
        let mut known = known.filter(|known| known.at.code == self.at.code && known.what == what);
        match known.next() {
            Some(known) => known.count += 1,
            None => self.violations.push(Violation { at: self.at, what, count: 1 }),
        }
    }
}

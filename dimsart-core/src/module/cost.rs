//! Maximum processor cycles of a tick and of each module kind.

use core::num::NonZeroU32;

use serde::{Deserialize, Serialize};

use crate::module::kind_id::KindId;
use crate::online::Opcode;

/// Maximum processor cycles: `offset + per_dof * dof`.
///
/// Computed from the machine code of a linked image and written into its [stamp](crate::stamp). It holds for
/// any measurements and received data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct Cost {
    offset: u16,
    per_dof: u16,
}

impl Cost {
    /// Unknown.
    pub const UNKNOWN: Self = Self::new(0, 0);

    /// Creates a cost from fixed cycles and cycles per degree of freedom.
    #[must_use]
    pub const fn new(offset: u16, per_dof: u16) -> Self {
        Self { offset, per_dof }
    }

    /// Returns the fixed cycles and the cycles per degree of freedom.
    #[must_use]
    pub const fn coefficients(self) -> (u16, u16) {
        (self.offset, self.per_dof)
    }

    /// Returns the cycles for signals of `words` words: the degrees of freedom, or the words of the widest
    /// signal. At most 255 × 255, the largest matrix.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "at most 255 x 255")]
    pub const fn cycles(self, words: usize) -> u32 {
        self.offset as u32 + self.per_dof as u32 * words as u32
    }
}

/// Costs of a tick without modules, and of each module kind.
///
/// A module's cost covers all choices and switches among its parameters, two values of each number, and for a
/// COMM module the largest packet. So only plugging in a module changes the bound of a scheme.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Costs {
    lines: &'static [Cost],
    kinds: &'static [KindId],
}

impl Costs {
    /// Creates the costs from lines: the tick, then each of these kinds, then each
    /// [instruction](crate::online::Opcode) of programs; [`Cost::UNKNOWN`] where unknown.
    #[must_use]
    pub const fn new(lines: &'static [Cost], kinds: &'static [KindId]) -> Self {
        Self { lines, kinds }
    }

    /// Returns the cost of a tick without modules: the device's signals in and out, and the engine.
    #[must_use]
    pub fn tick(self) -> Option<Cost> {
        self.line(0)
    }

    /// Returns the cost of a module kind including the engine's calls; none if unknown.
    #[must_use]
    pub fn kind(self, kind: KindId) -> Option<Cost> {
        self.line(self.kinds.iter().position(|known| *known == kind)? + 1)
    }

    /// Returns the cost of a program instruction; none if unknown.
    pub(crate) fn instruction(self, opcode: Opcode) -> Option<u32> {
        self.line(1 + self.kinds.len() + opcode as usize).map(|cost| cost.cycles(0))
    }

    fn line(self, index: usize) -> Option<Cost> {
        self.lines.get(index).copied().filter(|cost| *cost != Cost::UNKNOWN)
    }
}

/// Bound of a tick of the running scheme, from the machine code of the image; see [`Cost`](crate::Cost).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct BoundReport {
    /// Processor cycles.
    pub cycles: u32,
    /// Limit of a tick: a module that could exceed it is not plugged in.
    pub limit_cycles: Option<NonZeroU32>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cost_is_a_straight_line() {
        assert_eq!([0, 1, 7].map(|dof| Cost::new(100, 10).cycles(dof)), [100, 110, 170]);
        assert_eq!(Cost::new(u16::MAX, u16::MAX).cycles(8), 9 * u32::from(u16::MAX));
    }

    #[test]
    fn a_kind_has_the_line_of_its_number_or_none() {
        const LINES: [Cost; 3] = [Cost::new(500, 60), Cost::new(100, 10), Cost::UNKNOWN];
        const KINDS: [KindId; 2] = [KindId::from_name("PD"), KindId::from_name("P")];
        let costs = Costs::new(&LINES, &KINDS);
        assert_eq!(costs.tick(), Some(Cost::new(500, 60)));
        assert_eq!(
            ["PD", "P", "PID"].map(|name| costs.kind(KindId::from_name(name))),
            [Some(LINES[1]), None, None]
        );
    }
}

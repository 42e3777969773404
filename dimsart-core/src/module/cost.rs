//! What a tick and each kind of module take at most: cycles of the processor.

use core::num::NonZeroU32;

use serde::{Deserialize, Serialize};

use crate::module::kind_id::KindId;
use crate::online::Opcode;

/// Most cycles that something takes: `offset + per_dof * dof`.
///
/// Worked out from the machine code of a linked image, and put into its [stamp](crate::stamp): what is measured and what
/// comes in over a link can be anything.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct Cost {
    offset: u16,
    per_dof: u16,
}

impl Cost {
    /// Not known.
    pub const UNKNOWN: Self = Self::new(0, 0);

    /// A straight line over the degrees of freedom: cycles, and cycles for each.
    #[must_use]
    pub const fn new(offset: u16, per_dof: u16) -> Self {
        Self { offset, per_dof }
    }

    /// The number of cycles without, and for each, degree of freedom.
    #[must_use]
    pub const fn line(self) -> (u16, u16) {
        (self.offset, self.per_dof)
    }

    /// For signals of `words` words: one for each degree of freedom, or as many as the widest one has. Not more than
    /// 255 × 255, the largest matrix.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "at most 255 x 255")]
    pub const fn cycles(self, words: usize) -> u32 {
        self.offset as u32 + self.per_dof as u32 * words as u32
    }
}

/// What a tick takes without modules, and what each kind of module adds to it.
///
/// A module's cost covers every choice and switch among its parameters and two values of each number, and a COMM module
/// that carries the most it can: nothing but plugging in is taken to change what a scheme may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Costs {
    lines: &'static [Cost],
    kinds: &'static [KindId],
}

impl Costs {
    /// The tick's cost, then that of each of these kinds, then that of each [instruction](crate::online::Opcode) of programs;
    /// [`Cost::UNKNOWN`] where there is none.
    #[must_use]
    pub const fn new(lines: &'static [Cost], kinds: &'static [KindId]) -> Self {
        Self { lines, kinds }
    }

    /// Of a tick without modules: the device's signals in and out, and the engine.
    #[must_use]
    pub fn tick(self) -> Option<Cost> {
        self.line(0)
    }

    /// Of a kind of module, with the engine's calls of it; none if it is not known.
    #[must_use]
    pub fn kind(self, kind: KindId) -> Option<Cost> {
        self.line(self.kinds.iter().position(|known| *known == kind)? + 1)
    }

    /// Of an instruction of a program, by its opcode. None if it is not known.
    pub(crate) fn instruction(self, opcode: Opcode) -> Option<u32> {
        self.line(1 + self.kinds.len() + opcode as usize).map(|cost| cost.cycles(0))
    }

    fn line(self, index: usize) -> Option<Cost> {
        self.lines.get(index).copied().filter(|cost| *cost != Cost::UNKNOWN)
    }
}

/// What a tick of the scheme that runs takes at most, by the machine code of the image; see [`Cost`](crate::Cost).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct BoundReport {
    /// Processor cycles.
    pub cycles: u32,
    /// What it may take: a module that could make it longer is not plugged in.
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
        const KINDS: [KindId; 2] = [KindId::of("PD"), KindId::of("P")];
        let costs = Costs::new(&LINES, &KINDS);
        assert_eq!(costs.tick(), Some(Cost::new(500, 60)));
        assert_eq!(["PD", "P", "PID"].map(|name| costs.kind(KindId::of(name))), [Some(LINES[1]), None, None]);
    }
}

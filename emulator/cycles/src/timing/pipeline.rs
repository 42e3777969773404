//! What earlier instructions leave behind that later ones wait for.

use super::Column;

/// What earlier instructions leave behind that later ones wait for.
///
/// The default is a pipeline that nothing is waited for in. Whatever instructions follow, and wherever one stops,
/// they take at least as long behind [`join`](Self::join)ed paths as behind either, and longest behind
/// [`worst`](Self::worst).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pipeline {
    /// Core registers that the preceding instruction computed, bit n for Rn: addresses wait for them.
    pub(super) computed: u16,
    /// The preceding instruction is a load that another access can be pipelined behind.
    pub(super) load: Option<PrecedingLoad>,
    /// Cycles until the floating-point unit takes an instruction.
    pub(super) float_busy: u8,
    /// Float registers whose values come late, bit n for Sn.
    pub(super) float_results: u32,
    /// Cycles until they are there.
    pub(super) float_results_after: u8,
    /// Misaligned four-byte instructions in a row.
    pub(super) misaligned: MisalignedRun,
    /// The preceding instruction jumped, and was no load.
    pub(super) jumped: bool,
    /// Number of the line of flash that the preceding instruction ended in, if it is known.
    pub(super) line: Option<u32>,
}

/// A load that just went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct PrecedingLoad {
    /// Core registers that it brings.
    pub(super) registers: u16,
    /// To a float register.
    pub(super) is_float: bool,
}

/// How far a run of misaligned four-byte instructions is, ordered by how soon it stalls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub(super) enum MisalignedRun {
    /// It has stalled and does so once, as far as this column says.
    Stalled,
    #[default]
    None,
    One,
    Two,
}

impl MisalignedRun {
    /// The run after one more instruction, and whether that stalls: the third of a run, in the upper column every
    /// further one, too. A chip stalls more than once where the run mixes accesses to memory with other instructions;
    /// after which of them is not known.
    pub(super) fn next(self, is_misaligned: bool, column: Column) -> (Self, bool) {
        match (self, column) {
            _ if !is_misaligned => (Self::None, false),
            (Self::None, _) => (Self::One, false),
            (Self::One, _) => (Self::Two, false),
            (Self::Two, Column::Likely) => (Self::Stalled, true),
            (Self::Two, Column::Upper) => (Self::Two, true),
            (Self::Stalled, _) => (Self::Stalled, false),
        }
    }
}

impl Pipeline {
    /// Behind either of two paths.
    #[must_use]
    pub fn join(self, other: Self) -> Self {
        let load = self.load.zip(other.load).map(|(a, b)| PrecedingLoad {
            registers: a.registers | b.registers,
            is_float: a.is_float || b.is_float,
        });
        Self {
            computed: self.computed | other.computed,
            load,
            float_busy: self.float_busy.max(other.float_busy),
            float_results: self.float_results | other.float_results,
            float_results_after: self.float_results_after.max(other.float_results_after),
            misaligned: self.misaligned.max(other.misaligned),
            jumped: self.jumped || other.jumped,
            line: self.line.filter(|_| self.line == other.line),
        }
    }

    /// Behind an unknown path: as slow as can be.
    #[must_use]
    pub fn worst() -> Self {
        Self {
            computed: u16::MAX,
            load: None,
            float_busy: u8::MAX,
            float_results: u32::MAX,
            float_results_after: u8::MAX,
            misaligned: MisalignedRun::Two,
            jumped: true,
            line: None,
        }
    }

    /// Lets time pass for the floating-point unit.
    pub(super) fn pass(&mut self, cycles: u32) {
        let cycles = u8::try_from(cycles).unwrap_or(u8::MAX);
        self.float_busy = self.float_busy.saturating_sub(cycles);
        self.float_results_after = self.float_results_after.saturating_sub(cycles);
        if self.float_results_after == 0 {
            self.float_results = 0;
        }
    }
}

//! Effects of preceding instructions that delay later instructions.

use super::Column;

/// Effects of preceding instructions that delay later instructions.
///
/// The default is a pipeline without delays. Any instructions, stopped at any point, take at least as long
/// after [`join`](Self::join)ed paths as after either path, and longest after [`worst`](Self::worst).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pipeline {
    /// Core registers computed by the preceding instruction, bit n for Rn: addresses wait for them.
    pub(super) computed: u16,
    /// The preceding instruction, if it is a load that another access can pipeline with.
    pub(super) load: Option<PrecedingLoad>,
    /// Cycles until the floating-point unit accepts an instruction.
    pub(super) float_busy: u8,
    /// Float registers with a late result, bit n for Sn.
    pub(super) float_results: u32,
    /// Cycles until these results are available.
    pub(super) float_results_after: u8,
    /// Consecutive misaligned four-byte instructions.
    pub(super) misaligned: MisalignedRun,
    /// Whether the preceding instruction jumped and was not a load.
    pub(super) jumped: bool,
    /// Number of the last flash line of the preceding instruction, if known.
    pub(super) line: Option<u32>,
}

/// The preceding load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct PrecedingLoad {
    /// Core registers that it loads.
    pub(super) registers: u16,
    /// Whether it loads a float register.
    pub(super) is_float: bool,
}

/// Progress of a run of misaligned four-byte instructions, ordered by proximity to a stall.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub(super) enum MisalignedRun {
    /// It has stalled, and stalls only once in this column.
    Stalled,
    #[default]
    None,
    One,
    Two,
}

impl MisalignedRun {
    /// The run after one more instruction, and whether that instruction stalls: the third of a run and, in
    /// the upper column, every further one. A chip stalls more than once if the run mixes memory accesses
    /// with other instructions; which of them stall is unknown.
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
    /// The pipeline that is at least as slow as both.
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

    /// The slowest pipeline, after an unknown path.
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

    /// Advances the time of the floating-point unit.
    pub(super) fn pass(&mut self, cycles: u32) {
        let cycles = u8::try_from(cycles).unwrap_or(u8::MAX);
        self.float_busy = self.float_busy.saturating_sub(cycles);
        self.float_results_after = self.float_results_after.saturating_sub(cycles);
        if self.float_results_after == 0 {
            self.float_results = 0;
        }
    }
}

//! Minimum, mean and maximum.

use ::cycles::machine::Run;

/// Source of inputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Inputs {
    /// The scenario.
    Scenario,
    /// Random numbers.
    Random,
}

/// Cycles and stack of calls of one kind.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Statistics {
    pub(super) min: u64,
    pub(super) max: u64,
    pub(super) count: u64,
    sum: u64,
    /// Maximum cycles with random inputs.
    pub(super) random_max: u64,
    /// Maximum stack, bytes.
    pub(super) stack_bytes: u32,
}

impl Statistics {
    pub(super) fn add(&mut self, inputs: Inputs, cycles: u64, stack_bytes: u32) {
        self.stack_bytes = self.stack_bytes.max(stack_bytes);
        if inputs == Inputs::Random {
            self.random_max = self.random_max.max(cycles);
            return;
        }
        self.min = if self.count == 0 { cycles } else { self.min.min(cycles) };
        self.max = self.max.max(cycles);
        self.sum += cycles;
        self.count += 1;
    }

    pub(super) fn add_run(&mut self, inputs: Inputs, run: &Run) {
        self.add(inputs, run.cycles, run.stack_bytes);
    }

    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53")]
    pub(super) fn mean(&self) -> f64 {
        self.sum as f64 / self.count.max(1) as f64
    }
}

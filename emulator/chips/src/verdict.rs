//! The verdict on a run: simulated time, broken rules, faults and resets.

use std::fmt;

use crate::Bench;

/// The verdict on a board's run so far, as text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Verdict {
    /// Board, time, clock, instructions and the longest time with interrupts masked.
    pub run: String,
    /// One line per broken rule, fault or reset.
    pub problems: Vec<String>,
}

impl Bench {
    /// Returns the verdict on the run so far, and restarts the measurement of the longest time with
    /// interrupts masked.
    pub fn verdict(&mut self) -> Verdict {
        Verdict::of(self)
    }
}

impl Verdict {
    fn of(bench: &mut Bench) -> Self {
        let (masked, place) = bench.processor.take_max_masked_cycles();
        let hz = bench.chip().clock().hz();
        #[expect(clippy::cast_precision_loss, reason = "below 2^53")]
        let masked_us = masked as f64 / hz * 1e6;
        let run = format!(
            "{}: {:.3} s at {:.0} MHz, {} instructions; interrupts masked for at most {masked_us:.1} us, until {place}",
            bench.board.name,
            bench.time_s(),
            hz / 1e6,
            bench.processor.instructions(),
        );
        let rules = bench.violations().into_iter().map(|rule| format!("rule broken: {rule}"));
        let mut problems: Vec<String> = rules.collect();
        let faults = bench.processor.faults().iter();
        problems.extend(faults.map(|fault| format!("fault: {}: {}", fault.place, fault.cause)));
        problems.extend(bench.chip().resets().iter().map(|reset| format!("reset: {reset:?}")));
        Self { run, problems }
    }

    /// Whether no rule was broken and no fault or reset occurred.
    #[must_use]
    pub fn is_well(&self) -> bool {
        self.problems.is_empty()
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { run, problems } = self;
        writeln!(formatter, "{run}")?;
        problems.iter().try_for_each(|trouble| writeln!(formatter, "{trouble}"))?;
        formatter.write_str(if self.is_well() {
            "no rule broken, no fault, no reset"
        } else {
            "FAILED: see the lines above"
        })
    }
}

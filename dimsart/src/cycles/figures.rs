//! Cost figures of the parts of a tick.

use serde::Serialize;

use super::statistics::Statistics;
use super::worst::Most;
use crate::report::{CycleBar, CycleBars};

/// Cost of one part, in [TRM-model cycles](super::UNIT).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Name of the part.
    pub name: String,
    /// Minimum cycles of the emulated run.
    pub emulated_min: u64,
    /// Mean cycles.
    pub emulated_mean: f64,
    /// Maximum cycles.
    pub emulated_max: u64,
    /// Number of runs.
    pub runs: u64,
    /// Maximum cycles with random inputs; 0 without.
    pub random_max: u64,
    /// Upper bound of cycles for all inputs; none if not computed.
    pub bound: Option<u64>,
    /// Bound divided by the maximum of all runs.
    pub ratio: Option<f64>,
    /// Upper bound of the stack, bytes; none if not computed.
    pub stack_bytes: Option<u32>,
    /// Maximum stack of the runs, bytes.
    pub stack_emulated_bytes: u32,
    /// Share of the period, by the bound or else the maximum, per cent.
    pub budget_percent: f64,
}

/// All figures of a scheme on a board.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figures {
    /// Unit: cycles of a model, not of silicon.
    pub unit: &'static str,
    /// Name of the image.
    pub image: String,
    /// The side of the scheme.
    pub side: String,
    /// The scheme.
    pub scheme: String,
    /// Axes of the device.
    pub dof: usize,
    /// Ticks of the scenario.
    pub ticks: u64,
    /// Ticks with random inputs.
    pub random_ticks: u64,
    /// Memory of the model.
    pub profile: &'static str,
    /// Value of the model where Arm specifies a range.
    pub column: &'static str,
    /// Clock of the board's processor.
    pub clock_hz: u32,
    /// Period of a tick.
    pub budget_cycles: u64,
    /// A tick: frame, engine and modules.
    pub tick: Row,
    /// A tick without its modules.
    pub frame_and_engine: Row,
    /// Modules of the scheme in the order of their first calls, with both stages.
    pub modules: Vec<Row>,
    /// Index in `modules` of each call in a tick.
    #[serde(skip)]
    pub steps: Vec<usize>,
    /// Cost of packets outside the tick.
    pub packets: Vec<Row>,
    /// Cost of commands, by kind.
    pub commands: Vec<Row>,
    /// Interrupt entry, exit and float registers.
    pub interrupt: Vec<Row>,
    /// Number of emulated instructions.
    pub instructions: u64,
    /// Why there are no bounds.
    pub no_bound: Option<String>,
}

impl Row {
    pub(super) fn new(name: String, statistics: &Statistics, most: Option<Most>, budget_cycles: u64) -> Self {
        let bound = most.map(|most| most.cycles);
        let max_seen = statistics.max.max(statistics.random_max);
        Self {
            name,
            emulated_min: statistics.min,
            emulated_mean: statistics.mean(),
            emulated_max: statistics.max,
            runs: statistics.count,
            random_max: statistics.random_max,
            bound,
            ratio: bound.filter(|_| max_seen > 0).map(|bound| ratio(bound, max_seen)),
            stack_bytes: most.map(|most| most.stack_bytes),
            stack_emulated_bytes: statistics.stack_bytes,
            budget_percent: 100.0 * ratio(bound.unwrap_or(max_seen), budget_cycles),
        }
    }
}

impl Figures {
    /// Returns the bars of the picture.
    #[must_use]
    pub fn bars(&self) -> CycleBars {
        let bar = |row: &Row| CycleBar {
            name: row.name.clone(),
            max_cycles: row.emulated_max.max(row.random_max),
            bound: row.bound,
        };
        let Self { side, dof, image, .. } = self;
        CycleBars {
            title: format!("Cycles of a tick, {side}, {dof} axes: {image}"),
            unit: self.unit,
            tick: bar(&self.tick),
            parts: std::iter::once(&self.frame_and_engine).chain(&self.modules).map(bar).collect(),
            budget: self.budget_cycles,
        }
    }
}

#[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53")]
fn ratio(part: u64, whole: u64) -> f64 {
    part as f64 / whole.max(1) as f64
}

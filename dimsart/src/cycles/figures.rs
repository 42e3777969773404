//! The figures: what each part of a tick costs.

use serde::Serialize;

use super::statistics::Statistics;
use super::worst::Most;
use crate::report::{CycleBar, CycleBars};

/// What one thing takes, in [TRM-model cycles](super::UNIT).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// What it is.
    pub name: String,
    /// Fewest cycles of the emulated run.
    pub emulated_min: u64,
    /// Mean of them.
    pub emulated_mean: f64,
    /// Most of them.
    pub emulated_max: u64,
    /// How often it was run.
    pub runs: u64,
    /// Most cycles with random inputs; 0 without.
    pub random_max: u64,
    /// Cycles that no run exceeds, whatever is measured and comes in; none where that is not worked out.
    pub bound: Option<u64>,
    /// The bound over the most of all runs.
    pub ratio: Option<f64>,
    /// Bytes of stack that no run exceeds; none where that is not worked out.
    pub stack_bytes: Option<u32>,
    /// Bytes of stack that the runs took at most.
    pub stack_emulated_bytes: u32,
    /// Of the time from one tick to the next, by the bound or else the most: per cent.
    pub budget_percent: f64,
}

/// All there is to say of a scheme on a board.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figures {
    /// What is counted: a model's cycles, never silicon's.
    pub unit: &'static str,
    /// What the image calls itself.
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
    /// The memory that the model knows.
    pub profile: &'static str,
    /// Which of the model's values, where Arm gives a range.
    pub column: &'static str,
    /// Of the board's processor.
    pub clock_hz: u32,
    /// From one tick to the next.
    pub budget_cycles: u64,
    /// A tick: frame, engine and modules.
    pub tick: Row,
    /// A tick without its modules.
    pub frame_and_engine: Row,
    /// Each module of the scheme in the order of its first call, both of its stages together.
    pub modules: Vec<Row>,
    /// The module of each call in a tick, by its place in `modules`.
    #[serde(skip)]
    pub steps: Vec<usize>,
    /// What a packet costs around the tick.
    pub packets: Vec<Row>,
    /// What applying a command costs, by kind.
    pub commands: Vec<Row>,
    /// The processor's part of an interrupt: there, back, and the float registers on top.
    pub interrupt: Vec<Row>,
    /// Instructions that were emulated.
    pub instructions: u64,
    /// Why there are no bounds; none when there are.
    pub no_bound: Option<String>,
}

impl Row {
    pub(super) fn new(name: String, statistics: &Statistics, most: Option<Most>, budget_cycles: u64) -> Self {
        let bound = most.map(|most| most.cycles);
        let most_seen = statistics.max.max(statistics.random_max);
        Self {
            name,
            emulated_min: statistics.min,
            emulated_mean: statistics.mean(),
            emulated_max: statistics.max,
            runs: statistics.count,
            random_max: statistics.random_max,
            bound,
            ratio: bound.filter(|_| most_seen > 0).map(|bound| ratio(bound, most_seen)),
            stack_bytes: most.map(|most| most.stack_bytes),
            stack_emulated_bytes: statistics.stack_bytes,
            budget_percent: 100.0 * ratio(bound.unwrap_or(most_seen), budget_cycles),
        }
    }
}

impl Figures {
    /// The picture of it.
    #[must_use]
    pub fn bars(&self) -> CycleBars {
        let bar = |row: &Row| CycleBar {
            name: row.name.clone(),
            most: row.emulated_max.max(row.random_max),
            bound: row.bound,
        };
        let Self { side, dof, image, .. } = self;
        CycleBars {
            title: format!("What a tick of the {side} takes, {dof} axes: {image}"),
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

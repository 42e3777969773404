//! `dimsart cycles --attach`: compares measurements of a controller with the model.

use std::error::Error;
use std::io::Write;
use std::time::Duration;

use comfy_table::CellAlignment;
use dimsart_core::stamp::UNSTAMPED_SUFFIX;
use dimsart_core::{Command, ModuleKinds};
use serde::Serialize;

use crate::broker;
use crate::cli::output::text_table;
use crate::connect::{ConnectError, CycleCounts, CycleStatistics, Device, Timeouts};
use crate::cycles::{Figures, Row};

const PATIENCE: Timeouts = Timeouts { timeout: Duration::from_millis(500), tries: 3 };

/// A controller with the feature `measure`.
pub(super) struct Attached {
    port: String,
    board: String,
    pub(super) image: String,
    pub(super) dof: usize,
    pub(super) commands: Vec<Command>,
    measured: CycleCounts,
}

/// Cost of a tick or module: measured and modelled.
#[derive(Debug, Serialize)]
struct Comparison<'a> {
    name: &'a str,
    runs: u32,
    measured_min: f64,
    measured_mean: f64,
    measured_max: f64,
    emulated_min: u64,
    emulated_max: u64,
    /// In cycles, also if instructions were measured.
    bound: Option<u64>,
}

/// All comparisons, as JSON.
#[derive(Debug, Serialize)]
struct Comparisons<'a> {
    image: &'a str,
    measured_unit: &'static str,
    emulated_unit: &'static str,
    bound_unit: &'static str,
    profile: &'a str,
    column: &'a str,
    /// Whether there are bounds and no measurement exceeds its bound.
    holds: bool,
    tick: &'a Comparison<'a>,
    modules: &'a [Comparison<'a>],
}

impl<'a> Comparison<'a> {
    fn new(measured: CycleStatistics, model: &'a Row) -> Self {
        let CycleStatistics { runs, min: least, mean, max: greatest } = measured;
        Self {
            name: &model.name,
            runs,
            measured_min: least,
            measured_mean: mean,
            measured_max: greatest,
            emulated_min: model.emulated_min,
            emulated_max: model.emulated_max.max(model.random_max),
            bound: model.bound,
        }
    }

    /// Returns the bound if the measurement exceeds it.
    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53")]
    fn broken(&self) -> Option<u64> {
        self.bound.filter(|bound| self.measured_max > *bound as f64)
    }

    fn cells(&self) -> [String; 8] {
        [
            self.name.to_owned(),
            self.runs.to_string(),
            format!("{:.0}", self.measured_min),
            format!("{:.0}", self.measured_mean),
            format!("{:.0}", self.measured_max),
            self.emulated_min.to_string(),
            self.emulated_max.to_string(),
            self.bound.map_or("-".to_owned(), |bound| bound.to_string()),
        ]
    }
}

impl Attached {
    /// Reads identity, scheme and measurements of the controller at a port.
    pub(super) fn greet(port: &str, baud: u32, kinds: ModuleKinds) -> Result<Self, Box<dyn Error>> {
        let at_port = |error: ConnectError| format!("{port}: {error}");
        let stream = broker::open(port, baud).map_err(ConnectError::from)?;
        let mut device = Device::identify(stream, PATIENCE, kinds).map_err(at_port)?;
        let identity = device.identity();
        let image = identity.image.trim_end_matches(UNSTAMPED_SUFFIX).to_owned();
        let (board, dof) = (identity.device.clone(), identity.axes.len());
        let Some(measured) = device.cycle_counts().map_err(at_port)? else {
            return Err(format!(
                "{port}: image `{image}` lacks the feature `measure`: run `cargo xtask flash {board},measure`"
            )
            .into());
        };
        if measured.tick.runs == 0 {
            let state = device.state().map_err(at_port)?;
            return Err(format!(
                "{port}: no measurements because no module runs ({state}): start the scheme"
            )
            .into());
        }
        let commands = device.commands().map_err(at_port)?;
        Ok(Self { port: port.to_owned(), board, image, dof, commands, measured })
    }

    pub(super) fn counts_instructions(&self) -> bool {
        self.measured.is_instructions
    }

    /// Prints measurements next to the model, warns of exceeded bounds, and optionally writes JSON. Returns whether all
    /// bounds hold.
    pub(super) fn print(
        self,
        out: &mut dyn Write,
        json: Option<&mut dyn Write>,
        figures: &Figures,
    ) -> Result<bool, Box<dyn Error>> {
        let Self { port, board, image, dof, measured, .. } = &self;
        if measured.calls.len() != figures.steps.len() {
            return Err(format!(
                "{port}: {} module calls measured, but the scheme has {} calls: the scheme changed during the \
                 measurement, try again",
                measured.calls.len(),
                figures.steps.len()
            )
            .into());
        }
        let tick = Comparison::new(measured.tick, &figures.tick);
        let mut modules = Vec::new();
        for (place, module) in figures.modules.iter().enumerate() {
            let own = figures.steps.iter().zip(&measured.calls).filter(|(step, _)| **step == place);
            let sum = own.map(|(_, call)| *call).reduce(CycleStatistics::followed_by);
            modules.extend(sum.map(|sum| Comparison::new(sum, module)));
        }
        let Figures { profile, column, unit, .. } = *figures;
        let measured_unit = if measured.is_instructions { "instructions" } else { "cycles" };
        writeln!(out, "{board} at {port}, {dof} axes, `{image}`")?;
        if measured.is_instructions {
            writeln!(
                out,
                "measured and emulated: INSTRUCTIONS (an emulated board has no cycle counter); bound: {unit} (memory \
                 {profile}, column {column})"
            )?;
        } else {
            writeln!(
                out,
                "measured: processor cycles; emulated and bound: {unit} (memory {profile}, column {column})"
            )?;
        }
        let mut table = text_table();
        table.set_header(["", "runs", "measured min", "mean", "max", "emulated min", "max", "bound"]);
        table.add_row(tick.cells());
        for module in &modules {
            table.add_row(module.cells());
        }
        table.column_iter_mut().skip(1).for_each(|column| column.set_cell_alignment(CellAlignment::Right));
        writeln!(out, "{table}")?;
        let rows = std::iter::once(&tick).chain(&modules);
        let broken: Vec<_> = rows.filter_map(|row| Some((row, row.broken()?))).collect();
        let holds = figures.no_bound.is_none() && broken.is_empty();
        for (row, bound) in broken {
            writeln!(
                out,
                "WARNING: {} took {:.0} {measured_unit}, above its bound of {bound} for memory `{profile}`. Check that the \
                 board runs from this memory (other memory: --profile flash) and that no interrupt adds cycles. \
                 `cargo xtask step cycle-table {board}` compares the model with the chip",
                row.name, row.measured_max
            )?;
        }
        if let Some(json) = json {
            let emulated_unit = if measured.is_instructions { measured_unit } else { unit };
            let comparisons = Comparisons {
                image,
                measured_unit,
                emulated_unit,
                bound_unit: unit,
                profile,
                column,
                holds,
                tick: &tick,
                modules: &modules,
            };
            writeln!(json, "{}", serde_json::to_string(&comparisons)?)?;
        }
        Ok(holds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUND: u64 = 120;

    fn model(name: &str) -> Row {
        Row {
            name: name.to_owned(),
            emulated_min: 90,
            emulated_mean: 95.0,
            emulated_max: 100,
            runs: 10,
            random_max: 110,
            bound: Some(BOUND),
            ratio: None,
            stack_bytes: None,
            stack_emulated_bytes: 0,
            budget_percent: 0.0,
        }
    }

    fn figures(no_bound: Option<String>) -> Figures {
        Figures {
            unit: "cycles",
            image: "image".into(),
            side: "master".to_owned(),
            scheme: "scheme".into(),
            dof: 1,
            ticks: 10,
            random_ticks: 0,
            profile: "0ws",
            column: "upper",
            clock_hz: 1,
            budget_cycles: 1,
            tick: model("tick"),
            frame_and_engine: model("frame and engine"),
            modules: vec![model("PDCTRL_MOD")],
            steps: vec![0],
            packets: Vec::new(),
            commands: Vec::new(),
            interrupt: Vec::new(),
            instructions: 0,
            no_bound,
        }
    }

    /// Whether the bound holds, as returned and in the JSON, and the text.
    fn printed(greatest: f64, figures: &Figures) -> (bool, bool, String) {
        let row = |max| CycleStatistics { runs: 1, min: 90.0, mean: 95.0, max };
        let measured = CycleCounts { tick: row(100.0), calls: vec![row(greatest)], is_instructions: false };
        let [port, board, image] = ["port", "board", "image"].map(str::to_owned);
        let attached = Attached { port, board, image, dof: 1, commands: Vec::new(), measured };
        let (mut out, mut json) = (Vec::new(), Vec::new());
        let holds = attached.print(&mut out, Some(&mut json), figures).unwrap();
        let text = String::from_utf8(out).unwrap();
        let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
        (holds, json["holds"].as_bool().unwrap(), text)
    }

    #[test]
    fn a_bound_that_is_broken_holds_no_more() {
        let figures = figures(None);
        let (holds, in_json, text) = printed(BOUND as f64, &figures);
        assert!(holds && in_json && !text.contains("WARNING"), "{text}");
        let (holds, in_json, text) = printed(BOUND as f64 + 1.0, &figures);
        assert!(!holds && !in_json && text.contains("WARNING: PDCTRL_MOD took 121 cycles"), "{text}");
    }

    #[test]
    fn no_bound_holds_nothing() {
        let (holds, in_json, _) = printed(100.0, &figures(Some("a call through a pointer".into())));
        assert!(!holds && !in_json);
    }
}

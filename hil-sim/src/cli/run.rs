//! `dimsart run`: runs a scenario and writes its report.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::{Args, Parser};
use comfy_table::{CellAlignment, Table};
use indicatif::{ProgressBar, ProgressStyle};

use super::Ending;
use crate::experiment::{self, Experiment, Side};
use crate::outcome::Outcome;
use crate::pictures::figures;
use crate::report::{self, Fact, Report, Table as ReportTable};
use crate::scenario::Scenario;

/// Run a scenario: both sides against simulated plants, or one side in real time.
#[derive(Debug, Args)]
pub(super) struct Run {
    /// Scenario file (TOML) with what differs from the default scenario; none for the default.
    scenario: Option<PathBuf>,
    /// Changes one setting, such as `link.loss=0.1`; can be given often.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Folder for the report.
    #[arg(long, default_value = "runs/latest")]
    out: PathBuf,
    /// Runs only this side, in real time, and talks to the other side's process over UDP.
    #[arg(long)]
    side: Option<Side>,
    /// Prints the figures as one JSON object, the last line of standard output.
    #[arg(long)]
    json: bool,
    /// Writes no report.
    #[arg(long)]
    no_report: bool,
    /// Lists every setting with its default, and runs nothing.
    #[arg(long)]
    keys: bool,
}

impl Default for Run {
    /// As without any argument.
    fn default() -> Self {
        #[derive(Parser)]
        struct Alone {
            #[command(flatten)]
            run: Run,
        }
        Alone::parse_from(["run"]).run
    }
}

impl Run {
    pub(super) fn execute(self) -> Ending {
        if self.keys {
            println!("{}", crate::scenario::SHIPPED.trim_end());
            return Ok(ExitCode::SUCCESS);
        }
        let scenario = Scenario::load(self.scenario.as_deref(), &self.sets)?;
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed))?;
        let experiment = match self.side {
            None => Experiment::new(&scenario)?,
            Some(side) => {
                eprintln!("{}: waiting for the other side", side.name());
                Experiment::one_side(&scenario, side, &stop)?
            }
        };
        let bar = progress_bar(experiment.duration_s());
        let run = experiment.run(&stop, |time_s| bar.set_position(milliseconds(time_s)));
        bar.finish_and_clear();
        print_summary(&run.outcome);
        if !self.no_report {
            self.write_report(&scenario, &run)?;
        }
        if self.json {
            println!("{}", serde_json::to_string(&run.outcome)?);
        }
        Ok(ExitCode::SUCCESS)
    }

    fn write_report(&self, scenario: &Scenario, run: &experiment::Run) -> Result<(), report::ReportError> {
        let sides = self.side.map_or("both sides", Side::name);
        let report = Report {
            title: format!("Bilateral control over a delayed link: {sides}"),
            summary: summary(&run.outcome),
            axes: axes(&run.outcome),
            faults: run.outcome.faults.clone(),
            figures: figures(&run.recording, &run.phases, scenario.dof),
            tick_maps: run.tick_maps.clone(),
            settings_toml: scenario.to_toml(),
            recording: &run.recording,
        };
        let bar = ProgressBar::new(0).with_message("report");
        bar.set_style(style("{msg} [{bar:40}] {pos}/{len} files"));
        let written = report::write(&self.out, &report, &bar)?;
        bar.finish_and_clear();
        println!("report: {}", written.page.display());
        Ok(())
    }
}

fn progress_bar(duration_s: f64) -> ProgressBar {
    let bar = ProgressBar::new(milliseconds(duration_s));
    bar.set_style(style("simulating [{bar:40}] {percent}% {msg}"));
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}

/// The template is fixed; a wrong one would only lose the decoration.
fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

fn milliseconds(time_s: f64) -> u64 {
    u64::try_from(Duration::from_secs_f64(time_s).as_millis()).unwrap_or(u64::MAX)
}

fn print_summary(outcome: &Outcome) {
    let mut table = Table::new();
    for fact in summary(outcome) {
        table.add_row([fact.name, fact.value, fact.unit, fact.note]);
    }
    align_right(&mut table, 1..2);
    println!("{table}");
    let axes = axes(outcome);
    let mut table = Table::new();
    table.set_header(&axes.header);
    table.add_rows(axes.rows);
    align_right(&mut table, 0..4);
    println!("{table}");
    for fault in &outcome.faults {
        println!("fault: {fault}");
    }
}

fn align_right(table: &mut Table, columns: std::ops::Range<usize>) {
    for column in columns {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
}

fn summary(outcome: &Outcome) -> Vec<Fact> {
    let fact = |name: &str, value: String, unit: &str, note: &str| Fact {
        name: name.to_owned(),
        value,
        unit: unit.to_owned(),
        note: note.to_owned(),
    };
    let stable = if outcome.stable { "yes" } else { "NO" };
    let passive = if outcome.energy_min_j < 0.0 { "below 0: not passive" } else { "never below 0: passive" };
    let round_trip = outcome.round_trip_ticks.map_or("unknown".to_owned(), |ticks| ticks.to_string());
    vec![
        fact("stable", stable.to_owned(), "", "every position, force and wave in its declared range"),
        fact("simulated", format!("{:.3}", outcome.simulated_s), "s", &format!("{} ticks", outcome.ticks)),
        fact(
            "took",
            format!("{:.3}", outcome.wall_s),
            "s",
            &format!("{:.0} times real time", outcome.realtime_factor),
        ),
        fact("round trip", round_trip, "ticks", "of the waves, measured"),
        fact("smallest channel energy", format!("{:.3e}", outcome.energy_min_j), "J", passive),
    ]
}

fn axes(outcome: &Outcome) -> ReportTable {
    let number = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.3}"));
    let row = |axis: &crate::outcome::AxisOutcome| {
        let (felt, predicted) = (axis.k_felt_n_per_m, axis.k_predicted_n_per_m);
        let error = felt.zip(predicted).map(|(felt, predicted)| (felt - predicted) / predicted);
        let error = error.map_or("not in contact".to_owned(), |error| format!("{error:+.1e}"));
        vec![axis.axis.to_string(), number(felt), number(predicted), error]
    };
    let header = ["axis", "felt stiffness (N/m)", "predicted (N/m)", "relative difference"];
    ReportTable { header: header.map(str::to_owned).to_vec(), rows: outcome.axes.iter().map(row).collect() }
}

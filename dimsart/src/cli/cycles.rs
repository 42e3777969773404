//! `dimsart cycles`: cycles and stack of a scheme on a board, from its image.

mod attach;

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use ::cycles::timing::{Column, Timing};
use attach::Attached;
use clap::{Args, ValueEnum};
use comfy_table::CellAlignment;
use dimsart_core::ModuleKinds;
use dimsart_link::protocol::DEFAULT_BAUD;
use indicatif::{ProgressBar, ProgressStyle};

use super::Ending;
use super::output::{say, text_table};
use crate::cycles::{Figures, Firmware, Memory, Row, Setup, UNIT, measure};
use crate::{report, rig_argument};

/// Measure the cycles and stack of a scheme on a board, and compute their bounds.
///
/// Runs the functions of the board's image in an emulated Cortex-M4F with every input of a simulated run; the outputs must
/// equal the simulation bit by bit. Cycles come from a model based on Arm's tables, not from silicon. With --attach,
/// compares the model with the measurements of a board (docs/cycles.md). Exit status: 0 success, 1 no bound, or a
/// measurement above its bound.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Cycles {
    /// Firmware image (ELF; default: built by `cargo board BOARD`).
    elf: Option<PathBuf>,
    /// Board of the image.
    #[arg(long, value_name = "BOARD")]
    board: Option<String>,
    /// Scheme file or built-in scheme (default: the scenario's scheme).
    #[arg(long, value_name = "FILE")]
    scheme: Option<String>,
    /// Side of the controller.
    #[arg(long, default_value = "master", value_parser = super::side::side())]
    side: &'static str,
    /// Degrees of freedom of the device, 1 to 8 (default: the scenario's number).
    #[arg(long, value_name = "COUNT")]
    dof: Option<usize>,
    /// Change a setting of the scenario, such as `duration_s=2`; repeatable.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Number of ticks with random inputs after the scenario.
    #[arg(long, value_name = "COUNT", default_value_t = 10_000)]
    random_ticks: u64,
    /// Compare the model with the cycles measured by the controller at PORT.
    ///
    /// Needs an image with the feature `measure`. The controller reports its scheme and board.
    #[arg(long, value_name = "PORT", conflicts_with_all = ["board", "scheme", "dof"])]
    attach: Option<String>,
    /// Baud rate of the serial port given with --attach.
    #[arg(long, default_value_t = DEFAULT_BAUD)]
    baud: u32,
    /// Memory from which instructions are fetched (default: the board's memory).
    #[arg(long)]
    profile: Option<Memory>,
    /// Cycle count of the model for instructions with a range in Arm's tables.
    #[arg(long, default_value = "upper")]
    column: Value,
    /// Folder of the picture.
    #[arg(long, value_name = "FOLDER", default_value = "runs/cycles")]
    out: PathBuf,
    /// Do not draw the picture.
    #[arg(long)]
    no_picture: bool,
    /// Print the figures as one JSON object; the table goes to standard error.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  dimsart cycles                                     the image built last, master of the shipped scheme
  dimsart cycles --board nucleo-g474re --side slave
  dimsart cycles firmware.elf --scheme my.scheme --dof 1
  dimsart cycles --attach /dev/ttyACM0               compare measurements with the model
  dimsart cycles --set duration_s=1 --json           for programs";

/// Column of the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Value {
    /// The most frequent value.
    Likely,
    /// The maximum.
    Upper,
}

impl Cycles {
    pub(super) fn execute(self, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
        let attached =
            self.attach.as_deref().map(|port| Attached::greet(port, self.baud, kinds)).transpose()?;
        let mut sets = self.sets;
        let dof = attached.as_ref().map(|attached| attached.dof);
        sets.extend(dof.or(self.dof).map(|dof| format!("dof={dof}")));
        if let Some(scheme) = &self.scheme {
            sets.extend(["master", "slave"].map(|side| format!("{side}.scheme={scheme}")));
        }
        let rig = rig_argument::read(None, &sets, kinds)?;
        let elf = self.elf.as_deref();
        let firmware = match &attached {
            Some(attached) => Firmware::find_by_name(elf, &attached.image)?,
            None => Firmware::find(elf, self.board.as_deref())?,
        };
        let memory = self.profile.unwrap_or_else(|| firmware.memory());
        let (column, column_name) = match self.column {
            Value::Likely => (Column::Likely, "typical"),
            Value::Upper => (Column::Upper, "upper"),
        };
        let setup = Setup {
            firmware: &firmware,
            rig: &rig,
            side: self.side,
            commands: attached.as_ref().map(|attached| attached.commands.as_slice()),
            timing: Timing::new(memory.profile(), column),
            counts_instructions: attached.as_ref().is_some_and(Attached::counts_instructions),
            random_ticks: self.random_ticks,
            profile: memory.name(),
            column: column_name,
        };
        let bar = progress_bar();
        let figures = measure(&setup, |tick, ticks| {
            bar.set_length(ticks);
            bar.set_position(tick);
        });
        bar.finish_and_clear();
        let figures = figures?;
        if let Some(attached) = attached {
            let holds = match self.json {
                true => attached.print(&mut std::io::stderr().lock(), Some(out), &figures),
                false => attached.print(out, None, &figures),
            }?;
            let ending = if holds { ExitCode::SUCCESS } else { ExitCode::FAILURE };
            return figures.no_bound.map_or(Ok(ending), |reason| Err(reason.into()));
        }
        say(self.json, out, |text| print(text, &figures))?;
        if !self.no_picture {
            let svg = report::write_cycles(&self.out, &figures.bars())?;
            say(self.json, out, |text| writeln!(text, "picture: {}", svg.display()))?;
        }
        if self.json {
            writeln!(out, "{}", serde_json::to_string(&figures)?)?;
        }
        figures.no_bound.map_or(Ok(ExitCode::SUCCESS), |reason| Err(reason.into()))
    }
}

fn progress_bar() -> ProgressBar {
    let bar = ProgressBar::new(0);
    // The template is constant and valid; the default is a fallback.
    let style = ProgressStyle::with_template("emulating [{bar:40}] {pos}/{len} ticks, {eta} left");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}

fn print(out: &mut dyn Write, figures: &Figures) -> std::io::Result<()> {
    let Figures { image, side, scheme, dof, ticks, profile, column, budget_cycles, .. } = figures;
    writeln!(
        out,
        "{scheme} on the {side}, {dof} axes, {ticks} ticks of `{image}`: bit-identical to the host.\n\
         {UNIT} (memory {profile}, column {column}); tick period: {budget_cycles} cycles"
    )?;
    let mut table = text_table();
    table.set_header([
        "",
        "min",
        "mean",
        "max",
        "random max",
        "bound",
        "ratio",
        "stack (B)",
        "stack bound",
        "% of a tick",
    ]);
    for column in 1..=9 {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    let modules = figures.modules.iter().map(|row| (format!("  {}", row.name), row));
    let whole = [&figures.tick, &figures.frame_and_engine].map(|row| (row.name.clone(), row));
    let packets = figures.packets.iter().filter(|row| row.runs > 0);
    let rest = packets.map(|row| (row.name.clone(), row));
    let commands = figures.commands.iter().map(|row| (format!("command {}", row.name), row));
    let interrupt = figures.interrupt.iter().map(|row| (row.name.clone(), row));
    for (name, row) in whole.into_iter().chain(modules).chain(rest).chain(commands).chain(interrupt) {
        table.add_row(cells(name, row));
    }
    writeln!(out, "{table}")
}

fn cells(name: String, row: &Row) -> [String; 10] {
    let known = |number: Option<u64>| number.map_or("-".to_owned(), |number| number.to_string());
    [
        name,
        row.emulated_min.to_string(),
        format!("{:.1}", row.emulated_mean),
        row.emulated_max.to_string(),
        known(Some(row.random_max).filter(|cycles| *cycles > 0)),
        known(row.bound),
        row.ratio.map_or("-".to_owned(), |ratio| format!("{ratio:.3}")),
        row.stack_emulated_bytes.to_string(),
        known(row.stack_bytes.map(u64::from)),
        format!("{:.2}", row.budget_percent),
    ]
}

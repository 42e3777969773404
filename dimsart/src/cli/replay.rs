//! `dimsart replay`: runs a recording through the core again.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Args;
use dimsart_core::Kinds;
use indicatif::ProgressBar;

use super::{Ending, NOT_STABLE};
use crate::replay::{self, Replayed};

/// Run a recording through the core again, and compare every signal of every tick, bit by bit.
///
/// Takes `signals.mcap` of `dimsart run --signals mcap` or `dimsart serve --record`: what went into each controller is in it,
/// commands and packets of links among it. What emulated firmware was recorded to make (`run --target`), the core here must
/// make, too. A difference names the tick, the module and the signal.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Replay {
    /// The recording.
    file: PathBuf,
    /// Prints one JSON object.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  dimsart run joint --signals mcap && dimsart replay runs/latest/signals.mcap
  dimsart run --target mps2-an386 --signals mcap && dimsart replay runs/latest/signals.mcap
  dimsart serve joint --record runs/tuning           until Ctrl-C, with all that was tuned meanwhile
  dimsart replay runs/tuning/signals.mcap

Exit status: 0 all the same, 3 something differs, 1 it cannot be replayed, 2 wrong usage.";

impl Replay {
    pub(super) fn execute(self, kinds: Kinds, out: &mut impl Write) -> Ending {
        let bar = ProgressBar::new_spinner();
        bar.enable_steady_tick(Duration::from_millis(100));
        let start = Instant::now();
        let replayed =
            replay::replay(&self.file, kinds, |time_s| bar.set_message(format!("{time_s:.1} s replayed")));
        bar.finish_and_clear();
        let replayed = replayed?;
        let took_s = start.elapsed().as_secs_f64();
        if self.json {
            writeln!(out, "{}", serde_json::to_string(&replayed)?)?;
        } else {
            replayed.controllers.iter().try_for_each(|controller| print(out, controller))?;
            if replayed.is_cut {
                writeln!(
                    out,
                    "the recording was not finished, as that of a run that was killed: replayed as far as it goes"
                )?;
            }
            let recorded_s = replayed.recorded_s;
            let times = recorded_s / took_s;
            writeln!(out, "{recorded_s:.3} s of recording in {took_s:.3} s: {times:.0} times real time")?;
        }
        Ok(if replayed.diverges() { ExitCode::from(NOT_STABLE) } else { ExitCode::SUCCESS })
    }
}

fn print(out: &mut impl Write, replayed: &Replayed) -> std::io::Result<()> {
    let Replayed { name, ticks, commands, words, differing_rows, divergence } = replayed;
    match divergence {
        None => writeln!(out, "{name}: {ticks} ticks, {commands} commands, {words} words: all the same"),
        Some(divergence) => writeln!(
            out,
            "{name}: {ticks} ticks, {commands} commands, {words} words: DIFFERENT in {differing_rows} rows, first in\n  {divergence}"
        ),
    }
}

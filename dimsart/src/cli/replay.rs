//! `dimsart replay`: replays a recording through the core.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Args;
use dimsart_core::ModuleKinds;
use indicatif::ProgressBar;

use super::{Ending, NOT_STABLE};
use crate::replay::{self, ReplayOutcome};

/// Replay a recording through the core, and compare all signals bit by bit.
///
/// Reads `signals.mcap` of `dimsart run --signals mcap` or `dimsart serve --record`. This file contains all inputs of each
/// controller before each tick: device, scheme, commands, permission to move, packets of links, measurements of the device.
/// A recording of emulated firmware (`run --target`) must give identical bits in this core. The first difference is reported
/// with tick, module and signal; if several signals of a tick differ, the signal that is computed first is reported.
///
/// Recordings of `dimsart record`, of older versions, and of an emulated board whose links have a key cannot be replayed.
/// If the recording program was killed or the power failed, the replay ends at the last complete record and prints a note.
/// For a damaged file, the error message contains the byte offset of the damaged record.
///
/// In the file, topic /NAME contains the signals of controller NAME; after a change that adds signals, topic /NAME/2
/// continues /NAME. Topic /NAME/inputs contains the inputs of the controller. Messages start with `tick` and `time_s`.
/// `log_time` is wall-clock time, so that recordings of several devices and cameras can be merged. In a simulated run,
/// `log_time` counts from the creation of the file. In real time, `log_time` is derived from the arrival of the rows, and
/// includes the delay of the line. The profile is `ros2`: Foxglove, `PlotJuggler` and `AnyReader` of `rosbags` open the file.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Replay {
    /// Recording (MCAP).
    file: PathBuf,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  dimsart run joint --signals mcap && dimsart replay runs/latest/signals.mcap
  dimsart run --target mps2-an386 --signals mcap && dimsart replay runs/latest/signals.mcap
  dimsart serve joint --record runs/tuning           record until Ctrl-C, with all changes
  dimsart replay runs/tuning/signals.mcap

Exit status: 0 identical, 1 not replayable, 2 wrong usage, 3 different.";

impl Replay {
    pub(super) fn execute(self, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
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
                    "incomplete recording (was the recording program killed?): replayed up to the last complete record"
                )?;
            }
            let recorded_s = replayed.recorded_s;
            let times = recorded_s / took_s;
            writeln!(out, "replayed {recorded_s:.3} s in {took_s:.3} s: {times:.0} times real time")?;
        }
        Ok(if replayed.diverges() { ExitCode::from(NOT_STABLE) } else { ExitCode::SUCCESS })
    }
}

fn print(out: &mut impl Write, replayed: &ReplayOutcome) -> std::io::Result<()> {
    let ReplayOutcome { name, ticks, commands, words, differing_rows, divergence } = replayed;
    match divergence {
        None => writeln!(out, "{name}: {ticks} ticks, {commands} commands, {words} words: identical"),
        Some(divergence) => writeln!(
            out,
            "{name}: {ticks} ticks, {commands} commands, {words} words: DIFFERENT in {differing_rows} rows; first \
             difference:\n  {divergence}"
        ),
    }
}

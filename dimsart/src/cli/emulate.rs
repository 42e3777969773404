//! `dimsart emulate`: boots a firmware image in an emulated chip.

use std::io::{Read as _, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use chips::{BOARDS, Bench, Board};
use clap::Args;
use hil_sim::clock;
use hil_sim::pace::TickPacer;
use hil_sim::pipe::{self, Pipe};

use super::run::stop_on_interrupt;
use super::{Ending, UsageError};
use crate::broker::{SIMULATED, SharedPort};
use crate::cycles::Firmware;

/// Boot a firmware image in an emulated STM32G4 and report rule violations.
///
/// Runs the unchanged image of the board, with start-up, flash, log and watchdog. The image runs in real time until Ctrl-C,
/// and its command line is a port for other `dimsart` commands. With --seconds, the image runs without a command line, as
/// fast as possible. Exit status: 0 success, 1 a violation of the chip's rules, a fault or a reset.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Emulate {
    /// Board, such as nucleo-g474re.
    #[arg(value_parser = clap::builder::PossibleValuesParser::new(BOARDS.iter().map(|board| board.name)))]
    board: String,
    /// Firmware image (ELF; default: built by `cargo board BOARD`).
    elf: Option<PathBuf>,
    /// Stop after this simulated time, s. No port is offered.
    #[arg(long, value_name = "SECONDS")]
    seconds: Option<f64>,
}

const EXAMPLES: &str = "\
Examples:
  dimsart emulate nucleo-g474re                      serve the board's command line as sim:nucleo-g474re
  dimsart connect sim:nucleo-g474re show             connect from another terminal
  dimsart emulate b-g431b-esc1 my.elf --seconds 10   run for 10 s, ten thousand ticks

The emulated board has no motor: encoders do not move. The emulation was not compared with a real
chip yet (docs/emulated-chip.md).";

/// Simulated time between two exchanges with the line.
const PIECE_S: f64 = 1e-3;
/// Simulated time after which a board answers.
const START_S: f64 = 0.1;

impl Emulate {
    pub(super) fn execute(self, out: &mut impl Write) -> Ending {
        let board =
            Board::find(&self.board).ok_or_else(|| UsageError(format!("unknown board {}", self.board)))?;
        let firmware = Firmware::find(self.elf.as_deref(), Some(board.firmware))?;
        let mut bench = Bench::new(board, firmware.image)?;
        let stop = stop_on_interrupt()?;
        match self.seconds {
            Some(seconds) => {
                let end_s = seconds.max(0.0);
                while bench.time_s() < end_s && !stop.load(Ordering::Relaxed) {
                    bench.run_for(PIECE_S.min(end_s - bench.time_s()))?;
                }
            }
            None => serve(&mut bench, &stop, out)?,
        }
        let verdict = bench.verdict();
        writeln!(out, "{verdict}")?;
        Ok(if verdict.is_well() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}

/// Serves the board's command line in real time.
fn serve(
    bench: &mut Bench,
    stop: &Arc<AtomicBool>,
    out: &mut impl Write,
) -> Result<(), Box<dyn std::error::Error>> {
    bench.run_for(START_S)?;
    let port = format!("{SIMULATED}{}", bench.board.name);
    let [theirs, mut ours] = pipe::pair([Duration::from_millis(1), Duration::ZERO]);
    let _shared = SharedPort::new(&port, Box::new(theirs))?;
    writeln!(out, "{port} runs until Ctrl-C: dimsart connect {port}")?;
    out.flush()?;
    let mut pace = TickPacer::new(clock::now(), PIECE_S);
    while !stop.load(Ordering::Relaxed) {
        if let Some(skipped) = pace.wait_or_skip(bench.time_s() - START_S) {
            eprintln!("dimsart: {skipped}");
        }
        exchange(bench, &mut ours);
        bench.run_for(PIECE_S)?;
    }
    Ok(())
}

fn exchange(bench: &mut Bench, line: &mut Pipe) {
    let mut bytes = [0; 256];
    while let Ok(count @ 1..) = line.read(&mut bytes) {
        bench.send(bytes.get(..count).unwrap_or_default());
    }
    let answer = bench.take_received();
    if !answer.is_empty() {
        // Lost without a reader, as on a cable.
        let _ = line.write(&answer);
    }
}

//! `dimsart record`: every tick of a controller into a file.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use clap::Args;
use dimsart_core::Kinds;
use dimsart_link::protocol::DEFAULT_BAUD;

use super::Ending;
use super::run::stop_on_interrupt;
use crate::broker;
use crate::connect::{ConnectError, Device, Patience, Tap};
use crate::report::SignalsKind;
use crate::tap_file::{self, Next, TapFile};

const PATIENCE: Patience = Patience { timeout: Duration::from_millis(500), tries: 3 };
/// How often rows go to the file.
const A_MOMENT: Duration = Duration::from_millis(50);
/// Until the device sends something.
const TO_BEGIN: Duration = Duration::from_secs(10);
/// From one line about the progress to the next.
const PROGRESS: Duration = Duration::from_secs(1);

/// Record a controller's signals, tick by tick, with its scheme, until Ctrl-C.
///
/// A simulated controller sends every tick of all its signals; a board those that its one stream takes (4 signals, 12 words),
/// to one client at a time. What the line had no room for is counted: it is no number in the file, or has no row there.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Record {
    /// Serial port such as `/dev/ttyACM0`, `tcp:HOST:PORT`, `unix:PATH`, or `sim:NAME` of a `dimsart serve`.
    port: String,
    /// Signals, such as `POSITION`; all, or the first ones that the device can send, when none is named.
    #[arg(value_name = "SIGNAL")]
    names: Vec<String>,
    /// Folder for the file.
    #[arg(long, value_name = "FOLDER", default_value = "runs/record")]
    out: PathBuf,
    /// How signals are written.
    #[arg(long, value_enum, default_value_t = SignalsKind::Mcap)]
    signals: SignalsKind,
    /// Ticks from one row to the next.
    #[arg(long, value_name = "TICKS", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    every_ticks: u32,
    /// Ends by itself after so long, s.
    #[arg(long, value_name = "SECONDS", value_parser = super::line::seconds)]
    duration_s: Option<Duration>,
    /// Bits per second of a serial port.
    #[arg(long, default_value_t = DEFAULT_BAUD)]
    baud: u32,
}

const EXAMPLES: &str = "\
Examples:
  dimsart record sim:joint                                  all signals of every tick, with the scheme: runs/record/signals.mcap
  dimsart record /dev/ttyACM0 POSITION DES_FORCE            those of them that matter, of a board
  dimsart record /dev/ttyACM0 --every-ticks 10 --signals csv
  dimsart record sim:joint --duration-s 60 --out runs/a-minute";

impl Record {
    pub(super) fn execute(self, kinds: Kinds, out: &mut impl Write) -> Ending {
        let stop = stop_on_interrupt()?;
        let line = broker::open(&self.port, self.baud).map_err(ConnectError::from)?;
        let mut device = Device::greet(line, PATIENCE, kinds)?;
        device.require_signals(&self.names)?;
        let mut tap = Tap::new(self.every_ticks).of(&self.names);
        let (start, mut told) = (Instant::now(), Instant::now());
        let is_shown = std::io::stderr().is_terminal();
        let is_over = || self.duration_s.is_some_and(|duration| start.elapsed() >= duration);
        // An older file stays until there is something to be recorded.
        let mut rows = device.tap(&mut tap, A_MOMENT)?;
        while tap.signals().is_empty() {
            if start.elapsed() > TO_BEGIN || stop.load(Ordering::Relaxed) {
                let port = &self.port;
                let reason = format!(
                    "{port} sends no signals: another client has what it can send, as a page or another `record`; end \
                     it, and begin again 5 s later"
                );
                return Err(reason.into());
            }
            rows = device.tap(&mut tap, A_MOMENT)?;
        }
        let format = tap_file::format(&mut device, &self.port, self.every_ticks, self.signals)?;
        let mut file = TapFile::create(&self.out, device.identity(), self.every_ticks, format)?;
        let mut why = "";
        while !stop.load(Ordering::Relaxed) && !is_over() {
            match file.add(tap.signals(), &rows) {
                Next::GoesOn => {}
                Next::Ends(reason) => {
                    why = reason;
                    break;
                }
                Next::NoDisk => break,
            }
            rows = match device.tap(&mut tap, A_MOMENT) {
                Ok(rows) => rows,
                Err(error) => {
                    // What there is stays.
                    writeln!(out, "{}", file.finish(tap.lost(), "")?)?;
                    return Err(error.into());
                }
            };
            if is_shown && told.elapsed() > PROGRESS {
                told = Instant::now();
                eprint!("\r{} rows, {} samples lost ", file.rows(), tap.lost());
            }
        }
        if is_shown {
            eprint!("\r");
        }
        writeln!(out, "{}", file.finish(tap.lost(), why)?)?;
        Ok(ExitCode::SUCCESS)
    }
}

//! `dimsart record`: records a controller's signals to a file.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use clap::Args;
use dimsart_core::ModuleKinds;
use dimsart_link::protocol::DEFAULT_BAUD;

use super::Ending;
use super::run::stop_on_interrupt;
use crate::broker;
use crate::connect::{ConnectError, Device, Subscription, Timeouts};
use crate::report::SignalsKind;
use crate::tap_file::{self, Next, TapFile};

const PATIENCE: Timeouts = Timeouts { timeout: Duration::from_millis(500), tries: 3 };
/// Interval between writes.
const A_MOMENT: Duration = Duration::from_millis(50);
/// Timeout of the first row.
const TO_BEGIN: Duration = Duration::from_secs(10);
/// Interval of the progress line.
const PROGRESS: Duration = Duration::from_secs(1);

/// Record a controller's signals tick by tick, with its scheme.
///
/// Records until Ctrl-C or for --duration-s. A simulated controller sends every tick of all signals. A board has one stream
/// of up to 4 signals and 12 words, for one client at a time. The command counts samples lost on the line; a lost sample is
/// NaN in the file, or its row is missing. The file lacks the controller's inputs and cannot be replayed.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Record {
    /// Port, such as `/dev/ttyACM0`, `tcp:HOST:PORT`, `unix:PATH` or `sim:NAME`.
    ///
    /// `sim:NAME` is a controller simulated by `dimsart serve`.
    port: String,
    /// Signals to record, such as `POSITION` (default: all signals that the device can send).
    #[arg(value_name = "SIGNAL")]
    names: Vec<String>,
    /// Folder of the recording.
    #[arg(long, value_name = "FOLDER", default_value = "runs/record")]
    out: PathBuf,
    /// Format of the recording.
    #[arg(long, value_enum, default_value_t = SignalsKind::Mcap)]
    signals: SignalsKind,
    /// Interval between rows, ticks.
    #[arg(long, value_name = "TICKS", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    every_ticks: u32,
    /// Stop recording after this time, s (default: at Ctrl-C).
    #[arg(long, value_name = "SECONDS", value_parser = super::line::seconds)]
    duration_s: Option<Duration>,
    /// Baud rate of a serial port.
    #[arg(long, default_value_t = DEFAULT_BAUD)]
    baud: u32,
}

const EXAMPLES: &str = "\
Examples:
  dimsart record sim:joint                                  all signals, every tick, to runs/record/signals.mcap
  dimsart record /dev/ttyACM0 POSITION DES_FORCE            two signals of a board
  dimsart record /dev/ttyACM0 --every-ticks 10 --signals csv
  dimsart record sim:joint --duration-s 60 --out runs/a-minute";

impl Record {
    pub(super) fn execute(self, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
        let stop = stop_on_interrupt()?;
        let line = broker::open(&self.port, self.baud).map_err(ConnectError::from)?;
        let mut device = Device::identify(line, PATIENCE, kinds)?;
        device.require_signals(&self.names)?;
        let mut tap = Subscription::new(self.every_ticks).with_signals(&self.names);
        let (start, mut told) = (Instant::now(), Instant::now());
        let is_shown = std::io::stderr().is_terminal();
        let is_over = || self.duration_s.is_some_and(|duration| start.elapsed() >= duration);
        // An older file is kept until the first row.
        let mut rows = device.receive_rows(&mut tap, A_MOMENT)?;
        while tap.signals().is_empty() {
            if start.elapsed() > TO_BEGIN || stop.load(Ordering::Relaxed) {
                let port = &self.port;
                let reason = format!(
                    "{port} sent no signals: another client (a page or `dimsart record`) uses the signal stream: close \
                     this client and retry after 5 s"
                );
                return Err(reason.into());
            }
            rows = device.receive_rows(&mut tap, A_MOMENT)?;
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
                Next::WriteFailed => break,
            }
            rows = match device.receive_rows(&mut tap, A_MOMENT) {
                Ok(rows) => rows,
                Err(error) => {
                    // Keeps the rows received so far.
                    writeln!(out, "{}", file.finish(tap.lost_samples(), "")?)?;
                    return Err(error.into());
                }
            };
            if is_shown && told.elapsed() > PROGRESS {
                told = Instant::now();
                eprint!("\r{} rows, {} samples lost ", file.rows(), tap.lost_samples());
            }
        }
        if is_shown {
            eprint!("\r");
        }
        writeln!(out, "{}", file.finish(tap.lost_samples(), why)?)?;
        Ok(ExitCode::SUCCESS)
    }
}

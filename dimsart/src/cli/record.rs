//! `dimsart record`: every tick of a controller into a file.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use clap::Args;
use dimsart_core::protocol::DEFAULT_BAUD;

use super::Ending;
use super::run::stop_on_interrupt;
use crate::broker;
use crate::connect::{ConnectError, Device, Patience, Tap, TapSignal};
use crate::report::{ControllerFacts, RunFacts, SignalsFile, SignalsFormat, SignalsKind};
use hil_sim::link::Stream;
use hil_sim::recording::{Column, Piece};

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
    pub(super) fn execute(self, out: &mut impl Write) -> Ending {
        let stop = stop_on_interrupt()?;
        let line = broker::open(&self.port, self.baud).map_err(ConnectError::from)?;
        let mut device = Device::greet(line, PATIENCE)?;
        let (name, period_s) =
            (device.identity().device.clone(), f64::from(device.identity().sample_period_s));
        if !self.names.is_empty() {
            let signals = device.signals(&self.names)?;
            if let Some(missing) = signals.iter().find(|report| report.values.is_empty()) {
                return Err(format!("{} is not in the Data Base of {name}", missing.name).into());
            }
        }
        let (file, pieces) = SignalsFile::create(&self.out, &[], self.format(&mut device)?)?;
        let mut tap = Tap::new(self.every_ticks).of(&self.names);
        let (start, mut told, mut rows) = (Instant::now(), Instant::now(), 0_u64);
        let mut columns: Vec<TapSignal> = Vec::new();
        let is_shown = std::io::stderr().is_terminal();
        let is_over = || self.duration_s.is_some_and(|duration| start.elapsed() >= duration);
        let mut why = "";
        while !stop.load(Ordering::Relaxed) && !is_over() {
            let found = match device.tap(&mut tap, A_MOMENT) {
                Ok(found) => found,
                Err(error) => {
                    // What there is stays.
                    drop(pieces);
                    file.finish()?;
                    return Err(error.into());
                }
            };
            if tap.signals().is_empty() {
                if start.elapsed() > TO_BEGIN {
                    let port = &self.port;
                    let reason = format!(
                        "{port} sends no signals: another client has what it can send, as a page or another `record`; end \
                         it, and begin again 5 s later"
                    );
                    return Err(reason.into());
                }
                continue;
            }
            if columns.is_empty() {
                tap.signals().clone_into(&mut columns);
                // It ends when its disk does not take it, and says so when it is asked.
                let _ = pieces.send(Piece::Columns(columns_of(&name, &columns)));
            } else if columns != tap.signals() {
                why = "; the scheme has other signals now: the record ends here, begin another one";
                break;
            }
            let values = found.iter().flat_map(|row| {
                std::iter::once(f64::from(row.tick) * period_s).chain(row.values.iter().copied())
            });
            rows += found.len() as u64;
            if pieces.send(Piece::Rows(values.collect())).is_err() {
                break;
            }
            if is_shown && told.elapsed() > PROGRESS {
                told = Instant::now();
                eprint!("\r{rows} rows, {} samples lost ", tap.lost());
            }
        }
        if is_shown {
            eprint!("\r");
        }
        drop(pieces);
        let path = file.finish()?;
        let (count, lost) = (columns.len(), tap.lost());
        writeln!(out, "{}: {rows} rows of {count} signals, {lost} samples lost{why}", path.display())?;
        Ok(ExitCode::SUCCESS)
    }

    fn format(&self, device: &mut Device<Box<dyn Stream>>) -> Result<SignalsFormat, ConnectError> {
        Ok(match self.signals {
            SignalsKind::Csv => SignalsFormat::Csv,
            SignalsKind::Mcap => {
                let identity = device.identity().clone();
                let settings_toml = format!(
                    "# What was recorded, not a scenario.\nport = {:?}\ndevice = {:?}\nimage = {:?}\nprotocol = {}\n\
                     sample_period_s = {}\nevery_ticks = {}\n",
                    self.port,
                    identity.device,
                    identity.image,
                    identity.protocol_version,
                    identity.sample_period_s,
                    self.every_ticks
                );
                let (name, scheme) = (identity.device, device.scheme_rows(None)?);
                let controllers = vec![ControllerFacts { name, scheme, device_json: None }];
                SignalsFormat::Mcap(RunFacts { settings_toml, controllers })
            }
        })
    }
}

fn columns_of(source: &str, signals: &[TapSignal]) -> Vec<Column> {
    let of_signal = |signal: &TapSignal| {
        let column = |place| Column {
            source: source.to_owned(),
            signal: signal.name.clone(),
            indices: if signal.words > 1 { vec![place] } else { Vec::new() },
            unit: signal.unit.clone(),
            format: Some(signal.format()),
        };
        (0..signal.words).map(column).collect::<Vec<_>>()
    };
    signals.iter().flat_map(of_signal).collect()
}

//! `dimsart config`: a controller's configuration as text: kept, compared, put back.

mod print;
mod source;

use std::error::Error;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};
use dimsart_core::Kinds;
use serde::Serialize;

use super::line::{Device, LineOptions};
use super::output::say;
use super::{Ending, NOT_STABLE};
use crate::config::{Change, Configuration, Deviation, Difference, UnknownRow, deviations};
use crate::connect::{Exchange, Sent};
use hil_sim::schemes::SchemeText;
use print::{print_deviations, print_difference};
use source::{Source, side_of};

/// Keep a controller's configuration as text, say what differs, put one back.
///
/// It is written as a scheme: `dest module command value` rows, which `check` and `connect PORT scheme` take, too.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Config {
    #[command(subcommand)]
    action: Action,
    #[command(flatten)]
    line: LineOptions,
}

const EXAMPLES: &str = "\
Examples:
  dimsart config save /dev/ttyACM0 arm.scheme              all that it has, to be kept under version control
  dimsart config diff /dev/ttyACM0                         what differs from the defaults
  dimsart config diff arm.scheme /dev/ttyACM0 --exit-code  whether it still is what was kept: 3 when not
  dimsart config apply arm.scheme /dev/ttyACM0 --dry-run   what would change, checked by the device
  dimsart config apply arm.scheme /dev/ttyACM0             all of it in force between two ticks, or nothing";

#[derive(Debug, Subcommand)]
enum Action {
    /// Print the configuration of a controller, or write it to a file: the same one always gives the same bytes.
    Save {
        /// Port, as `connect` takes it, such as `/dev/ttyACM0` or `sim:joint`.
        port: String,
        /// File; standard output when left out.
        file: Option<PathBuf>,
    },
    /// Say what differs from the defaults; or, of two configurations, what differs from the first to the second.
    ///
    /// What this program does not know, such as a module of a newer image, is shown as its row.
    Diff {
        /// Port, or scheme file, or one that is built in: `builtin:joint`.
        from: String,
        /// What it is compared with.
        to: Option<String>,
        /// Side whose rows of files are meant, where they are not for all.
        #[arg(long, value_parser = super::side::side())]
        side: Option<&'static str>,
        /// Ends with 3 when something differs.
        #[arg(long)]
        exit_code: bool,
        /// Prints what differs as one JSON object.
        #[arg(long)]
        json: bool,
    },
    /// Put a configuration in the place of the one that is on a controller, in one transaction: in force between two ticks,
    /// or not at all. Modules that are in both go on with their state.
    Apply {
        /// Scheme file, or one that is built in: `builtin:joint`.
        file: String,
        /// Port of the controller.
        port: String,
        /// Side whose rows of the file are meant, where they are not for all.
        #[arg(long, value_parser = super::side::side())]
        side: Option<&'static str>,
        /// Has the device check the whole and CHANGES NOTHING. How long a tick takes it says with the commit alone.
        #[arg(long)]
        dry_run: bool,
        /// Leaves out the rows that the device does not know, and says which.
        #[arg(long)]
        skip_unknown: bool,
        /// Prints what differs, and what it came to, as one JSON object.
        #[arg(long)]
        json: bool,
    },
}

/// What differs from the defaults, for a program.
#[derive(Serialize)]
struct DeviationReport<'a> {
    deviations: &'a [Deviation],
    unknown: &'a [UnknownRow],
}

/// What an exchange came to, for a program.
#[derive(Serialize)]
struct ApplyReport<'a> {
    changes: &'a [Change],
    is_dry_run: bool,
    #[serde(flatten)]
    sent: &'a Sent,
}

impl Config {
    pub(super) fn execute(self, kinds: Kinds, out: &mut impl Write) -> Ending {
        let Self { action, line } = self;
        match action {
            Action::Save { port, file } => save(&mut line.open(&port, kinds)?, &port, file, out),
            Action::Diff { from, to: None, side, exit_code, json } => {
                let found = Source::open(&from, &line, kinds)?.read(side, kinds)?;
                let (deviations, unknown) = (deviations(&found), &found.unknown);
                if json {
                    let report = DeviationReport { deviations: &deviations, unknown };
                    writeln!(out, "{}", serde_json::to_string(&report)?)?;
                } else {
                    print_deviations(out, &from, &deviations, unknown)?;
                }
                Ok(differs(exit_code && !(deviations.is_empty() && unknown.is_empty())))
            }
            Action::Diff { from, to: Some(to), side, exit_code, json } => {
                let (names, difference) = ([&from, &to], compare(&from, &to, side, &line, kinds)?);
                if json {
                    writeln!(out, "{}", serde_json::to_string(&difference)?)?;
                } else {
                    print_difference(out, names.map(String::as_str), &difference)?;
                }
                Ok(differs(exit_code && !difference.is_empty()))
            }
            Action::Apply { file, port, side, dry_run, skip_unknown, json } => {
                let scheme = SchemeText::read(&file)?;
                let side = side_of(&scheme, side)?;
                let exchange =
                    Exchange { scheme: &scheme, side, skips_unknown: skip_unknown, is_dry_run: dry_run };
                apply(&mut line.open(&port, kinds)?, &port, exchange, json, out)
            }
        }
    }
}

fn differs(differs: bool) -> ExitCode {
    if differs { ExitCode::from(NOT_STABLE) } else { ExitCode::SUCCESS }
}

fn save(device: &mut Device, port: &str, file: Option<PathBuf>, out: &mut impl Write) -> Ending {
    let (text, unknown) = device.configuration_text()?;
    if unknown > 0 {
        eprintln!(
            "dimsart: warning: {unknown} commands of {port} are not known here and left out: save it with the `dimsart` \
             that its image was built with to have all"
        );
    }
    match file {
        None => write!(out, "{text}")?,
        Some(file) => {
            std::fs::write(&file, text)
                .map_err(|error| format!("cannot write {}: {error}", file.display()))?;
            writeln!(out, "{}: the configuration of {port}", file.display())?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// By the names of the device, if one of both is one.
fn compare(
    from: &str,
    to: &str,
    side: Option<&'static str>,
    line: &LineOptions,
    kinds: Kinds,
) -> Result<Difference, Box<dyn Error>> {
    let (mut from, mut to) = (Source::open(from, line, kinds)?, Source::open(to, line, kinds)?);
    let (first, second) = match (&mut from, &mut to) {
        (Source::Device(device), Source::File(file)) => {
            let second = device.read_configuration(&file.text, side_of(file, side)?)?;
            (from.read(side, kinds)?, second)
        }
        (Source::File(file), Source::Device(device)) => {
            let first = device.read_configuration(&file.text, side_of(file, side)?)?;
            (first, to.read(side, kinds)?)
        }
        _ => (from.read(side, kinds)?, to.read(side, kinds)?),
    };
    Ok(Difference::between(&first, &second))
}

fn apply(
    device: &mut Device,
    port: &str,
    exchange: Exchange<'_>,
    json: bool,
    out: &mut impl Write,
) -> Ending {
    let name = &exchange.scheme.name;
    let (rows, _) = device.configuration_text()?;
    let from = device.read_configuration(&rows, crate::connect::ANY_SIDE)?;
    let to: Configuration = device.read_configuration(&exchange.scheme.text, exchange.side)?;
    let difference = Difference::between(&from, &to);
    say(json, out, |out| print_difference(out, [port, name], &difference))?;
    if !to.unknown.is_empty() && !exchange.skips_unknown {
        return Err(format!(
            "{port} does not know {} rows of {name}: nothing has changed; mend them, or leave them out with --skip-unknown",
            to.unknown.len()
        )
        .into());
    }
    let sent = device.exchange(exchange)?;
    for row in &sent.skipped {
        eprintln!("dimsart: left out: {row}");
    }
    let is_dry_run = exchange.is_dry_run;
    if json {
        let report = ApplyReport { changes: &difference.changes, is_dry_run, sent: &sent };
        writeln!(out, "{}", serde_json::to_string(&report)?)?;
    } else if is_dry_run {
        writeln!(out, "{port} would take {} rows; nothing has changed; {}", sent.rows, sent.state)?;
    } else {
        writeln!(out, "{port} has taken {} rows; {}", sent.rows, sent.state)?;
    }
    Ok(ExitCode::SUCCESS)
}

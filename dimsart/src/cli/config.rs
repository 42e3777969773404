//! `dimsart config`: saves, compares and applies a controller's configuration as text.

mod print;
mod source;

use std::error::Error;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};
use dimsart_core::ModuleKinds;
use serde::Serialize;

use super::line::{Device, LineOptions};
use super::output::say;
use super::{Ending, NOT_STABLE};
use crate::config::{Change, Configuration, Deviation, Difference, UnknownRow, deviations};
use crate::connect::{ConfigurationReplacement, SendOutcome};
use hil_sim::schemes::SchemeText;
use print::{print_deviations, print_difference};
use source::{Source, side_of};

/// Save, compare and apply a controller's configuration as text.
///
/// A configuration is a scheme: rows `dest module command value`, which `check` and `connect PORT scheme` accept too. The
/// same configuration is always saved as the same bytes. Rows with unknown modules, parameters, values or types, for
/// example from a newer version, are listed with line and column. A controller with a newer protocol can be read and
/// stopped, but not changed.
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
  dimsart config save /dev/ttyACM0 arm.scheme              save the whole configuration to a file
  dimsart config diff /dev/ttyACM0                         list the differences from the defaults
  dimsart config diff arm.scheme /dev/ttyACM0 --exit-code  exit status 3 if the board differs from the file
  dimsart config apply arm.scheme /dev/ttyACM0 --dry-run   show and check the changes, change nothing
  dimsart config apply arm.scheme /dev/ttyACM0             apply the file as one transaction";

#[derive(Debug, Subcommand)]
enum Action {
    /// Print a controller's configuration, or write it to a file.
    ///
    /// Commands of a newer version are omitted; a comment in the text states the number of omitted commands.
    Save {
        /// Port of the controller, such as `/dev/ttyACM0` or `sim:joint`.
        port: String,
        /// Output file (default: standard output).
        file: Option<PathBuf>,
    },
    /// Compare a configuration with the defaults, or with another configuration.
    ///
    /// For two configurations, lists added, removed, changed and moved modules and parameters, and ports bound to another
    /// signal. Unknown rows, such as a module of a newer image, are printed unchanged.
    Diff {
        /// Port, scheme file, or built-in scheme such as `builtin:joint`.
        from: String,
        /// Second configuration: port, scheme file or built-in scheme.
        to: Option<String>,
        /// Use the rows of scheme files for this side and for `all`.
        #[arg(long, value_parser = super::side::side())]
        side: Option<&'static str>,
        /// Exit with status 3 if there is a difference.
        #[arg(long)]
        exit_code: bool,
        /// Print the differences as one JSON object.
        #[arg(long)]
        json: bool,
    },
    /// Replace a controller's configuration in one transaction.
    ///
    /// The configuration is applied atomically, between two ticks. Modules that are in both configurations keep their
    /// state. If the device does not know a row, nothing changes, unless --skip-unknown is given.
    Apply {
        /// Scheme file, or built-in scheme such as `builtin:joint`.
        file: String,
        /// Port of the controller.
        port: String,
        /// Use the rows of the scheme for this side and for `all`.
        #[arg(long, value_parser = super::side::side())]
        side: Option<&'static str>,
        /// Have the device check the configuration, CHANGE NOTHING.
        ///
        /// The device checks the limit of the tick time only at the commit, not in a dry run.
        #[arg(long)]
        dry_run: bool,
        /// Skip rows that the device does not know, and list them.
        #[arg(long)]
        skip_unknown: bool,
        /// Print the differences and the result as one JSON object.
        #[arg(long)]
        json: bool,
    },
}

/// Differences from the defaults, as JSON.
#[derive(Serialize)]
struct DeviationReport<'a> {
    deviations: &'a [Deviation],
    unknown: &'a [UnknownRow],
}

/// Result of `config apply`, as JSON.
#[derive(Serialize)]
struct ApplyReport<'a> {
    changes: &'a [Change],
    is_dry_run: bool,
    #[serde(flatten)]
    sent: &'a SendOutcome,
}

impl Config {
    pub(super) fn execute(self, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
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
                let exchange = ConfigurationReplacement {
                    scheme: &scheme,
                    side,
                    skips_unknown: skip_unknown,
                    is_dry_run: dry_run,
                };
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
            "dimsart: warning: skipped {unknown} commands of {port} that this version does not know: to save all commands, \
             use the `dimsart` version of the image"
        );
    }
    match file {
        None => write!(out, "{text}")?,
        Some(file) => {
            std::fs::write(&file, text)
                .map_err(|error| format!("cannot write {}: {error}", file.display()))?;
            writeln!(out, "{}: saved the configuration of {port}", file.display())?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Compares two sources; reads a file by the names of the device if the other source is a device.
fn compare(
    from: &str,
    to: &str,
    side: Option<&'static str>,
    line: &LineOptions,
    kinds: ModuleKinds,
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
    exchange: ConfigurationReplacement<'_>,
    json: bool,
    out: &mut impl Write,
) -> Ending {
    let name = &exchange.scheme.name;
    let (rows, _) = device.configuration_text()?;
    let from = device.read_configuration(&rows, crate::connect::ALL_DESTINATIONS)?;
    let to: Configuration = device.read_configuration(&exchange.scheme.text, exchange.side)?;
    let difference = Difference::between(&from, &to);
    say(json, out, |out| print_difference(out, [port, name], &difference))?;
    if !to.unknown.is_empty() && !exchange.skips_unknown {
        return Err(format!(
            "{port} does not know {} rows of {name}, nothing changed: correct these rows or add --skip-unknown",
            to.unknown.len()
        )
        .into());
    }
    let sent = device.replace_configuration(exchange)?;
    for row in &sent.skipped {
        eprintln!("dimsart: skipped: {row}");
    }
    let is_dry_run = exchange.is_dry_run;
    if json {
        let report = ApplyReport { changes: &difference.changes, is_dry_run, sent: &sent };
        writeln!(out, "{}", serde_json::to_string(&report)?)?;
    } else if is_dry_run {
        writeln!(out, "{port}: dry run of {} rows, nothing changed; {}", sent.rows, sent.state)?;
    } else {
        writeln!(out, "{port}: applied {} rows; {}", sent.rows, sent.state)?;
    }
    Ok(ExitCode::SUCCESS)
}

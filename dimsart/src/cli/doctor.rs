//! `dimsart doctor`: checks the tools for firmware, or a board.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, ExitCode};

use clap::Args;
use dimsart_core::ModuleKinds;
use serde::Serialize;

use super::Ending;
use super::line::LineOptions;
use crate::commissioning::{self, Check, HostComputer, Verdict};
use hil_sim::untrusted_text::escape_lines;

/// Check the tools for building and flashing firmware, or check a board.
///
/// Checks the compiler target, emulator, probe-rs, udev rule and debug probe. With --board, checks the board's start,
/// scheme, ticks against this computer's clock, faults, measurements at rest and links; these checks last about a second,
/// without motion and without a lease. Prints one line per check, with the next step if the check failed. Exit status: 0
/// all passed, 1 a check failed.
#[derive(Debug, Args)]
#[command(
    after_help = "The simulator needs none of these tools; the emulated board needs no probe-rs, udev rule or probe.\n\n\
                  If a flashed b-g431b-esc1 does not answer, check its option bits: nSWBOOT0 must be 0 (as delivered) and \
                  nBOOT0 must be 1, because its pin BOOT0 is pulled up."
)]
pub(super) struct Doctor {
    /// Check the board at this port instead of the tools.
    #[arg(long, value_name = "PORT")]
    board: Option<String>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    line: LineOptions,
}

/// Results for a board, as JSON.
#[derive(Serialize)]
struct Examined {
    is_well: bool,
    checks: Vec<Check>,
}

/// Results for the tools, as JSON.
#[derive(Serialize)]
struct Examination {
    is_well: bool,
    things: Vec<Thing>,
}

/// A tool for firmware.
#[derive(Serialize)]
struct Thing {
    name: &'static str,
    is_there: bool,
    /// The version found, or what is wrong and the next step.
    finding: String,
}

/// The version found, or what is wrong and the next step.
type Finding = Result<String, String>;

const TARGET: &str = "thumbv7em-none-eabihf";
/// Debian's Rust provides the sources of `core` instead of compiled targets.
const DEBIAN_SOURCES: &str = "/usr/lib/rustlib/src/rust/library/core";
const INSTALL_PROBE_RS: &str = "cargo install probe-rs-tools --locked";
/// The oldest tested versions.
const OLDEST_QEMU: [u32; 2] = [7, 2];
const OLDEST_PROBE_RS: [u32; 2] = [0, 32];
const UDEV_FOLDERS: [&str; 3] = ["/etc/udev/rules.d", "/usr/lib/udev/rules.d", "/lib/udev/rules.d"];

impl Doctor {
    pub(super) fn execute(self, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
        match &self.board {
            Some(port) => self.check_board(port, kinds, out),
            None => self.look_for_tools(out),
        }
    }

    fn check_board(&self, port: &str, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
        let examined = self.line.open(port, kinds).and_then(|mut device| {
            Ok(commissioning::examine(&mut device, &HostComputer::new(port, None), None)?)
        });
        let next = "check cable and port; `cargo xtask flash BOARD` shows the board's log";
        let checks = examined.unwrap_or_else(|error| {
            vec![Check::new("answers", false, error.to_string(), "an answer to every request", next)]
        });
        let is_well = checks.iter().all(|check| check.verdict != Verdict::Failed);
        let examined = Examined { is_well, checks };
        if self.json {
            writeln!(out, "{}", serde_json::to_string(&examined)?)?;
        } else {
            examined.checks.iter().try_for_each(|check| writeln!(out, "{check}"))?;
        }
        Ok(if is_well { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }

    fn look_for_tools(&self, out: &mut impl Write) -> Ending {
        let findings = [
            ("compiler", compiler()),
            ("emulator", emulator()),
            ("probe-rs", probe_rs()),
            ("udev rule", udev_rule(&UDEV_FOLDERS.map(Path::new))),
            ("probe", probe()),
        ];
        let things: Vec<Thing> = findings
            .into_iter()
            .map(|(name, finding)| Thing {
                name,
                is_there: finding.is_ok(),
                finding: finding.unwrap_or_else(|wrong| wrong),
            })
            .collect();
        let examination = Examination { is_well: things.iter().all(|thing| thing.is_there), things };
        if self.json {
            writeln!(out, "{}", serde_json::to_string(&examination)?)?;
        } else {
            for Thing { name, is_there, finding } in &examination.things {
                writeln!(out, "{:<8} {name}: {finding}", if *is_there { "ok" } else { "missing" })?;
            }
        }
        Ok(if examination.is_well { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}

fn compiler() -> Finding {
    let library = output("rustc", &["--print", "target-libdir", "--target", TARGET]);
    if library.is_some_and(|folder| Path::new(folder.trim()).is_dir()) {
        return Ok(format!("target {TARGET}"));
    }
    if Path::new(DEBIAN_SOURCES).is_dir() {
        return Ok("Debian's Rust: `cargo xtask` builds the crate `core` from source".to_owned());
    }
    Err(format!(
        "target {TARGET} missing: run `rustup target add {TARGET}`; `cargo xtask test` installs the target if possible"
    ))
}

fn emulator() -> Finding {
    let install = "install QEMU 7.2 or later (Debian: apt-get install qemu-system-arm)";
    let version =
        output("qemu-system-arm", &["--version"]).ok_or(format!("qemu-system-arm not found: {install}"))?;
    let is_known =
        output("qemu-system-arm", &["-machine", "help"]).is_some_and(|all| all.contains("mps2-an386"));
    if !is_known {
        return Err(format!("qemu-system-arm lacks the board mps2-an386: {install}"));
    }
    at_least(&version, OLDEST_QEMU).map_err(|old| format!("{old}: {install}"))
}

fn probe_rs() -> Finding {
    let version =
        output("probe-rs", &["--version"]).ok_or(format!("not installed: run `{INSTALL_PROBE_RS}`"))?;
    at_least(&version, OLDEST_PROBE_RS).map_err(|old| format!("{old}: run `{INSTALL_PROBE_RS}`"))
}

/// Without a udev rule, only root can use a debug probe.
fn udev_rule(folders: &[&Path]) -> Finding {
    if !cfg!(target_os = "linux") {
        return Ok("not needed on this system".to_owned());
    }
    let rules = folders.iter().filter_map(|folder| fs::read_dir(folder).ok()).flatten().flatten();
    let is_for_probes = |text: String| text.contains("ID_DEBUG_PROBE") || text.contains("\"0483\"");
    let mut found = rules.filter(|rule| fs::read_to_string(rule.path()).is_ok_and(is_for_probes));
    found.next().map(|rule| rule.path().display().to_string()).ok_or_else(|| {
        "only root can use a probe: save https://probe.rs/files/69-probe-rs.rules to /etc/udev/rules.d, run \
         `sudo udevadm control --reload` and reconnect the board"
            .to_owned()
    })
}

fn probe() -> Finding {
    let probes = output("probe-rs", &["list"]).ok_or(format!("needs probe-rs: run `{INSTALL_PROBE_RS}`"))?;
    let probe = probes.lines().find(|line| line.starts_with('['));
    probe.map(str::to_owned).ok_or("not found: connect the board's debug port by USB".to_owned())
}

/// Returns the output of a program if it succeeds.
fn output(program: &str, arguments: &[&str]) -> Option<String> {
    let output =
        Command::new(program).args(arguments).output().ok().filter(|output| output.status.success())?;
    Some(escape_lines(&String::from_utf8_lossy(&output.stdout)))
}

/// Returns the version line of a program if its version is at least `oldest`.
fn at_least(output: &str, oldest: [u32; 2]) -> Finding {
    let line = output.lines().next().unwrap_or_default().to_owned();
    let version = line.split_whitespace().find(|word| word.starts_with(|first: char| first.is_ascii_digit()));
    let numbers: Vec<u32> =
        version.unwrap_or_default().split('.').map_while(|number| number.parse().ok()).take(2).collect();
    if numbers.as_slice() >= oldest.as_slice() { Ok(line) } else { Err(format!("{line} is too old")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rule_for_probes_is_found_among_others() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("10-disks.rules"), "KERNEL==\"sd*\"").unwrap();
        assert!(udev_rule(&[folder.path()]).unwrap_err().contains("69-probe-rs.rules"));
        fs::write(folder.path().join("69-probe-rs.rules"), "ENV{ID_DEBUG_PROBE}=\"1\"").unwrap();
        assert!(udev_rule(&[Path::new("/nowhere"), folder.path()]).unwrap().ends_with("69-probe-rs.rules"));
    }
}

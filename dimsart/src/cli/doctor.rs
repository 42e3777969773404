//! `dimsart doctor`: whether what boards and emulated firmware need is there, and what to do if not.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, ExitCode};

use clap::Args;
use dimsart_core::Kinds;
use serde::Serialize;

use super::Ending;
use super::line::LineOptions;
use crate::commissioning::{self, Check, Computer, Verdict};
use hil_sim::foreign_text::visible_lines;

/// Look for what firmware needs: compiler, emulator, probe-rs, udev rule and debug probe. Or look a board over.
///
/// A line per thing, with the next step where it is missing or not well. Exit status 0 when all is well, 1 when not. A board
/// is only looked at, for about a second: nothing moves, and no lease is taken.
#[derive(Debug, Args)]
#[command(
    after_help = "The simulator needs none of it; the emulated board needs no probe-rs, rule and probe.\n\n\
                  A b-g431b-esc1 that is flashed and says nothing: its pin BOOT0 is pulled up, so its option bit nSWBOOT0 has \
                  to be 0, as delivered, and nBOOT0 1."
)]
pub(super) struct Doctor {
    /// Looks over the board at this port instead: how it started, its ticks by this computer's clock, its faults, what it
    /// measures at rest, its links.
    #[arg(long, value_name = "PORT")]
    board: Option<String>,
    /// Prints one JSON object, and nothing else.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    line: LineOptions,
}

/// What was found of a board.
#[derive(Serialize)]
struct Examined {
    is_well: bool,
    checks: Vec<Check>,
}

/// What was found of everything.
#[derive(Serialize)]
struct Examination {
    is_well: bool,
    things: Vec<Thing>,
}

/// One thing that firmware needs.
#[derive(Serialize)]
struct Thing {
    name: &'static str,
    is_there: bool,
    /// What is there, or what is wrong and the next step.
    finding: String,
}

/// What is there, or what is wrong and the next step.
type Finding = Result<String, String>;

const TARGET: &str = "thumbv7em-none-eabihf";
/// Debian's Rust brings the sources of `core` instead of compiled targets.
const DEBIAN_SOURCES: &str = "/usr/lib/rustlib/src/rust/library/core";
const INSTALL_PROBE_RS: &str = "cargo install probe-rs-tools --locked";
/// The oldest ones that this was tried with.
const OLDEST_QEMU: [u32; 2] = [7, 2];
const OLDEST_PROBE_RS: [u32; 2] = [0, 32];
const UDEV_FOLDERS: [&str; 3] = ["/etc/udev/rules.d", "/usr/lib/udev/rules.d", "/lib/udev/rules.d"];

impl Doctor {
    pub(super) fn execute(self, kinds: Kinds, out: &mut impl Write) -> Ending {
        match &self.board {
            Some(port) => self.look_over(port, kinds, out),
            None => self.look_for_tools(out),
        }
    }

    fn look_over(&self, port: &str, kinds: Kinds, out: &mut impl Write) -> Ending {
        let examined = self.line.open(port, kinds).and_then(|mut device| {
            Ok(commissioning::examine(&mut device, &Computer::new(port, None), None)?)
        });
        let next =
            "look at cable and port; no log, or a log of restarts: `cargo xtask flash BOARD` shows why";
        let checks = examined.unwrap_or_else(|error| {
            vec![Check::new("answers", false, error.to_string(), "an answer to all that is asked", next)]
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
        return Ok("Debian's, which compiles core along (cargo xtask)".to_owned());
    }
    Err(format!("no target {TARGET}: rustup target add {TARGET}, or cargo xtask test installs what it can"))
}

fn emulator() -> Finding {
    let install = "install QEMU 7.2 or later (Debian: apt-get install qemu-system-arm)";
    let version =
        output("qemu-system-arm", &["--version"]).ok_or(format!("no qemu-system-arm: {install}"))?;
    let is_known =
        output("qemu-system-arm", &["-machine", "help"]).is_some_and(|all| all.contains("mps2-an386"));
    if !is_known {
        return Err(format!("qemu-system-arm knows no board mps2-an386: {install}"));
    }
    at_least(&version, OLDEST_QEMU).map_err(|old| format!("{old}: {install}"))
}

fn probe_rs() -> Finding {
    let version = output("probe-rs", &["--version"]).ok_or(format!("not installed: {INSTALL_PROBE_RS}"))?;
    at_least(&version, OLDEST_PROBE_RS).map_err(|old| format!("{old}: {INSTALL_PROBE_RS}"))
}

/// Without a rule, only root may use a debug probe.
fn udev_rule(folders: &[&Path]) -> Finding {
    if !cfg!(target_os = "linux") {
        return Ok("not needed on this system".to_owned());
    }
    let rules = folders.iter().filter_map(|folder| fs::read_dir(folder).ok()).flatten().flatten();
    let is_for_probes = |text: String| text.contains("ID_DEBUG_PROBE") || text.contains("\"0483\"");
    let mut found = rules.filter(|rule| fs::read_to_string(rule.path()).is_ok_and(is_for_probes));
    found.next().map(|rule| rule.path().display().to_string()).ok_or_else(|| {
        "only root may use a probe: save https://probe.rs/files/69-probe-rs.rules into /etc/udev/rules.d, run \
         `sudo udevadm control --reload` and plug the board in again"
            .to_owned()
    })
}

fn probe() -> Finding {
    let probes =
        output("probe-rs", &["list"]).ok_or(format!("probe-rs has to look for it: {INSTALL_PROBE_RS}"))?;
    let probe = probes.lines().find(|line| line.starts_with('['));
    probe.map(str::to_owned).ok_or("none seen: connect the board's debug port by USB".to_owned())
}

/// What a program prints, if it runs and succeeds.
fn output(program: &str, arguments: &[&str]) -> Option<String> {
    let output =
        Command::new(program).args(arguments).output().ok().filter(|output| output.status.success())?;
    Some(visible_lines(&String::from_utf8_lossy(&output.stdout)))
}

/// The first line of what a program says of its version, if that is not older than `oldest`.
fn at_least(says: &str, oldest: [u32; 2]) -> Finding {
    let line = says.lines().next().unwrap_or_default().to_owned();
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

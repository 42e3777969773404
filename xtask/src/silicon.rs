//! `cargo xtask silicon BOARD`: checks a real board and writes a report to send back.
//!
//! ```text
//! here: versions, image, cycle table, flash, boot log ──▶ before.json ──▶ dimsart commission ──▶ report.md, report.json
//! ```

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use boards::catalogue::BoardInfo;
use serde::Serialize;
use sha2::{Digest as _, Sha256};

use crate::boards::{SIDES, build, build_program, stamp};
use crate::example::dimsart;
use crate::flash::{find_probe_rs, flashable};
use crate::shell::{Outcome, command, image_folder, run, top};
use crate::toolchain::Toolchain;

/// Time to read the log after a start, and its maximum including flashing.
const LOG: [Duration; 2] = [Duration::from_secs(4), Duration::from_secs(90)];
/// Polling period of the log.
const A_MOMENT: Duration = Duration::from_millis(100);
/// Log line of a started board.
const STARTED: &str = "starts with scheme";

/// The command's arguments.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Arguments<'a> {
    board: &'a str,
    variant: Option<&'a str>,
    is_emulated: bool,
    /// Arguments passed on to `dimsart commission`.
    passed_on: Vec<&'a str>,
}

impl<'a> Arguments<'a> {
    /// Parses the arguments after `silicon`.
    pub(crate) fn read(words: &[&'a str]) -> Result<Self, String> {
        let (board, rest) = words.split_first().ok_or("missing board")?;
        let (board, variant) =
            board.split_once(',').map_or((*board, None), |(board, variant)| (board, Some(variant)));
        let is_emulated = rest.contains(&"--emulated");
        let passed_on: Vec<&str> = rest.iter().copied().filter(|word| *word != "--emulated").collect();
        if is_emulated && passed_on.iter().any(|word| ["--port", "--locked-rotor"].contains(word)) {
            return Err("an emulated board has no port and no motor: use a board with a chip".into());
        }
        Ok(Self { board, variant, is_emulated, passed_on })
    }
}

/// A check in the format of `dimsart commission`.
#[derive(Debug, Serialize)]
struct Check {
    name: &'static str,
    verdict: &'static str,
    found: String,
    expected: &'static str,
    remedy: &'static str,
}

impl Check {
    fn not_run(name: &'static str, why: &str) -> Self {
        Self { name, verdict: "not_run", found: why.to_owned(), expected: "", remedy: "" }
    }

    fn of(
        name: &'static str,
        expected: &'static str,
        found: Result<String, String>,
        next: &'static str,
    ) -> Self {
        let (verdict, remedy) = if found.is_ok() { ("passed", "") } else { ("failed", next) };
        let found = found.unwrap_or_else(|wrong| wrong);
        Self { name, verdict, found, expected, remedy }
    }
}

/// Results of the checks before those over the command line.
#[derive(Debug, Default, Serialize)]
struct Before {
    facts: Vec<(&'static str, String)>,
    checks: Vec<Check>,
}

/// Runs all checks; fails if one fails.
pub(crate) fn silicon(words: &[&str]) -> Outcome {
    let arguments = Arguments::read(words)?;
    let Arguments { board: name, variant, is_emulated, passed_on } = &arguments;
    let (board, chip) = flashable(name)?;
    if !is_emulated {
        find_probe_rs()?;
    }
    let toolchain = Toolchain::set_up()?;
    let image = build(toolchain, board, *variant)?;
    let (file, flash_bytes) = (image_folder().join(&image.name), image.size.flash);
    let [master, _] = SIDES;
    stamp(&file, master)?;
    let mut before = Before { facts: facts(toolchain, &file, flash_bytes)?, ..Before::default() };
    if *is_emulated {
        let why = "emulated chip instead of a board";
        before.checks.extend(["cycle table", "flash and boot log"].map(|name| Check::not_run(name, why)));
    } else {
        before.checks.push(cycle_table(toolchain, board, chip)?);
        before.checks.push(flash_and_listen(chip, &file)?);
    }
    let out = top().join("runs/silicon").join(name);
    let with = out.join("before.json");
    let json = serde_json::to_string_pretty(&before).map_err(|error| error.to_string())?;
    fs::create_dir_all(&out)
        .and_then(|()| fs::write(&with, json))
        .map_err(|error| format!("{}: {error}", with.display()))?;
    let mut commission = command(dimsart()?, ["commission", name, "--out"]);
    commission.arg(&out).arg("--with").arg(&with).args(passed_on);
    if *is_emulated {
        commission.arg("--emulated").arg(&file);
    } else {
        if !passed_on.contains(&"--port") {
            commission.args(["--port", "/dev/ttyACM0"]);
        }
        commission.arg("--restart").arg(format!("probe-rs reset --chip {chip}"));
    }
    run(&mut commission).map_err(|error| format!("{error}: see the report"))
}

/// Returns a program's single-line output, or "unknown".
fn says(mut program: Command) -> String {
    let output = program.output().ok().filter(|output| output.status.success());
    let text = output.map(|output| String::from_utf8_lossy(&output.stdout).trim().to_owned());
    text.unwrap_or_else(|| "unknown".to_owned())
}

fn facts(
    toolchain: Toolchain,
    image: &Path,
    flash_bytes: u64,
) -> Result<Vec<(&'static str, String)>, String> {
    let bytes = fs::read(image).map_err(|error| format!("{}: {error}", image.display()))?;
    let mut hash = String::new();
    for byte in Sha256::digest(&bytes) {
        let _ = write!(hash, "{byte:02x}");
    }
    let changed = says(command("git", ["status", "--porcelain"]));
    let commit = says(command("git", ["rev-parse", "HEAD"]));
    let is_as_committed = if changed.is_empty() { "" } else { ", with uncommitted changes" };
    Ok(vec![
        ("date", says(command("date", ["-u", "+%Y-%m-%d %H:%M UTC"]))),
        ("commit", format!("{commit}{is_as_committed}")),
        ("rustc", toolchain.version()?),
        ("probe-rs", says(command("probe-rs", ["--version"]))),
        ("probe", says(command("probe-rs", ["list"])).replace('\n', "; ")),
        ("image, bytes of flash", flash_bytes.to_string()),
        ("image, SHA-256 of the ELF", hash),
    ])
}

/// Runs the program that measures every row of the cycle table.
fn cycle_table(toolchain: Toolchain, board: &BoardInfo, chip: &str) -> Result<Check, String> {
    let program = build_program(toolchain, board, "cycle-table")?;
    let output = command("probe-rs", ["run", "--chip", chip]).arg(program).output();
    let output = output.map_err(|error| format!("cannot run probe-rs: {error}"))?;
    let log = [output.stdout, output.stderr].concat();
    print!("{}", String::from_utf8_lossy(&log));
    let rows = String::from_utf8_lossy(&log).lines().count();
    let found = match output.status.success() {
        true => Ok(format!("{rows} lines of log")),
        false => Err(last_lines(&log)),
    };
    let next = "the cycle table is wrong for this chip, or flashing failed: send the log of `cargo xtask step cycle-table BOARD`";
    Ok(Check::of("cycle table", "every row equals the table", found, next))
}

/// Flashes an image and reads the log of its start; the board then runs without the probe.
fn flash_and_listen(chip: &str, image: &Path) -> Result<Check, String> {
    let log = listen(command("probe-rs", ["run", "--chip", chip]).arg(image), STARTED, LOG)?;
    print!("{}", String::from_utf8_lossy(&log));
    let text = String::from_utf8_lossy(&log);
    let starts = text.lines().filter(|line| line.contains(STARTED)).count();
    let wrong = text.lines().any(|line| line.contains("ERROR") || line.contains("panicked"));
    let found = match (starts, wrong) {
        (1, false) => Ok(text.lines().find(|line| line.contains(STARTED)).unwrap_or_default().to_owned()),
        _ => Err(format!("{starts} starts; {}", last_lines(&log))),
    };
    let next = "see the log's last line if the board does not start or restarts repeatedly; `dimsart doctor` searches for the probe";
    Ok(Check::of("flash and boot log", "one start without errors", found, next))
}

fn last_lines(log: &[u8]) -> String {
    let text = String::from_utf8_lossy(log);
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
    lines.get(lines.len().saturating_sub(3)..).unwrap_or_default().join("; ")
}

/// Reads a program's output until some time after `word`, its end, or the time limit; then ends the program.
fn listen(program: &mut Command, word: &str, [behind, most]: [Duration; 2]) -> Result<Vec<u8>, String> {
    let failed = |error: std::io::Error| format!("cannot read the board's log: {error}");
    // A file: an unread pipe would block the program.
    let file = tempfile::NamedTempFile::new().map_err(failed)?;
    let end = || file.as_file().try_clone().map(Stdio::from).map_err(failed);
    let mut child = program.stdin(Stdio::null()).stdout(end()?).stderr(end()?).spawn().map_err(failed)?;
    let (begun, mut said) = (Instant::now(), None);
    let is_over =
        |said: Option<Instant>| said.is_some_and(|said| said.elapsed() > behind) || begun.elapsed() > most;
    while !is_over(said) && child.try_wait().map_err(failed)?.is_none() {
        std::thread::sleep(A_MOMENT);
        let log = fs::read(file.path()).map_err(failed)?;
        if said.is_none() && String::from_utf8_lossy(&log).contains(word) {
            said = Some(Instant::now());
        }
    }
    // Fails if the program has already ended.
    let _ = child.kill();
    child.wait().map_err(failed)?;
    fs::read(file.path()).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_are_read_and_passed_on() {
        let found = Arguments::read(&["nucleo-g474re,auth", "--emulated", "--seconds", "1"]).unwrap();
        let wanted = Arguments {
            board: "nucleo-g474re",
            variant: Some("auth"),
            is_emulated: true,
            passed_on: vec!["--seconds", "1"],
        };
        assert_eq!(found, wanted);
        for wrong in [&[][..], &["b-g431b-esc1", "--emulated", "--locked-rotor"]] {
            Arguments::read(wrong).unwrap_err();
        }
    }

    #[test]
    fn a_log_is_listened_to_for_some_time_alone() {
        let mut talks = command("sh", ["-c", "echo starts; echo wrong >&2; sleep 60"]);
        let begun = Instant::now();
        let [behind, most] = [100, 60_000].map(Duration::from_millis);
        let log = listen(&mut talks, "wrong", [behind, most]).unwrap();
        assert_eq!(String::from_utf8(log).unwrap(), "starts\nwrong\n");
        assert!(begun.elapsed() < Duration::from_secs(30));
    }
}

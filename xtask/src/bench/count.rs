//! Counts the instructions of a function with valgrind's callgrind.

use std::io::Write;
use std::path::{Path, PathBuf};

use super::PROFILE;
use crate::setup::install;
use crate::shell::{cargo, command, run, succeeds, target};

/// Ticks of the short and the long run; their difference excludes the start-up.
const TICKS: [u32; 2] = [400, 1400];

/// The built `step_cost`, to run with callgrind.
pub(super) struct Counter {
    program: PathBuf,
}

impl Counter {
    /// Installs valgrind if necessary, builds the programs and checks Table 1 bit by bit.
    pub(super) fn new() -> Result<Self, String> {
        if std::env::consts::ARCH != "x86_64" {
            return Err("budgets are counts of x86-64 instructions: run this on an x86-64 machine".into());
        }
        if !succeeds(&mut command("valgrind", ["--version"])) {
            install(&["valgrind"], "counting instructions")?;
        }
        run(&mut cargo(&[
            "build",
            "--profile",
            PROFILE,
            "--package",
            "dimsart-core",
            "--example",
            "step_cost",
        ]))?;
        let program = target().join(PROFILE).join("examples/step_cost");
        run(&mut command(&program, ["table1", "10000"]))?;
        Ok(Self { program })
    }

    /// Returns the instructions per tick of functions with `function` in their name, including callees.
    pub(super) fn per_tick(&self, function: &str, scheme: &[&str]) -> Result<f64, String> {
        let [few, many] = TICKS;
        eprint!("\r\x1b[Kcounting {}", scheme.join(" "));
        let _ = std::io::stderr().flush();
        // In parallel: counts do not depend on the load.
        let (few_total, many_total) = std::thread::scope(|scope| {
            let few = scope.spawn(|| self.total(function, scheme, few));
            let many = self.total(function, scheme, many);
            (few.join().unwrap_or_else(|_| Err("counting thread panicked".into())), many)
        });
        let difference = many_total? - few_total?;
        eprint!("\r\x1b[K");
        Ok(difference / f64::from(many - few))
    }

    fn total(&self, function: &str, scheme: &[&str], ticks: u32) -> Result<f64, String> {
        let toggle = format!("--toggle-collect=*{function}*");
        let arguments: Vec<String> =
            scheme.iter().map(ToString::to_string).chain([ticks.to_string()]).collect();
        Ok(instructions(&self.program, &[&toggle], &arguments)?.0)
    }
}

/// Returns the instructions of a program as counted by callgrind with `options`, and the program's output.
pub(super) fn instructions(
    program: &Path,
    options: &[&str],
    arguments: &[String],
) -> Result<(f64, String), String> {
    let mut valgrind = command("valgrind", ["--tool=callgrind", "--callgrind-out-file=/dev/null"]);
    valgrind.args(options).arg(program).args(arguments);
    let output = valgrind.output().map_err(|error| format!("cannot start valgrind: {error}"))?;
    let report = String::from_utf8_lossy(&output.stderr);
    let count = report.lines().find_map(|line| line.split_once("Collected :")?.1.trim().parse().ok());
    match count {
        Some(count) if output.status.success() && count > 0.0 => {
            Ok((count, String::from_utf8_lossy(&output.stdout).into_owned()))
        }
        _ => Err(format!(
            "callgrind counted nothing ({} {}):\n{report}",
            options.join(" "),
            arguments.join(" ")
        )),
    }
}

//! Speed of the simulator with the shipped experiment: time and instructions.

use std::path::{Path, PathBuf};

use super::count::instructions;
use crate::shell::{cargo, command, run, target};

/// Timed runs; the fastest counts, because load only slows a run down.
pub(super) const RUNS: usize = 5;
/// Virtual time of the short and the long counted run, `s`; their difference excludes the start-up.
const COUNTED_S: [f64; 2] = [1.0, 5.0];

/// The results.
pub(super) struct Simulator {
    /// Duration of the scenario, `s`.
    pub(super) simulated_s: f64,
    /// Minimum time with all signals recorded, `s`.
    pub(super) recorded_s: f64,
    /// Minimum time without recording, `s`.
    pub(super) silent_s: f64,
    /// Instructions per tick of both sides, with plants and links, without recording.
    pub(super) per_tick: f64,
}

impl Simulator {
    /// Builds the command and measures it.
    pub(super) fn measure() -> Result<Self, String> {
        run(&mut cargo(&["build", "--release", "--package", "dimsart"]))?;
        let program = target().join("release/dimsart");
        let folder = target().join("bench-report");
        let recorded = best(&program, &["--out".as_ref(), folder.as_path()])?;
        let silent = best(&program, &["--no-report".as_ref()])?;
        let [few, many] = COUNTED_S.map(|duration_s| {
            let duration = format!("duration_s={duration_s:?}");
            let arguments = ["run", "--no-report", "--json", "--set", &duration].map(str::to_owned);
            let (count, out) = instructions(&program, &[], &arguments)?;
            Ok::<_, String>((count, figure(&out, "ticks")?))
        });
        let ((few, few_ticks), (many, many_ticks)) = (few?, many?);
        Ok(Self {
            simulated_s: recorded.simulated_s,
            recorded_s: recorded.wall_s,
            silent_s: silent.wall_s,
            per_tick: (many - few) / (many_ticks - few_ticks),
        })
    }
}

struct Timed {
    simulated_s: f64,
    wall_s: f64,
}

/// Returns the fastest of several runs by the command's own clock.
fn best(program: &PathBuf, arguments: &[&Path]) -> Result<Timed, String> {
    let mut best: Option<Timed> = None;
    for _ in 0..RUNS {
        let output = command(program, ["run", "--json"]).args(arguments).output();
        let output = output.map_err(|error| format!("cannot start {}: {error}", program.display()))?;
        let out = String::from_utf8_lossy(&output.stdout);
        let timed = Timed { simulated_s: figure(&out, "simulated_s")?, wall_s: figure(&out, "wall_s")? };
        best = best.filter(|best| best.wall_s <= timed.wall_s).or(Some(timed));
    }
    best.ok_or_else(|| "no run was timed".to_owned())
}

/// Reads a number from the command's JSON line.
fn figure(out: &str, name: &str) -> Result<f64, String> {
    let key = format!("\"{name}\":");
    let text = out.lines().last().and_then(|line| Some(line.split_once(&key)?.1));
    let number = text.and_then(|text| text.split([',', '}']).next()?.parse().ok());
    number.ok_or_else(|| format!("`dimsart run --json` printed no {name}:\n{out}"))
}

#[cfg(test)]
mod tests {
    use super::figure;

    #[test]
    fn reads_a_number_of_the_last_line() {
        let out = "wall_s 7\n{\"ticks\":8997,\"wall_s\":0.5,\"axes\":[{\"axis\":0}]}\n";
        assert_eq!(figure(out, "wall_s"), Ok(0.5));
        assert_eq!(figure(out, "axis"), Ok(0.0));
        assert!(figure(out, "wall").is_err());
    }
}

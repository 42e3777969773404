//! `cargo xtask step fuzz`: fuzzes every decoder with libFuzzer, on the stable compiler.
//!
//! The folder `fuzz` also works with `cargo fuzz`: `cargo fuzz run packets --sanitizer none`.

use std::path::PathBuf;
use std::time::Instant;

use crate::setup::install;
use crate::shell::{Outcome, cargo, command, on_every_core, run, succeeds, target, top};

/// Default number of inputs per decoder: 5 minutes for all decoders on two cores.
pub(crate) const INPUTS: u64 = 10_000_000;
/// Maximum length of an input: more than two frames of the command line.
const MAX_BYTES: &str = "-max_len=600";

const SLOWEST: &str = "stat::slowest_unit_time_sec:";

/// Coverage instrumentation for the fuzzer.
const WATCHED: &str = "--cfg fuzzing -C passes=sancov-module -C llvm-args=-sanitizer-coverage-level=4 \
    -C llvm-args=-sanitizer-coverage-inline-8bit-counters -C llvm-args=-sanitizer-coverage-pc-table \
    -C llvm-args=-sanitizer-coverage-trace-compares";

/// Fuzzes every decoder with `inputs` inputs; a failing input is stored and reported.
pub(crate) fn fuzz(inputs: u64) -> Outcome {
    if !succeeds(&mut command("c++", ["--version"])) {
        install(&["g++"], "building libFuzzer")?;
    }
    let host = host()?;
    let folder = target().join("fuzz");
    let build = ["build", "--release", "--manifest-path", "fuzz/Cargo.toml", "--target", &host];
    run(cargo(&build).env("RUSTFLAGS", WATCHED).env("CARGO_TARGET_DIR", &folder))?;
    let fuzzers = Fuzzers { inputs, program: folder.join(&host).join("release"), folder };
    on_every_core(decoders()?, |decoder| fuzzers.run(&decoder))
}

/// Common settings of the fuzzers.
struct Fuzzers {
    inputs: u64,
    /// Folder of the compiled decoders.
    program: PathBuf,
    /// Folder of the corpus.
    folder: PathBuf,
}

impl Fuzzers {
    /// Runs a fuzzer; prints its statistics, or its full output after a failure.
    fn run(&self, decoder: &str) -> Outcome {
        let (found, corpus) = (self.folder.join("found/"), self.folder.join("corpus").join(decoder));
        for place in [&found, &corpus] {
            std::fs::create_dir_all(place).map_err(|error| format!("{}: {error}", place.display()))?;
        }
        let inputs = self.inputs;
        let mut fuzzer =
            command(self.program.join(decoder), [format!("-runs={inputs}"), MAX_BYTES.to_owned()]);
        let prefix = format!("-artifact_prefix={}/{decoder}-", found.display());
        fuzzer
            .args(["-seed=1", "-timeout=10", "-verbosity=0", "-print_final_stats=1"])
            .arg(prefix)
            .arg(corpus);
        let start = Instant::now();
        let output = fuzzer.output().map_err(|error| format!("cannot start {decoder}: {error}"))?;
        let said = String::from_utf8_lossy(&output.stderr);
        if !output.status.success() {
            eprint!("{said}");
            return Err(format!("{decoder} failed; the input is in {}", found.display()));
        }
        let figure = |name| said.lines().find_map(|line| line.strip_prefix(name)).map_or("?", str::trim);
        let (slowest_s, rss_mb) = (figure(SLOWEST), figure("stat::peak_rss_mb:"));
        let seconds = start.elapsed().as_secs();
        println!("{decoder}: {inputs} inputs in {seconds} s, slowest {slowest_s} s, {rss_mb} MB");
        Ok(())
    }
}

/// Returns the names of all decoders.
fn decoders() -> Result<Vec<String>, String> {
    let folder = top().join("fuzz/fuzz_targets");
    let name = |path: PathBuf| path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let entries = std::fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut names: Vec<_> = entries.flatten().filter_map(|entry| name(entry.path())).collect();
    names.sort();
    Ok(names)
}

/// Returns the compiler's name of the host.
fn host() -> Result<String, String> {
    let output = command("rustc", ["--version", "--verbose"]).output();
    let output = output.map_err(|error| format!("cannot start rustc: {error}"))?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let host = text.lines().find_map(|line| line.strip_prefix("host: "));
    host.map(str::to_owned).ok_or_else(|| "rustc printed no host".to_owned())
}

//! `cargo xtask fuzz`: every decoder under libFuzzer, on the stable compiler.
//!
//! The folder `fuzz` is laid out for `cargo fuzz` too: `cargo fuzz run packets --sanitizer none`.

use std::path::PathBuf;
use std::process::Command;

use crate::setup::install;
use crate::shell::{Outcome, cargo, command, run, succeeds, target, top};

/// Inputs of each decoder, unless another number is asked for: about a minute each on one core.
pub(crate) const INPUTS: u64 = 10_000_000;
/// Longest input: more than two frames of the command line.
const MAX_BYTES: &str = "-max_len=600";

/// What makes the compiled code tell the fuzzer where it has been.
const WATCHED: &str = "--cfg fuzzing -C passes=sancov-module -C llvm-args=-sanitizer-coverage-level=4 \
    -C llvm-args=-sanitizer-coverage-inline-8bit-counters -C llvm-args=-sanitizer-coverage-pc-table \
    -C llvm-args=-sanitizer-coverage-trace-compares";

/// Gives every decoder `inputs` inputs; what breaks one is kept and named.
pub(crate) fn fuzz(inputs: u64) -> Outcome {
    if !succeeds(&mut command("c++", ["--version"])) {
        install(&["g++"], "building libFuzzer")?;
    }
    let host = host()?;
    let folder = target().join("fuzz");
    let build = ["build", "--release", "--manifest-path", "fuzz/Cargo.toml", "--target", &host];
    run(cargo(&build).env("RUSTFLAGS", WATCHED).env("CARGO_TARGET_DIR", &folder))?;
    for decoder in decoders()? {
        let (found, corpus) = (folder.join("found/"), folder.join("corpus").join(&decoder));
        for place in [&found, &corpus] {
            std::fs::create_dir_all(place).map_err(|error| format!("{}: {error}", place.display()))?;
        }
        println!("{inputs} inputs for {decoder}");
        let program = folder.join(&host).join("release").join(&decoder);
        let mut fuzzer = command(program, [format!("-runs={inputs}"), MAX_BYTES.to_owned()]);
        let prefix = format!("-artifact_prefix={}/", found.display());
        fuzzer
            .args(["-seed=1", "-timeout=10", "-verbosity=0", "-print_final_stats=1"])
            .arg(prefix)
            .arg(corpus);
        quietly(&mut fuzzer).map_err(|error| format!("{error}; the input is in {}", found.display()))?;
    }
    Ok(())
}

/// Runs a fuzzer; shows its figures, and all it says when it found something.
fn quietly(fuzzer: &mut Command) -> Outcome {
    let output = fuzzer.output().map_err(|error| format!("the fuzzer could not be started: {error}"))?;
    let said = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        eprint!("{said}");
        return Err("a decoder broke".to_owned());
    }
    for line in said.lines().filter_map(|line| line.strip_prefix("stat::")) {
        println!("  {line}");
    }
    Ok(())
}

/// Every program of the folder.
fn decoders() -> Result<Vec<String>, String> {
    let folder = top().join("fuzz/fuzz_targets");
    let name = |path: PathBuf| path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let entries = std::fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut names: Vec<_> = entries.flatten().filter_map(|entry| name(entry.path())).collect();
    names.sort();
    Ok(names)
}

/// The machine this runs on, as the compiler calls it.
fn host() -> Result<String, String> {
    let output = command("rustc", ["--version", "--verbose"]).output();
    let output = output.map_err(|error| format!("rustc could not be started: {error}"))?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let host = text.lines().find_map(|line| line.strip_prefix("host: "));
    host.map(str::to_owned).ok_or_else(|| "rustc does not say what machine this is".to_owned())
}

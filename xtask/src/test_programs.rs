//! Runs all test programs in parallel, one more than there are cores, the longest first. Cargo would run them
//! in sequence.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::Command;
use std::time::Instant;

use serde::Deserialize;

use crate::shell::{Outcome, at_once, cargo, cargo_emulator, cores, run};

/// The longest programs, by name.
const LONGEST: [&str; 8] = ["chip", "emulated", "cycles", "replay", "page", "power_cut", "connect", "live"];

/// Returns commands that build all test programs of both workspaces.
pub(crate) fn builds() -> [Command; 2] {
    [cargo(&["test", "--workspace"]), cargo_emulator("test")].map(|mut build| {
        build.args(["--no-run", "--quiet"]);
        build
    })
}

/// A message of cargo about a built target.
#[derive(Deserialize)]
struct Built {
    manifest_path: PathBuf,
    executable: Option<PathBuf>,
    target: Target,
    profile: Profile,
}

#[derive(Deserialize)]
struct Target {
    name: String,
}

#[derive(Deserialize)]
struct Profile {
    test: bool,
}

/// A test program and its package's folder.
struct Program {
    name: String,
    file: PathBuf,
    folder: PathBuf,
}

impl Program {
    /// Parses a line of cargo's messages; `None` if it is not a test program.
    fn of(line: &str) -> Option<Self> {
        // Skips other messages.
        let Built { manifest_path, executable, target, profile } = serde_json::from_str(line).ok()?;
        let folder = manifest_path.parent()?.to_owned();
        Some(Self { name: target.name, file: executable.filter(|_| profile.test)?, folder })
    }

    /// Sort key: the longest programs first.
    fn rank(&self) -> usize {
        LONGEST.iter().position(|name| *name == self.name).unwrap_or(LONGEST.len())
    }

    /// Runs the program; adds its name to an error.
    fn run(&self, environment: &[(&str, OsString)]) -> Outcome {
        let Self { name, file, folder } = self;
        let start = Instant::now();
        let mut command = Command::new(file);
        // Two threads: tests often wait.
        command.args(["--quiet", "--test-threads", "2"]).current_dir(folder);
        let output = command.env("CARGO_MANIFEST_DIR", folder).envs(environment.iter().cloned()).output();
        let output = output.map_err(|error| format!("{}: {error}", file.display()))?;
        let [said, errors] =
            [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
        let skipped = errors.lines().filter(|line| line.starts_with("skipped:"));
        skipped.for_each(|line| println!("{line}"));
        println!("{name}: {:.1} s", start.elapsed().as_secs_f64());
        if output.status.success() {
            return Ok(());
        }
        println!("{said}{errors}");
        Err(format!("{name}: {}", output.status))
    }
}

/// Builds and runs all test programs with these variables, and the documentation's examples; lists the
/// failures.
pub(crate) fn run_all(environment: &[(&str, OsString)]) -> Outcome {
    let mut programs = Vec::new();
    for mut build in builds() {
        let told = build.arg("--message-format=json").output();
        let told = told.map_err(|error| format!("cannot start cargo: {error}"))?;
        if !told.status.success() {
            return Err(String::from_utf8_lossy(&told.stderr).into_owned());
        }
        programs.extend(String::from_utf8_lossy(&told.stdout).lines().filter_map(Program::of));
    }
    programs.sort_by_key(Program::rank);
    if programs.is_empty() {
        return Err("cargo built no test program".to_owned());
    }
    // One more, because some tests wait.
    let tests = at_once(cores() + 1, programs, |program| program.run(environment));
    let examples = run(&mut cargo(&["test", "--workspace", "--doc", "--quiet"]));
    let failed: Vec<String> = [tests, examples].into_iter().filter_map(Result::err).collect();
    if failed.is_empty() { Ok(()) } else { Err(failed.join("; ")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_test_program_is_found_in_what_cargo_tells() {
        let line = |executable: &str, test: bool| {
            format!(
                r#"{{"reason":"compiler-artifact","manifest_path":"/top/drive/Cargo.toml","target":{{"name":"foc"}},"profile":{{"test":{test}}},"executable":{executable}}}"#
            )
        };
        let found = Program::of(&line("\"/target/foc-1\"", true)).unwrap();
        assert_eq!((found.name.as_str(), found.folder), ("foc", PathBuf::from("/top/drive")));
        for other in [line("null", true), line("\"/target/foc\"", false), "{}".to_owned(), String::new()] {
            assert!(Program::of(&other).is_none(), "{other}");
        }
    }

    #[test]
    fn a_program_that_fails_is_named() {
        let program = |file: &str| Program { name: "x".to_owned(), file: file.into(), folder: "/".into() };
        assert_eq!(program("/bin/true").run(&[]), Ok(()));
        assert!(program("/bin/false").run(&[]).unwrap_err().starts_with("x: "));
        assert!(program("/no/such/file").run(&[]).is_err());
    }
}

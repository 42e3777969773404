//! Runs programs of `dimsart`.

use std::ffi::OsString;
use std::path::PathBuf;

use crate::shell::{Outcome, cargo, command, image_folder, run, target};

/// Builds `dimsart`; returns its path.
pub(crate) fn dimsart() -> Result<PathBuf, String> {
    build("dev", &["--bin", "dimsart", "--example", "scheme_budgets"])?;
    Ok(target().join("debug/dimsart"))
}

/// Returns the output of an example built with a cargo profile; its images are in [`image_folder`] unless its
/// arguments say otherwise.
pub(crate) fn example(name: &str, profile: &str, arguments: &[OsString]) -> Result<String, String> {
    build(profile, &["--example", name])?;
    let built = if profile == "dev" { "debug" } else { profile };
    let mut command = command(target().join(built).join("examples").join(name), arguments);
    let output = command.env("DIMSART_FIRMWARE", image_folder()).output();
    let output = output.map_err(|error| format!("cannot run the example {name}: {error}"))?;
    if output.status.success() {
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    } else {
        Err(format!("the example {name} failed: {}", String::from_utf8_lossy(&output.stderr)))
    }
}

/// Builds with the whole workspace and always with an example: cargo then selects the same features as for
/// the tests and reuses their build.
fn build(profile: &str, targets: &[&str]) -> Outcome {
    run(cargo(&["build", "--quiet", "--workspace", "--profile", profile]).args(targets))
}

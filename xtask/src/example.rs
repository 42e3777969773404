//! Examples of `dimsart` that tell what images take.

use std::ffi::OsString;

use crate::boards::folder;
use crate::shell::{cargo, run};

/// What an example prints, built with one of cargo's profiles; it finds images in [`folder`] unless its arguments say
/// otherwise.
pub(crate) fn example(name: &str, profile: &str, arguments: &[OsString]) -> Result<String, String> {
    let example = ["--quiet", "--profile", profile, "--package", "dimsart", "--example", name];
    // Apart from the run, to show how the build goes.
    run(cargo(&["build"]).args(example))?;
    let mut command = cargo(&["run"]);
    command.args(example).arg("--").args(arguments).env("DIMSART_FIRMWARE", folder());
    let output = command.output().map_err(|error| format!("cannot run the example {name}: {error}"))?;
    if output.status.success() {
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    } else {
        Err(format!("the example {name} failed: {}", String::from_utf8_lossy(&output.stderr)))
    }
}

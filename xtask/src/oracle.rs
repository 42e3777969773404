//! Comparison with other implementations: reference runs, and a page with the deviations.

use std::path::PathBuf;

use crate::setup;
use crate::shell::{Outcome, cargo, command, on_every_core, run, target, top};

/// Scripts that write reference runs.
const REFERENCES: [&str; 6] = ["two_sided_loop", "joint", "arm", "phantom", "identify", "modules"];

/// Returns the folder of the reference runs.
pub(crate) fn folder() -> PathBuf {
    target().join("oracle")
}

/// Writes the reference runs.
pub(crate) fn references() -> Outcome {
    let python = setup::python()?;
    on_every_core(REFERENCES.to_vec(), |name| {
        let script = format!("tests/oracle/{name}.py");
        run(command(&python, ["-B", &script, "--out"]).current_dir(top()).arg(folder()))
    })
}

/// Runs every comparison and writes the page.
pub(crate) fn report() -> Outcome {
    references()?;
    let mut tests = cargo(&["test", "--quiet", "--package", "dimsart-tests", "--test", "oracle"]);
    // The page also shows failures.
    let tested = run(tests.env("DIMSART_ORACLE", folder()));
    let mut page = command(setup::python()?, ["-B", "tests/oracle/report.py", "--found"]);
    page.current_dir(top()).arg(folder().join("found")).arg("--out").arg(target().join("oracle-report"));
    run(&mut page).and(tested)
}

//! What outside implementations say: the reference runs, and the page of how far everything is from them.

use std::path::PathBuf;

use crate::setup;
use crate::shell::{Outcome, cargo, command, on_every_core, run, target, top};

/// The scripts that write reference runs.
const REFERENCES: [&str; 6] = ["two_sided_loop", "joint", "arm", "phantom", "identify", "modules"];

/// Where the reference runs are.
pub(crate) fn folder() -> PathBuf {
    target().join("oracle")
}

/// Has the reference runs written.
pub(crate) fn references() -> Outcome {
    let python = setup::python()?;
    on_every_core(REFERENCES.to_vec(), |name| {
        let script = format!("tests/oracle/{name}.py");
        run(command(&python, ["-B", &script, "--out"]).current_dir(top()).arg(folder()))
    })
}

/// Runs every comparison and draws the page.
pub(crate) fn report() -> Outcome {
    references()?;
    let mut tests = cargo(&["test", "--quiet", "--package", "dimsart-tests", "--test", "oracle"]);
    // The page shows what is wrong, too.
    let tested = run(tests.env("DIMSART_ORACLE", folder()));
    let mut page = command(setup::python()?, ["-B", "tests/oracle/report.py", "--found"]);
    page.current_dir(top()).arg(folder().join("found")).arg("--out").arg(target().join("oracle-report"));
    run(&mut page).and(tested)
}

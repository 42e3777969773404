//! The page in a browser: what a user does with it, by `dimsart/tests/browser/page.py`.

use crate::setup;
use crate::shell::{Outcome, cargo, command, run, target, top};

/// Tries it; pictures of its main states go to `target/page`.
pub(crate) fn page() -> Outcome {
    setup::browser()?;
    run(&mut cargo(&["build", "--quiet", "--package", "dimsart"]))?;
    let script = top().join("dimsart/tests/browser/page.py");
    let dimsart = target().join("debug/dimsart");
    run(command(setup::python()?, ["-B"]).arg(script).arg(dimsart).arg(target().join("page")))
}

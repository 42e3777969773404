//! Browser tests of the page, with `dimsart/tests/browser/page.py`.

use crate::example::dimsart;
use crate::setup;
use crate::shell::{Outcome, command, run, target, top};

/// Checks the types of the scripts and runs the tests; writes pictures of the main states to `target/page`.
pub(crate) fn page() -> Outcome {
    setup::browser()?;
    run(command(setup::typescript()?, ["--project"]).arg(top().join("dimsart/tests/browser")))?;
    let script = top().join("dimsart/tests/browser/page.py");
    run(command(setup::python()?, ["-B"]).arg(script).arg(dimsart()?).arg(target().join("page")))
}

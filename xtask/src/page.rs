//! The page in a browser: what a user does with it, by `dimsart/tests/browser/page.py`.

use crate::example::dimsart;
use crate::setup;
use crate::shell::{Outcome, command, run, target, top};

/// Tries it; pictures of its main states go to `target/page`.
pub(crate) fn page() -> Outcome {
    setup::browser()?;
    let script = top().join("dimsart/tests/browser/page.py");
    run(command(setup::python()?, ["-B"]).arg(script).arg(dimsart()?).arg(target().join("page")))
}

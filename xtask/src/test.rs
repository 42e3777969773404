//! All tests, with everything they need.

use crate::shell::{Outcome, cargo, command, run, top};
use crate::{bench, panic_free, setup};

/// Sets up what is missing and runs every test.
pub(crate) fn test() -> Outcome {
    let python = setup::python()?;
    let oracle = top().join("target/oracle");
    let script = ["-B", "tests/oracle/two_sided_loop.py", "--out"];
    run(command(python, script).arg(&oracle))?;
    run(cargo(&["test", "--workspace", "--exclude", "boards", "--exclude", "firmware"])
        .env("DIMSART_ORACLE", &oracle))
}

/// What continuous integration runs.
pub(crate) fn ci() -> Outcome {
    run(&mut cargo(&["fmt", "--all", "--check"]))?;
    let host = ["--workspace", "--exclude", "boards", "--exclude", "firmware"];
    run(cargo(&["clippy", "--all-targets", "--quiet"]).args(host).args(["--", "--deny", "warnings"]))?;
    run(cargo(&["doc", "--no-deps", "--quiet"]).args(host).env("RUSTDOCFLAGS", "--deny warnings"))?;
    test()?;
    panic_free::run()?;
    bench::run()
}
